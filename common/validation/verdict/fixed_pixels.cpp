#include "common/validation/verdict/fixed_pixels.h"

#include <algorithm>
#include <cmath>

namespace tandem {

namespace {

bool without_variance(const PixelStatistics& pixel, double tolerance) {
    return pixel.count >= 2.0 && std::sqrt(pixel.variance) <= tolerance * std::abs(pixel.mean);
}

// Values that come from so few images that they may lie together by chance.
bool may_be_chance(const PixelStatistics& pixel) { return pixel.count < 64.0; }

// Whether the pixel's neighbours in the image, up to eight, are as marked in `flags` in the same channel.
bool neighbours_marked(const std::vector<bool>& flags, const SampledImage& image, std::size_t index) {
    const std::size_t channel = index % channel_count, pixel = index / channel_count;
    const std::size_t x = pixel % image.width, y = pixel / image.width;
    for (std::size_t v = y == 0 ? 0 : y - 1; v <= std::min<std::size_t>(y + 1, image.height - 1); ++v)
        for (std::size_t u = x == 0 ? 0 : x - 1; u <= std::min<std::size_t>(x + 1, image.width - 1); ++u)
            if (!flags[(v * image.width + u) * channel_count + channel]) return false;
    return true;
}

}  // namespace

double float_transport_tolerance(std::uint32_t bounces) { return (7.0 * bounces + 8.0) * 0x1p-23; }

FixedPixels compare_fixed_pixels(const SampledImage& reference, const SampledImage& candidate, double tolerance) {
    FixedPixels result;
    result.fixed.assign(reference.pixels.size(), false);
    std::vector<bool> still(reference.pixels.size());
    for (std::size_t i = 0; i < still.size(); ++i)
        still[i] = without_variance(reference.pixels[i], tolerance) && without_variance(candidate.pixels[i], tolerance);
    for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
        const PixelStatistics &a = reference.pixels[i], &b = candidate.pixels[i];
        if (!still[i]) continue;
        if ((may_be_chance(a) || may_be_chance(b)) && !neighbours_marked(still, reference, i)) continue;
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
