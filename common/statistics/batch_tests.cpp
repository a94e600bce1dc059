#include "common/statistics/batch_tests.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "common/statistics/mean_tests.h"

namespace tandem {

namespace {

using Figures = std::vector<double>;

// Figures less their mean over all batches, so that sums of squares do not cancel.
std::vector<Figures> centred(std::span<const Figures> reference, std::span<const Figures> candidate) {
    std::vector<Figures> batches(reference.begin(), reference.end());
    batches.insert(batches.end(), candidate.begin(), candidate.end());
    for (std::size_t figure = 0; figure < batches.front().size(); ++figure) {
        double sum = 0.0;
        for (const Figures& batch : batches) sum += batch[figure];
        for (Figures& batch : batches) batch[figure] -= sum / static_cast<double>(batches.size());
    }
    return batches;
}

Figures sums_of_squares(const std::vector<Figures>& batches) {
    Figures totals(batches.front().size(), 0.0);
    for (const Figures& batch : batches)
        for (std::size_t figure = 0; figure < totals.size(); ++figure) totals[figure] += batch[figure] * batch[figure];
    return totals;
}

// Greatest |Welch t| over the figures, the first `split` batches of `order` being the reference. The figures add up to
// zero over all batches, so one side's sums give the other's.
double greatest_t(const std::vector<Figures>& batches, const Figures& squares, const std::vector<std::size_t>& order,
    std::size_t split) {
    Figures side_sum(squares.size(), 0.0), side_squares(squares.size(), 0.0);
    for (std::size_t i = 0; i < split; ++i) {
        const Figures& batch = batches[order[i]];
        for (std::size_t figure = 0; figure < squares.size(); ++figure) {
            side_sum[figure] += batch[figure];
            side_squares[figure] += batch[figure] * batch[figure];
        }
    }
    const double na = static_cast<double>(split), nb = static_cast<double>(batches.size() - split);
    double greatest = 0.0;
    for (std::size_t figure = 0; figure < squares.size(); ++figure) {
        const double sum = side_sum[figure];
        const double difference = std::abs(sum / na + sum / nb);
        const double deviations_a = side_squares[figure] - sum * sum / na;
        const double deviations_b = squares[figure] - side_squares[figure] - sum * sum / nb;
        const double variance =
            std::max(0.0, deviations_a) / (na * (na - 1.0)) + std::max(0.0, deviations_b) / (nb * (nb - 1.0));
        if (difference > 0.0)
            greatest = std::max(
                greatest, variance > 0.0 ? difference / std::sqrt(variance) : std::numeric_limits<double>::infinity());
    }
    return greatest;
}

}  // namespace

double permutation_p_value(std::span<const std::vector<double>> reference,
    std::span<const std::vector<double>> candidate, const PermutationOptions& options) {
    if (reference.size() < 2 || candidate.size() < 2 || reference.front().empty()) return 1.0;
    const std::vector<Figures> batches = centred(reference, candidate);
    const Figures squares = sums_of_squares(batches);
    std::vector<std::size_t> order(batches.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const double observed = greatest_t(batches, squares, order, reference.size());
    // Rearranged batches are added up in another order: equal statistics may part by rounding.
    const double threshold = observed * (1.0 - 1e-9);

    std::mt19937_64 random(options.seed);
    std::uint32_t extreme = 0, drawn = 0;
    while (drawn < options.permutations && extreme < options.enough) {
        std::ranges::shuffle(order, random);
        ++drawn;
        if (greatest_t(batches, squares, order, reference.size()) >= threshold) ++extreme;
    }
    return (1.0 + extreme) / (1.0 + drawn);
}

VarianceRatio variance_ratio_test(std::span<const double> reference_batch_variances,
    std::span<const double> candidate_batch_variances, double tolerated, double alpha_each_side) {
    const auto positive = [](double variance) { return variance > 0.0; };
    VarianceRatio result;
    result.interval = {0.0, std::numeric_limits<double>::infinity()};
    if (reference_batch_variances.size() < 2 || candidate_batch_variances.size() < 2 ||
        !std::ranges::all_of(reference_batch_variances, positive) ||
        !std::ranges::all_of(candidate_batch_variances, positive))
        return result;
    SampleMoments reference, candidate;
    for (const double variance : reference_batch_variances) reference.add(std::log(variance));
    for (const double variance : candidate_batch_variances) candidate.add(std::log(variance));
    const MeanDifference logarithms = welch(MeanEstimate(reference), MeanEstimate(candidate));
    const Interval interval = logarithms.interval(alpha_each_side);
    result.ratio = std::exp(logarithms.difference);
    result.interval = {std::exp(interval.low), std::exp(interval.high)};
    result.statistic = logarithms.statistic(std::log(tolerated));
    result.dof = logarithms.dof;
    result.p = logarithms.p_value(std::log(tolerated));
    return result;
}

}  // namespace tandem
