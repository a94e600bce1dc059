// False colours of the report's maps, as sRGB values in [0, 1]; linear between the named points.
#pragma once

#include <array>
#include <vector>

#include "common/image/image_io.h"

namespace tandem {

using Colour = std::array<double, 3>;

// t in [-1, 1], beyond it the ends: blue #2166ac (candidate darker), white, red #b2182b (candidate brighter); the ends
// of ColorBrewer's RdBu.
[[nodiscard]] Colour diverging_colour(double t);

// t in [0, 1], beyond it the ends: white #fcbba1 #fb6a4a #cb181d #67000d, of ColorBrewer's Reds. So a map of nothing is
// white and not black.
[[nodiscard]] Colour sequential_colour(double t);

// A linear image that write_png turns into these colours: one figure a pixel, in rows from above.
using ColourMap = Colour (*)(double);
[[nodiscard]] Image false_colour_image(
    std::uint32_t width, std::uint32_t height, const std::vector<double>& figures, ColourMap map);

}  // namespace tandem
