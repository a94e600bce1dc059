#include "common/validation/verdict/fixed_pixels.h"

#include <algorithm>
#include <cmath>

namespace tandem {

namespace {

// Standard errors by which means of samples that are nearly the same may differ: once in 10^9 pixels.
constexpr double sigmas = 6.0;

bool without_variance(const PixelStatistics& pixel, double tolerance) {
    return pixel.count >= 2.0 && std::sqrt(pixel.variance) <= tolerance * std::abs(pixel.mean);
}

// Values that come from so few images that they may lie together by chance.
bool may_be_chance(const PixelStatistics& pixel) { return pixel.count < 64.0; }

// The pixel and its neighbours in the image, up to eight, in the same channel.
template <class Visit>
void visit_neighbourhood(const SampledImage& image, std::size_t index, const Visit& visit) {
    const std::size_t channel = index % channel_count, pixel = index / channel_count;
    const std::size_t x = pixel % image.width, y = pixel / image.width;
    for (std::size_t v = y == 0 ? 0 : y - 1; v <= std::min<std::size_t>(y + 1, image.height - 1); ++v)
        for (std::size_t u = x == 0 ? 0 : x - 1; u <= std::min<std::size_t>(x + 1, image.width - 1); ++u)
            visit((v * image.width + u) * channel_count + channel);
}

bool neighbours_marked(const std::vector<bool>& flags, const SampledImage& image, std::size_t index) {
    bool all = true;
    visit_neighbourhood(image, index, [&](std::size_t i) { all = all && flags[i]; });
    return all;
}

// The variance of the pixel's mean, or the greatest of its neighbourhood where its own may be small by chance.
double variance_of_mean(const SampledImage& image, std::size_t index) {
    const auto of = [&](std::size_t i) { return image.pixels[i].variance / image.pixels[i].count; };
    double greatest = of(index);
    if (may_be_chance(image.pixels[index]))
        visit_neighbourhood(image, index, [&](std::size_t i) { greatest = std::max(greatest, of(i)); });
    return greatest;
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
        const double by_chance = sigmas * std::sqrt(variance_of_mean(reference, i) + variance_of_mean(candidate, i));
        if (relative > tolerance + by_chance / larger && result.mismatches++ == 0) result.first_mismatch = i;
    }
    return result;
}

}  // namespace tandem
