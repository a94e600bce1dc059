#include "common/commands/verify_films.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/commands/arguments.h"
#include "common/commands/memory.h"
#include "common/error.h"
#include "common/render/film_regions.h"
#include "common/text.h"

namespace tandem {

namespace {

// As measured: both sides' sums and batches, and what the verdict works on.
constexpr std::uint64_t pixel_bytes = 600;
constexpr std::uint32_t bins_along = 128;  // the longer side, as verify's films have where no --size is given

// Why no bins can be judged, and the mend; empty: they can.
std::string no_bins(const RenderSettings& settings, const VerifyArguments& arguments, bool several_devices) {
    for (const std::string& side : {arguments.reference, arguments.candidate})
        if (side != "cpu" && side != "vulkan" && side != "oracle")
            return fmt::format("{} renders whole films alone; render both sides and use tandem compare --bin", side);
    if (several_devices) return "several devices share whole films alone; name one --device";
    if (arguments.convergence) return "--convergence is of whole films; leave it out";
    for (const std::string& kernel : {arguments.kernel, arguments.reference_kernel})
        if (kernel == "fragment") return "fragments cover no lists of pixels; use another --kernel";
    return why_no_pixel_lists(settings);
}

}  // namespace

VerifiedFilm film_within(
    std::uint64_t limit, const RenderSettings& settings, const VerifyArguments& arguments, bool several_devices) {
    const FilmSize film{settings.width, settings.height};
    const std::uint64_t needed = resident_bytes() + film.pixel_count() * pixel_bytes;
    if (needed <= limit) return {settings, std::nullopt};
    const RenderSettings bins =
        with_longer_side(settings, std::min(bins_along, std::max(settings.width, settings.height)));
    std::string obstacle = no_bins(settings, arguments, several_devices);
    if (obstacle.empty() && bins.width == settings.width) obstacle = "it has too few pixels for bins";
    if (obstacle.empty()) return {bins, film};
    throw InputError(fmt::format(
        "a film of {}x{} takes {} of memory, and the limit is {}; {}, give more --memory, or choose a smaller --size",
        film.width, film.height, shown_bytes(needed), shown_bytes(limit), obstacle));
}

void check_bins(const VerifiedFilm& of, const Scene& scene, const std::string& file,
    const std::vector<const Renderer*>& renderers, std::uint64_t limit, bool verbose) {
    if (!of.film) return;
    RenderSettings whole = of.settings;
    whole.width = of.film->width;
    whole.height = of.film->height;
    const FilmUse use{.pixels = std::uint64_t{of.settings.width} * of.settings.height, .samples = 1, .whole = false};
    std::uint64_t needed = resident_bytes() + use.pixels * pixel_bytes;
    for (const Renderer* const renderer : renderers) {
        const MemoryNeed need = memory_need(*renderer, scene, whole, use);
        needed += need.total() - need.program;
    }
    if (verbose)
        fmt::print(stderr, "{}: memory: {} forecast, limit {}; {}x{} bins of {}x{} pixels\n", escaped(scene.name),
            shown_bytes(needed), shown_bytes(limit), of.settings.width, of.settings.height, of.film->width,
            of.film->height);
    if (needed > limit)
        throw InputError(
            fmt::format("{}: takes {} of memory, film in bins included, and the limit is {}; simplify "
                        "the scene or give more --memory",
                file, shown_bytes(needed), shown_bytes(limit)));
}

}  // namespace tandem
