#include "common/statistics/paired_effect.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/render/random.h"

namespace tandem {

namespace {

// An endless row of uniform numbers below a bound, seeded, the same on every machine.
class Draws {
public:
    explicit Draws(std::uint64_t seed) : seed_(seed) {}

    // Uniform in [0, bound); bound < 2^32. The bias of the multiplication is below bound / 2^32.
    std::size_t below(std::size_t bound) {
        if (used_ == block_.size()) {
            block_ = random_block(seed_, 0, counter_++, 0);
            used_ = 0;
        }
        return static_cast<std::size_t>(std::uint64_t{block_[used_++]} * bound >> 32);
    }

private:
    std::uint64_t seed_, counter_ = 0;
    RandomBlock block_{};
    std::size_t used_ = 4;
};

std::size_t trimmed_count(std::size_t count) {
    return static_cast<std::size_t>(trimmed_share * static_cast<double>(count));
}

// Puts the values in another order. Partly sorted is enough: the bootstrap calls this thousands of times.
double trimmed_in_place(std::vector<double>& values) {
    const std::size_t cut = trimmed_count(values.size());
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(cut);
    const auto end = values.end() - static_cast<std::ptrdiff_t>(cut);
    if (cut > 0) {
        std::nth_element(values.begin(), begin, values.end());
        std::nth_element(begin, end - 1, values.end());
    }
    return std::accumulate(begin, end, 0.0) / static_cast<double>(values.size() - 2 * cut);
}

// `drawn` is scratch.
double resampled_mean(std::span<const double> values, Draws& draws, std::vector<double>& drawn) {
    drawn.clear();
    for (std::size_t i = 0; i < values.size(); ++i) drawn.push_back(values[draws.below(values.size())]);
    return trimmed_in_place(drawn);
}

double quantile(const std::vector<double>& sorted, double p) {
    const double at = p * static_cast<double>(sorted.size() - 1);
    const auto i = static_cast<std::size_t>(at);
    const double above = i + 1 < sorted.size() ? sorted[i + 1] : sorted[i];
    return sorted[i] + (at - static_cast<double>(i)) * (above - sorted[i]);
}

MeanEstimate over_processes(const ProcessBlocks& processes, bool resampled) {
    MeanOfMeans within;
    SampleMoments between;
    for (const std::vector<double>& blocks : processes) {
        const MeanEstimate one = trimmed_mean_estimate(blocks);
        within.add(one.mean, one.variance, one.dof);
        between.add(one.mean);
    }
    MeanEstimate estimate = resampled ? MeanEstimate(between) : within.result();
    if (!(estimate.variance > 0.0)) estimate.dof = 1.0;  // 0 / 0 where all blocks are equal
    return estimate;
}

// Greatest |CUSUM| of the deviations from the mean, scaled for the unequal variance along the series, and where: the
// first value after the change.
struct Change {
    double statistic = 0.0;
    std::size_t at = 0;
};

Change greatest_change(std::span<const double> values) {
    const double n = static_cast<double>(values.size());
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
    Change change;
    double sum = 0.0;
    for (std::size_t i = 0; i + 1 < values.size(); ++i) {
        sum += values[i] - mean;
        const double k = static_cast<double>(i + 1);
        const double statistic = std::abs(sum) / std::sqrt(k * (n - k) / n);
        if (statistic > change.statistic) change = {statistic, i + 1};
    }
    return change;
}

// Ranks: stragglers must not pass for changes, nor hide them.
std::vector<double> ranks_of(std::span<const double> values) {
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return values[i]; });
    std::vector<double> ranks(values.size());
    for (std::size_t rank = 0; rank < order.size(); ++rank) ranks[order[rank]] = static_cast<double>(rank);
    return ranks;
}

}  // namespace

double trimmed_mean(std::vector<double> values) {
    if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
    return trimmed_in_place(values);
}

double median(std::vector<double> values) {
    const std::size_t middle = values.size() / 2;
    std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(middle));
    const double upper = values[middle];
    if (values.size() % 2 == 1) return upper;
    return 0.5 * (upper + *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(middle)));
}

MeanEstimate trimmed_mean_estimate(std::span<const double> values) {
    std::vector<double> sorted(values.begin(), values.end());
    const double mean = trimmed_mean(sorted);
    std::ranges::sort(sorted);
    const std::size_t cut = trimmed_count(sorted.size());
    const double left = static_cast<double>(sorted.size()) - 2.0 * static_cast<double>(cut);
    if (left < 2.0) return {mean, std::numeric_limits<double>::infinity(), 1.0};
    for (double& value : sorted) value = std::clamp(value, sorted[cut], sorted[sorted.size() - 1 - cut]);
    const double squares = moments_of(sorted).squared_deviations;
    return {mean, squares / (left * (left - 1.0)), left - 1.0};
}

PairedEffect paired_effect(const ProcessBlocks& differences, const BootstrapOptions& options) {
    PairedEffect effect;
    effect.processes = differences.size();
    for (const std::vector<double>& blocks : differences) effect.blocks += blocks.size();
    const bool resampled = differences.size() >= fewest_resampled_processes;
    const MeanEstimate estimate = over_processes(differences, resampled);
    effect.value = estimate.mean;
    effect.standard_error = std::sqrt(estimate.variance);
    effect.dof = estimate.dof;
    effect.p = MeanDifference{estimate.mean, effect.standard_error, estimate.dof}.p_value();
    if (!std::isfinite(effect.standard_error)) {
        effect.low = -std::numeric_limits<double>::infinity();
        effect.high = -effect.low;
        return effect;
    }
    Draws draws(options.seed);
    std::vector<double> values, scratch;
    for (std::size_t i = 0; i < options.resamples; ++i) {
        double sum = 0.0;
        for (std::size_t p = 0; p < differences.size(); ++p)
            sum += resampled_mean(differences[resampled ? draws.below(differences.size()) : p], draws, scratch);
        values.push_back(sum / static_cast<double>(differences.size()));
    }
    std::ranges::sort(values);
    const double upper = 1.0 - options.alpha / 2.0;
    const double n = estimate.dof + 1.0;
    const double widening =
        student_quantile(upper, estimate.dof) / normal_quantile(upper) * std::sqrt(n / std::max(1.0, n - 1.0));
    effect.low = effect.value - widening * (effect.value - quantile(values, 1.0 - upper));
    effect.high = effect.value + widening * (quantile(values, upper) - effect.value);
    // Never surer than the interval.
    if (effect.low <= 0.0 && effect.high >= 0.0) effect.p = std::max(effect.p, options.alpha);
    return effect;
}

double smallest_detectable(const PairedEffect& effect, double alpha, double power) {
    return (student_quantile(1.0 - alpha / 2.0, effect.dof) + student_quantile(power, effect.dof)) *
           effect.standard_error;
}

std::size_t warm_up_length(std::span<const double> series, double alpha) {
    constexpr std::size_t fewest = 8, permutations = 499;
    std::size_t begin = 0;
    while (series.size() - begin >= fewest) {
        std::vector<double> ranks = ranks_of(series.subspan(begin));
        const Change change = greatest_change(ranks);
        if (begin + change.at > series.size() / 2) break;
        Draws draws(series.size() + begin);
        std::size_t as_great = 0;
        for (std::size_t i = 0; i < permutations; ++i) {
            for (std::size_t k = ranks.size() - 1; k > 0; --k) std::swap(ranks[k], ranks[draws.below(k + 1)]);
            if (greatest_change(ranks).statistic >= change.statistic) ++as_great;
        }
        if (static_cast<double>(1 + as_great) / static_cast<double>(1 + permutations) > alpha) break;
        begin += change.at;
    }
    return begin;
}

}  // namespace tandem
