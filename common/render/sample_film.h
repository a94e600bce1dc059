// A convergence film: the images with 1, f, f², … samples a pixel, up to the final one.
#pragma once

#include "common/render/stopping.h"

namespace tandem {

// Renders to 1, f, f², … samples a pixel, and to `rule.samples` if it has them; `f` is a power of two. Calls
// keep(samples, film) for each image: it has the bits of a render of so many samples. Ends as render_until does, and
// returns what there was then. The rule has no relative error.
[[nodiscard]] StoppedRender render_film(RenderJob& job, const StoppingRule& rule, std::uint64_t factor,
    const std::stop_token& stop, const std::function<void(const RenderProgress&)>& progress,
    const std::function<void(std::uint64_t, const FilmMoments&)>& keep);

}  // namespace tandem
