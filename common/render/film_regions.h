// A film that does not fit into memory at once, rendered region by region. Each pixel has the bits that it has in a
// render of the whole film. For its random numbers depend on the pixel and the sample alone (MODEL.md section 3).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/image/tiled_image.h"
#include "common/render/renderer.h"

namespace tandem {

// The film in regions of at most `tiles` >= 1 tiles of the file: parts of a row of tiles, or whole rows of them. They
// come in the order of the tiles in the file.
[[nodiscard]] std::vector<PixelRectangle> film_regions(
    std::uint32_t width, std::uint32_t height, std::uint32_t edge, std::uint64_t tiles);

// Why such settings cannot be rendered as lists of pixels, and the mend; empty: they can.
[[nodiscard]] std::string why_no_pixel_lists(const RenderSettings& settings);

// A job for lists of at most `most` pixels at a time. It takes no memory for the film.
[[nodiscard]] std::unique_ptr<RenderJob> prepare_pixel_lists(
    Renderer& renderer, const Scene& scene, RenderSettings settings, std::uint32_t most);

struct RegionsRender {
    double seconds = 0.0;  // of rendering
    std::optional<double> device_seconds;
    std::uint64_t invalid = 0;             // samples
    double done = 0.0;                     // of all samples; 1: complete
    double samples_done = 0.0;             // over pixels; 0: nothing was kept
    bool complete = false;                 // false: stopped
    std::optional<double> relative_error;  // as relative_error_of() tells it; none below two samples
};

// Renders samples [0, samples) of every pixel of a film `width` wide, and hands each region's film to `keep`. `job` is
// prepared with Sampling::adaptive. `control.progress` is told the part of all samples that is done. A stop cuts a
// region's samples short, and the rest of the regions come without samples.
[[nodiscard]] RegionsRender render_regions(RenderJob& job, std::uint32_t width,
    const std::vector<PixelRectangle>& regions, std::uint64_t samples, const RenderControl& control,
    const std::function<void(const PixelRectangle&, FilmMoments)>& keep);

}  // namespace tandem
