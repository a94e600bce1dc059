// Pixels whose samples are all the same on both sides (a light seen directly, a constant background, black). No test
// applies: the values themselves must be equal to rounding.
#pragma once

#include <cstdint>
#include <vector>

#include "common/validation/verdict/sampled_image.h"

namespace tandem {

// Relative rounding that float transport of `bounces` scattering events can pile up between two backends.
//
// In units of u = 2^-24 a side: each event multiplies the throughput (1), after forming 1 - alpha (1 - C) (3) from a
// rounded colour (1). It may divide by the roulette's q (1). Each of the D + 1 segments adds to the radiance (1).
// The radiance comes once, or the background mix a, 1 - a, two products and a sum (5 with its colours). So do its
// weight and the final store, 1 each. So at most 7 D + 8 half-ulps a side, as many ulps (2^-23) between two sides.
[[nodiscard]] double float_transport_tolerance(std::uint32_t bounces);

struct FixedPixels {
    std::vector<bool> fixed;  // [(y * width + x) * 3 + channel]: tested here, not by statistics
    std::uint64_t count = 0;
    std::uint64_t mismatches = 0;
    std::size_t first_mismatch = 0;  // index as in `fixed`
    double greatest_relative = 0.0;  // greatest relative difference among them
};

// A pixel is fixed when the relative deviation of its samples is within `tolerance` on both sides. A handful of images
// may lie together by chance. So where a side is that, the same must hold of the pixel's neighbours.
//
// Samples within `tolerance` may still vary: on a smooth gradient, by its slope across the pixel. So a mismatch is what
// exceeds the tolerance by more than six standard errors of both means. Where the samples are the same, those are 0.
[[nodiscard]] FixedPixels compare_fixed_pixels(
    const SampledImage& reference, const SampledImage& candidate, double tolerance);

}  // namespace tandem
