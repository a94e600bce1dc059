#include "common/validation/fixed_pixels.h"

#include <algorithm>
#include <cmath>

namespace tandem {

namespace {

bool is_fixed(const PixelStatistics& pixel, double tolerance) {
    return pixel.count >= 2.0 && std::sqrt(pixel.variance) <= tolerance * std::abs(pixel.mean);
}

}  // namespace

double float_transport_tolerance(std::uint32_t bounces) { return (7.0 * bounces + 8.0) * 0x1p-23; }

FixedPixels compare_fixed_pixels(const SampledImage& reference, const SampledImage& candidate, double tolerance) {
    FixedPixels result;
    result.fixed.assign(reference.pixels.size(), false);
    for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
        const PixelStatistics &a = reference.pixels[i], &b = candidate.pixels[i];
        if (!is_fixed(a, tolerance) || !is_fixed(b, tolerance)) continue;
        result.fixed[i] = true;
        ++result.count;
        const double larger = std::max(std::abs(a.mean), std::abs(b.mean));
        if (larger == 0.0) continue;
        const double relative = std::abs(a.mean - b.mean) / larger;
        result.greatest_relative = std::max(result.greatest_relative, relative);
        if (relative > tolerance && result.mismatches++ == 0) result.first_mismatch = i;
    }
    return result;
}

}  // namespace tandem
