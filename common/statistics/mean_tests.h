// Comparison of two means: Welch's test, the equivalence test, and intervals of the relative difference. Also the
// smallest difference that a test of given level and power can detect.
#pragma once

#include "common/statistics/distributions.h"
#include "common/statistics/interval.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

// A mean with the variance of that mean and the degrees of freedom of that variance.
struct MeanEstimate {
    double mean = 0.0;
    double variance = 0.0;
    double dof = 1.0;

    MeanEstimate() = default;
    MeanEstimate(double mean_, double variance_, double dof_) : mean(mean_), variance(variance_), dof(dof_) {}
    explicit MeanEstimate(const SampleMoments& sample);
};

// The mean of independent means with equal weights (pixels of a region). Variances add. It has (sum V)^2 / sum (V^2 /
// dof) degrees of freedom [Satterthwaite 1946].
class MeanOfMeans {
public:
    void add(double mean, double variance, double dof);
    [[nodiscard]] MeanEstimate result() const;

private:
    double count_ = 0.0, mean_ = 0.0, variance_ = 0.0, variance_squared_over_dof_ = 0.0;
};

// candidate - reference, unequal variances. [Welch 1947]
struct MeanDifference {
    double difference = 0.0;
    double standard_error = 0.0;
    double dof = 1.0;
    // Two-sided p of |true difference| <= `negligible`: (|difference| - negligible) / standard error against Student's
    // t. negligible = 0 is Welch's test. With no variance it is 1 within `negligible` and 0 beyond.
    [[nodiscard]] double p_value(double negligible = 0.0) const;
    [[nodiscard]] double statistic(double negligible = 0.0) const;
    [[nodiscard]] Interval interval(double alpha_each_side) const;
};
[[nodiscard]] MeanDifference welch(const MeanEstimate& reference, const MeanEstimate& candidate);

// The decision of equivalence: two one-sided tests at level alpha each [Schuirmann 1987], in the form of an interval.
// It is shown that -margin < true difference < margin where the interval with alpha a side lies inside; NaN shows
// nothing.
[[nodiscard]] bool equivalent(const Interval& interval, double margin);

// Interval of candidate / reference - 1 after Fieller 1954, each side at `alpha_each_side`. It is exact for normal
// means of known variance, and honest where the reference is itself uncertain. Unbounded (-inf, inf) where the
// reference cannot be told from zero.
[[nodiscard]] Interval fieller_relative_difference(
    const MeanEstimate& reference, const MeanEstimate& candidate, double alpha_each_side);

// Smallest true difference that a two-sided test of level `alpha` finds with probability `power`, normal theory.
[[nodiscard]] double minimum_detectable_difference(double standard_error, double alpha, double power);

// Upper bound on P(|sum of symmetric, independent variables| >= s * root of their sum of squares): whatever their
// distributions, 3.178 times the normal tail. [Efron 1969; Bentkus, Dzindzalieta 2015, constant 1/(4 P(Z >= sqrt 2))]
[[nodiscard]] double symmetric_sum_tail(double s);
// By how much that exceeds the two-sided normal tail: 3.178.
[[nodiscard]] double symmetric_sum_factor();

// `count` independent samples in [0, range], `variance` being what they show.
struct BoundedSample {
    double variance = 0.0, count = 0.0, range = 0.0;
};

// Two-sided p of the sample's mean lying `excess` from its true value, whatever the distribution. [Maurer, Pontil 2009,
// theorem 11: with probability 1 - a a side, excess <= sqrt(2 V l / n) + 7 range l / (3 (n - 1)), l = ln(2 / a)]
[[nodiscard]] double empirical_bernstein_p_value(double excess, const BoundedSample& sample);

// The same of the difference of two samples' means: the bounds on both add up, and so do the chances to exceed them.
[[nodiscard]] double empirical_bernstein_p_value(double excess, const BoundedSample& a, const BoundedSample& b);

}  // namespace tandem
