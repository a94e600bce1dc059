// `tandem render` of films that do not fit into memory: region by region, into an .exr file of tiles.
#pragma once

#include <vector>

#include "common/commands/console.h"
#include "common/commands/memory.h"
#include "common/commands/render_arguments.h"
#include "common/image/tiled_image.h"
#include "common/stopwatch.h"

namespace tandem {

struct MemoryPlan {
    std::uint64_t limit = 0;
    MemoryNeed need;
    std::vector<PixelRectangle> regions;  // empty: the film fits

    [[nodiscard]] std::uint64_t region_pixels() const { return regions.empty() ? 0 : regions.front().pixel_count(); }
    [[nodiscard]] std::string text() const;
    // MiB; with the peak so far, against which the forecast can be held.
    [[nodiscard]] nlohmann::json json() const;
};

// Before anything large is allocated. Throws InputError where scene or film do not fit: how much they take, the limit,
// and the mend.
[[nodiscard]] MemoryPlan plan_memory(const RenderArguments& arguments, const RenderSettings& settings,
    const StoppingRule& rule, const Scene& scene, const Renderer& renderer);

// `starting` ends where something is to be kept. A stop or --time leaves a film whose other pixels have no samples, and
// ExitStatus::undecided. Throws StoppedError, and nothing is written, where no pixel has one.
[[nodiscard]] ExitStatus render_tiles(const RenderArguments& arguments, const RenderSettings& settings,
    const StoppingRule& rule, const Scene& scene, Renderer& renderer, const MemoryPlan& memory, const Stopwatch& watch,
    NothingToKeep& starting, const CommandContext& context);

}  // namespace tandem
