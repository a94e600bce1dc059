// Goodness of fit for samplers: Pearson's chi-square over cells, cells that expect fewer than
// 5 pooled, and nothing may fall where nothing can.
#pragma once

#include <boost/math/distributions/chi_squared.hpp>
#include <cstddef>
#include <vector>

namespace tandem::test {

struct GoodnessOfFit {
    double p = 0.0;              // the chance of so great a deviation
    double where_none = 0.0;     // samples in cells that expect none
    std::size_t cells = 0;       // after pooling
    std::size_t least_cell = 5;  // expectations below are pooled
};

inline GoodnessOfFit goodness_of_fit(const std::vector<double>& counts, const std::vector<double>& expected) {
    GoodnessOfFit result;
    double statistic = 0.0, pooled_count = 0.0, pooled_expected = 0.0;
    const auto add = [&](double count, double mean) {
        statistic += (count - mean) * (count - mean) / mean;
        ++result.cells;
    };
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (expected[i] == 0.0) {
            result.where_none += counts[i];
        } else if (expected[i] < static_cast<double>(result.least_cell)) {
            pooled_count += counts[i];
            pooled_expected += expected[i];
        } else {
            add(counts[i], expected[i]);
        }
    }
    if (pooled_expected > 0.0) add(pooled_count, pooled_expected);
    if (result.cells < 2) return result;
    const boost::math::chi_squared distribution(static_cast<double>(result.cells - 1));
    result.p = boost::math::cdf(boost::math::complement(distribution, statistic));
    return result;
}

}  // namespace tandem::test
