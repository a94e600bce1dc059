#include "common/statistics/sample_moments.h"

#include <limits>

namespace tandem {

void SampleMoments::add(double value) {
    count += 1.0;
    const double step = value - mean;
    mean += step / count;
    squared_deviations += step * (value - mean);
}

void SampleMoments::merge(const SampleMoments& other) {
    if (other.count == 0.0) return;
    const double total = count + other.count;
    const double step = other.mean - mean;
    mean += step * (other.count / total);
    squared_deviations += other.squared_deviations + step * step * (count * other.count / total);
    count = total;
}

double SampleMoments::variance() const {
    return count < 2.0 ? std::numeric_limits<double>::quiet_NaN() : squared_deviations / (count - 1.0);
}

double SampleMoments::variance_of_mean() const { return variance() / count; }

SampleMoments moments_of(std::span<const double> values) {
    SampleMoments moments;
    for (const double value : values) moments.add(value);
    return moments;
}

}  // namespace tandem
