#include "common/validation/verdict/error_metrics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace tandem {

ErrorMetrics error_metrics(const SampledImage& reference, const SampledImage& candidate) {
    ErrorMetrics metrics;
    std::vector<double> terms;
    const auto count = static_cast<double>(reference.pixels.size());
    for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
        const PixelStatistics &r = reference.pixels[i], &x = candidate.pixels[i];
        const double square = (x.mean - r.mean) * (x.mean - r.mean);
        metrics.mse += square / count;
        metrics.noise_mse += (x.variance / x.count + r.variance / r.count) / count;
        terms.push_back(square / (r.mean * r.mean + ErrorMetrics::epsilon));
    }
    if (terms.empty()) return metrics;
    metrics.rmse = std::sqrt(metrics.mse);
    metrics.relative_mse = std::accumulate(terms.begin(), terms.end(), 0.0) / count;
    const auto kept = terms.size() - static_cast<std::size_t>(std::ceil(ErrorMetrics::trimmed * count));
    const auto end = terms.begin() + static_cast<std::ptrdiff_t>(kept);
    std::ranges::nth_element(terms, end);
    metrics.trimmed_relative_mse =
        kept > 0 ? std::accumulate(terms.begin(), end, 0.0) / static_cast<double>(kept) : metrics.relative_mse;
    return metrics;
}

}  // namespace tandem
