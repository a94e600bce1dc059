#include "common/statistics/batch_tests.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "common/statistics/mean_tests.h"

namespace tandem {

namespace {

using Batches = std::vector<const std::vector<double>*>;

// Greatest |Welch t| over the figures, the first `split` batches being the reference.
double greatest_t(const Batches& batches, std::size_t split) {
    const double na = static_cast<double>(split), nb = static_cast<double>(batches.size() - split);
    double greatest = 0.0;
    for (std::size_t figure = 0; figure < batches.front()->size(); ++figure) {
        SampleMoments a, b;
        for (std::size_t i = 0; i < batches.size(); ++i) (i < split ? a : b).add((*batches[i])[figure]);
        const double error =
            std::sqrt(a.squared_deviations / (na * (na - 1.0)) + b.squared_deviations / (nb * (nb - 1.0)));
        const double difference = std::abs(a.mean - b.mean);
        if (difference > 0.0)
            greatest = std::max(greatest, error > 0.0 ? difference / error : std::numeric_limits<double>::infinity());
    }
    return greatest;
}

}  // namespace

double permutation_p_value(std::span<const std::vector<double>> reference,
    std::span<const std::vector<double>> candidate, const PermutationOptions& options) {
    if (reference.size() < 2 || candidate.size() < 2 || reference.front().empty()) return 1.0;
    Batches batches;
    for (const std::vector<double>& batch : reference) batches.push_back(&batch);
    for (const std::vector<double>& batch : candidate) batches.push_back(&batch);
    const double observed = greatest_t(batches, reference.size());
    // Rearranged batches are added up in another order: equal statistics may part by rounding.
    const double threshold = observed * (1.0 - 1e-12);

    std::mt19937_64 random(options.seed);
    std::uint32_t extreme = 0, drawn = 0;
    while (drawn < options.permutations && extreme < options.enough) {
        std::ranges::shuffle(batches, random);
        ++drawn;
        if (greatest_t(batches, reference.size()) >= threshold) ++extreme;
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
