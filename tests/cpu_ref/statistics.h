// Goodness of fit for samplers: a chi-squared statistic over bins, with the normal approximation of its tail.
#pragma once

#include <cmath>
#include <vector>

namespace tandem::test {

// Standard deviations by which chi-squared exceeds its mean [Wilson and Hilferty 1931]; bins that expect fewer than 8
// are pooled. Samples on a regular grid of numbers vary less than random ones, so that only an excess is a fault.
inline double chi_squared_excess(const std::vector<double>& counts, const std::vector<double>& expected) {
    double chi = 0.0, rest = 0.0, rest_expected = 0.0;
    int bins = -1;
    const auto add = [&](double count, double mean) {
        chi += (count - mean) * (count - mean) / mean;
        ++bins;
    };
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (expected[i] >= 8.0) {
            add(counts[i], expected[i]);
        } else {
            rest += counts[i];
            rest_expected += expected[i];
        }
    }
    if (rest_expected >= 8.0)
        add(rest, rest_expected);
    else if (rest > rest_expected + 6.0 * std::sqrt(rest_expected + 1.0))
        return 1e9;  // where none should be
    if (bins < 1) return 1e9;
    const double k = bins, spread = 2.0 / (9.0 * k);
    return (std::cbrt(chi / k) - (1.0 - spread)) / std::sqrt(spread);
}

}  // namespace tandem::test
