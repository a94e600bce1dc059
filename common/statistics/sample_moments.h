// Count, mean and sum of squared deviations of a sample, gathered in one pass or merged from parts.
// Welford 1962; Chan, Golub, LeVeque 1983.
#pragma once

#include <span>

namespace tandem {

struct SampleMoments {
    double count = 0.0;
    double mean = 0.0;
    double squared_deviations = 0.0;

    void add(double value);
    void merge(const SampleMoments& other);

    [[nodiscard]] double variance() const;          // unbiased, of one value; NaN below two values
    [[nodiscard]] double variance_of_mean() const;  // variance() / count
};

[[nodiscard]] SampleMoments moments_of(std::span<const double> values);

}  // namespace tandem
