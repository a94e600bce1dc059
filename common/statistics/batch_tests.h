// Tests on batches. A batch sums up many samples, so little needs to be known of the distribution of one sample.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/statistics/interval.h"

namespace tandem {

// Permutation test of "both sides' batches are drawn from one distribution". It is exact for any distribution, up to
// the Monte Carlo choice of permutations. p = (1 + number at least as extreme) / (1 + permutations). [Phipson, Smyth
// 2010] Each batch is a vector of figures (tiles, channels). The statistic is the greatest |Welch t| over them, so the
// p holds for the whole family [Westfall, Young 1993]. Stops early once `enough` permutations were as extreme, as p is
// large then.
struct PermutationOptions {
    std::uint32_t permutations = 2000;
    std::uint32_t enough = 50;
    std::uint64_t seed = 1;
};
[[nodiscard]] double permutation_p_value(std::span<const std::vector<double>> reference,
    std::span<const std::vector<double>> candidate, const PermutationOptions& options = {});

// Ratio of variances, candidate over reference, from the variances seen within each batch. It is Welch's t on their
// logarithms, in the manner of Bartlett and Kendall 1946. The F test assumes normal samples and is badly wrong on
// radiance; here the scatter between batches itself says how well a variance is known. A p of "the ratio lies within
// [1/tolerated, tolerated]". Needs two batches a side, all variances > 0; else p = 1 and an unbounded interval.
struct VarianceRatio {
    double ratio = 1.0;
    Interval interval;  // of the ratio, each side at alpha_each_side
    double statistic = 0.0;
    double dof = 1.0;
    double p = 1.0;
};
[[nodiscard]] VarianceRatio variance_ratio_test(std::span<const double> reference_batch_variances,
    std::span<const double> candidate_batch_variances, double tolerated = 1.0, double alpha_each_side = 0.025);

}  // namespace tandem
