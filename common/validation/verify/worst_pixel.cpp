#include "common/validation/verify/worst_pixel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/error.h"
#include "common/validation/verify/trace_comparison.h"

namespace tandem {

namespace {

// Infinite where neither side has noise but they differ.
double standard_errors_apart(const PixelStatistics& a, const PixelStatistics& b) {
    const double apart = std::abs(a.mean - b.mean);
    return apart > 0.0 ? apart / std::sqrt(a.variance / a.count + b.variance / b.count) : 0.0;
}

double largest_difference(const glm::dvec3& a, const glm::dvec3& b) {
    const glm::dvec3 d = a - b;
    const double greatest = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
    return std::isfinite(d.x + d.y + d.z) ? greatest : std::numeric_limits<double>::infinity();
}

}  // namespace

WorstPixel worst_pixel_of(
    const SampledImage& reference, const SampledImage& candidate, const std::vector<double>& pixel_p) {
    std::size_t worst = 0;
    std::pair<double, double> least{2.0, 0.0};  // p, and minus the standard errors
    for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
        const double p = i < pixel_p.size() ? pixel_p[i] : 1.0;
        const std::pair<double, double> rank{p, -standard_errors_apart(reference.pixels[i], candidate.pixels[i])};
        if (!(rank < least)) continue;
        least = rank;
        worst = i / channel_count;
    }
    WorstPixel pixel;
    pixel.x = static_cast<std::uint32_t>(worst % reference.width);
    pixel.y = static_cast<std::uint32_t>(worst / reference.width);
    return pixel;
}

void choose_sample(WorstPixel& pixel, RenderJob& reference, RenderJob& candidate) {
    constexpr SampleRange samples{0, samples_per_block};
    std::vector<PathTrace> a, b;
    try {
        a = reference.trace(pixel.x, pixel.y, samples);
        b = candidate.trace(pixel.x, pixel.y, samples);
    } catch (const UnsupportedError&) {
        return;
    }
    double most = -1.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (const double difference = largest_difference(a[i].radiance, b[i].radiance); difference > most) {
            most = difference;
            pixel.sample = samples.begin + i;
        }
    const std::size_t i = pixel.sample - samples.begin;
    const TraceComparison comparison = compare_traces(a[i], b[i]);
    pixel.parts = comparison.first_divergence.has_value();
    pixel.reason = comparison.first_divergence
                       ? fmt::format("the paths part at vertex {}: {}", *comparison.first_divergence, comparison.reason)
                       : "no path parts in its first " + std::to_string(samples.count()) + " samples";
}

}  // namespace tandem
