#include "common/statistics/mean_tests.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace tandem {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double satterthwaite(double variance, double variance_squared_over_dof) {
    return variance_squared_over_dof > 0.0 ? std::max(1.0, variance * variance / variance_squared_over_dof) : infinity;
}

double welch_dof(const MeanEstimate& a, const MeanEstimate& b) {
    return satterthwaite(a.variance + b.variance, a.variance * a.variance / a.dof + b.variance * b.variance / b.dof);
}

// Chance that the samples' means are off by `excess` together.
double bernstein_tails(double excess, std::span<const BoundedSample> samples) {
    if (excess <= 0.0) return 1.0;
    double linear = 0.0, root = 0.0, tails = 0.0;
    for (const BoundedSample& sample : samples) {
        if (sample.count < 2.0) return 1.0;
        linear += 7.0 * sample.range / (3.0 * (sample.count - 1.0));
        root += std::sqrt(2.0 * sample.variance / sample.count);
        tails += 2.0;
    }
    if (linear == 0.0 && root == 0.0) return 0.0;
    // excess = root sqrt(l) + linear l, solved for sqrt(l) without cancellation; each tail has a = 2 exp(-l).
    const double root_of_l = 2.0 * excess / (root + std::sqrt(root * root + 4.0 * linear * excess));
    return std::min(1.0, 2.0 * tails * std::exp(-root_of_l * root_of_l));
}

}  // namespace

MeanEstimate::MeanEstimate(const SampleMoments& sample)
    : mean(sample.mean), variance(sample.variance_of_mean()), dof(sample.count - 1.0) {}

void MeanOfMeans::add(double mean, double variance, double dof) {
    count_ += 1.0;
    mean_ += mean;
    variance_ += variance;
    variance_squared_over_dof_ += variance * variance / dof;
}

MeanEstimate MeanOfMeans::result() const {
    if (count_ == 0.0) return {};
    return {mean_ / count_, variance_ / (count_ * count_), satterthwaite(variance_, variance_squared_over_dof_)};
}

double MeanDifference::statistic(double negligible) const {
    const double excess = std::abs(difference) - negligible;
    if (standard_error > 0.0) return std::max(0.0, excess) / standard_error;
    return excess > 0.0 ? infinity : 0.0;
}

double MeanDifference::p_value(double negligible) const {
    return std::min(1.0, 2.0 * student_upper_tail(statistic(negligible), dof));
}

Interval MeanDifference::interval(double alpha_each_side) const {
    const double half = standard_error > 0.0 ? student_quantile(1.0 - alpha_each_side, dof) * standard_error : 0.0;
    return {difference - half, difference + half};
}

MeanDifference welch(const MeanEstimate& reference, const MeanEstimate& candidate) {
    return {candidate.mean - reference.mean, std::sqrt(reference.variance + candidate.variance),
        welch_dof(reference, candidate)};
}

// Both one-sided tests [Schuirmann 1987], in the form of an interval.
bool equivalent(const Interval& interval, double margin) { return interval.low > -margin && interval.high < margin; }

// The ratios r with (c - r a)^2 <= t^2 (V_c + r^2 V_a): a quadratic in r, bounded when a^2 > t^2 V_a.
Interval fieller_relative_difference(
    const MeanEstimate& reference, const MeanEstimate& candidate, double alpha_each_side) {
    const double t = student_quantile(1.0 - alpha_each_side, welch_dof(reference, candidate));
    const double a = reference.mean * reference.mean - t * t * reference.variance;
    if (!(a > 0.0)) return {-infinity, infinity};
    const double b = reference.mean * candidate.mean;
    const double c = candidate.mean * candidate.mean - t * t * candidate.variance;
    const double root = std::sqrt(std::max(0.0, b * b - a * c));
    return {(b - root) / a - 1.0, (b + root) / a - 1.0};
}

double minimum_detectable_difference(double standard_error, double alpha, double power) {
    return (normal_quantile(1.0 - alpha / 2.0) + normal_quantile(power)) * standard_error;
}

double symmetric_sum_tail(double s) {
    if (s <= 0.0) return 1.0;
    return std::min(1.0, 2.0 * symmetric_sum_factor() * normal_upper_tail(s));
}

double symmetric_sum_factor() { return 1.0 / (4.0 * normal_upper_tail(std::sqrt(2.0))); }

double empirical_bernstein_p_value(double excess, const BoundedSample& sample) {
    return bernstein_tails(excess, std::span(&sample, 1));
}

double empirical_bernstein_p_value(double excess, const BoundedSample& a, const BoundedSample& b) {
    return bernstein_tails(excess, std::array{a, b});
}

}  // namespace tandem
