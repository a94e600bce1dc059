// The effect of an arm from paired blocks. In each block every arm ran once, so what drifts slowly cancels in the
// difference of two arms. Times have stragglers, so means are trimmed: 20 % on either side [Yuen 1974; Wilcox,
// Introduction to Robust Estimation, ch. 4]. The differences are trimmed, as their distribution is symmetric if the
// arms are equal.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/statistics/mean_tests.h"

namespace tandem {

inline constexpr double trimmed_share = 0.2;  // of either side

[[nodiscard]] double trimmed_mean(std::vector<double> values);

// The value in the middle, or the mean of the two there. There is at least one value.
[[nodiscard]] double median(std::vector<double> values);
// With the squared standard error from the winsorised variance, and h - 1 degrees of freedom, h values being left
// untrimmed [Yuen 1974]. Needs two untrimmed values, else its variance is infinite.
[[nodiscard]] MeanEstimate trimmed_mean_estimate(std::span<const double> values);

// Values by process and block: blocks of one process share its memory layout, its clocks and its luck.
using ProcessBlocks = std::vector<std::vector<double>>;

struct PairedEffect {
    double value = 0.0;            // mean over processes of the trimmed mean over blocks
    double low = 0.0, high = 0.0;  // 95 %
    double standard_error = 0.0;
    double dof = 1.0;
    double p = 1.0;  // two-sided, of no effect
    std::size_t blocks = 0, processes = 0;
};

// From so many processes on they too are resampled, and the interval speaks of any process; with fewer it speaks of
// those that ran. Values of one block are not independent of each other, so a block is the least that is resampled.
inline constexpr std::size_t fewest_resampled_processes = 5;

struct BootstrapOptions {
    std::size_t resamples = 2000;
    std::uint64_t seed = 1;
    double alpha = 0.05;
};

// The hierarchical bootstrap of [Davison, Hinkley 1997, section 3.8]: processes, then blocks within each. The interval
// is the percentile one, widened by what few values lack: by t over normal quantile, and sqrt(n / (n - 1)).
[[nodiscard]] PairedEffect paired_effect(const ProcessBlocks& differences, const BootstrapOptions& options = {});

// The smallest effect that the experiment would have found with probability `power`, at level alpha.
[[nodiscard]] double smallest_detectable(const PairedEffect& effect, double alpha = 0.05, double power = 0.8);

// How many first values of a series are warm-up. It ends at the first half's last change point, found at `alpha`
// by a permutation test of the greatest CUSUM [Hawkins 1977; Page 1954]. The same series always gives the same answer.
[[nodiscard]] std::size_t warm_up_length(std::span<const double> series, double alpha = 0.01);

}  // namespace tandem
