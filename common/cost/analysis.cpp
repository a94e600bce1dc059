#include "common/cost/analysis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "common/at_once.h"
#include "common/cost/regions.h"
#include "common/processors.h"
#include "common/statistics/distributions.h"
#include "common/statistics/multiple_tests.h"
#include "common/statistics/paired_effect.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

PairedEffect paired_seconds(const ArmTrials& arm, const ArmTrials& other) {
    std::vector<double> differences;
    std::uint64_t common = 0;
    for (const std::uint64_t samples : arm.samples)
        if (std::ranges::find(other.samples, samples) != other.samples.end()) common = std::max(common, samples);
    const auto seconds_a_sample = [common](const ArmTrials& one, const Replicate& replicate) {
        const auto found = std::ranges::find(one.samples, common);
        const auto level =
            static_cast<std::size_t>(found == one.samples.end() ? one.samples.size() - 1 : found - one.samples.begin());
        return std::max(replicate.seconds[level], 1e-9) / static_cast<double>(one.samples[level]);
    };
    for (const Replicate& replicate : arm.replicates) {
        const auto same = std::ranges::find(other.replicates, replicate.round, &Replicate::round);
        if (same != other.replicates.end())
            differences.push_back(std::log(seconds_a_sample(arm, replicate) / seconds_a_sample(other, *same)));
    }
    if (!differences.empty()) return paired_effect({differences});
    PairedEffect unknown;
    unknown.low = -std::numeric_limits<double>::infinity();
    unknown.high = std::numeric_limits<double>::infinity();
    return unknown;
}

double between_replicates(const ArmTrials& arm, std::size_t value) {
    const auto r = static_cast<double>(arm.replicates.size());
    return std::max(0.0, arm.sum_of_squares[value] - arm.sum[value] * arm.sum[value] / r) / (r - 1.0);
}

double between_replicates(const ArmTrials& arm) {
    double sum = 0.0;
    for (std::size_t i = 0; i < arm.sum.size(); ++i) sum += between_replicates(arm, i);
    return sum / static_cast<double>(arm.sum.size());
}

namespace {

constexpr double family_level = 0.05;
constexpr double two_sided = 1.959964;  // normal quantile of 97.5 %
constexpr std::size_t resamples = 1000;

// Median and its percentile bootstrap interval. [Efron, Tibshirani 1993] For few values that is too narrow: for four it
// is their range, which holds the median 7 of 8 times. So it is widened as Student's interval is. [Hesterberg 2015]
Estimated bootstrapped_median(const std::vector<double>& values) {
    std::mt19937_64 random(1);
    std::vector<double> medians, drawn(values.size());
    for (std::size_t i = 0; i < resamples; ++i) {
        for (double& value : drawn) value = values[random() % values.size()];
        medians.push_back(median(drawn));
    }
    std::ranges::sort(medians);
    const double value = median(values), low = medians[resamples / 40], high = medians[resamples - 1 - resamples / 40];
    const auto n = static_cast<double>(values.size());
    const double wider = n < 2.0 ? 1.0 : student_quantile(0.975, n - 1.0) / two_sided * std::sqrt(n / (n - 1.0));
    return {value, value - wider * (value - low), value + wider * (high - value)};
}

// The same for values above 0, by their logarithms.
Estimated bootstrapped_median_time(std::vector<double> seconds) {
    for (double& one : seconds) one = std::log(std::max(one, 1e-12));
    const Estimated logarithm = bootstrapped_median(seconds);
    return {std::exp(logarithm.value), std::exp(logarithm.low), std::exp(logarithm.high)};
}

// The values of one figure over all replicates, at one sample count.
using Member = std::vector<double> Replicate::*;
std::vector<double> at_level(const ArmTrials& arm, Member member, std::size_t level) {
    std::vector<double> values;
    for (const Replicate& replicate : arm.replicates) values.push_back((replicate.*member)[level]);
    return values;
}

// Standard error of the reference's part in every squared error: of the mean of (m - half 1)(m - half 2), m being the
// truth. Products of independent noise; the channels of a pixel share their paths, so they count as one.
double product_error(const CostReference& reference) {
    double squares = 0.0;
    for (std::size_t pixel = 0; pixel + channel_count <= reference.half_variance.size(); pixel += channel_count) {
        double sum = 0.0;
        for (std::size_t c = 0; c < channel_count; ++c) sum += reference.half_variance[pixel + c];
        squares += sum * sum;
    }
    return std::sqrt(squares) / static_cast<double>(reference.half_variance.size());
}

// b^2: the mean over pixels of (mean - half 1)(mean - half 2) - s^2/R, R replicates, each pixel being free of bias by
// itself. Its noise follows from that of its parts, pixel by pixel. Let v = s^2/R and h be the variance of half the
// reference. Terms are 2 (v + h/2)^2 of the deviation's square and h^2/2 of the halves'. The other terms are 2 v^2/(R -
// 1) of v itself, and 4 b^2 (v + h/2). An outlier in one replicate or one half widens the interval with it. A few noisy
// pixels (the edge of a lamp) can hide the bias of all others. So the quiet ones, by the reference's variance, are also
// looked at alone: their sum is a part of b^2.
struct Bias {
    Estimated square;
    double p = 1.0;  // of b = 0
};
constexpr double quiet_share = 0.8;

struct PixelSum {
    double sum = 0.0, variance = 0.0;
    void add(double term, double error) {
        sum += term;
        variance += error * error;
    }
    [[nodiscard]] double error() const { return std::sqrt(variance); }
    [[nodiscard]] double p() const { return variance > 0.0 ? normal_upper_tail(sum / error()) : sum > 0.0 ? 0.0 : 1.0; }
};

Bias bias_of(const ArmTrials& arm, const CostReference& reference) {
    const std::size_t pixels = arm.sum.size() / channel_count;
    const auto r = static_cast<double>(arm.replicates.size());
    std::vector<double> terms(pixels, 0.0), errors(pixels, 0.0), noise(pixels, 0.0);
    for (std::size_t i = 0; i < arm.sum.size(); ++i) {
        const double mean = arm.sum[i] / r, half = reference.half_difference[i];
        const double variance = std::max(0.0, arm.sum_of_squares[i] - r * mean * mean) / (r - 1.0);
        const double term = mean * mean - half * half - variance / r, v = variance / r, h = reference.half_variance[i];
        const double of_mean = v + 0.5 * h;
        terms[i / channel_count] += term;
        // The channels of a pixel share their paths: their errors add up.
        errors[i / channel_count] += std::sqrt(
            2.0 * of_mean * of_mean + 0.5 * h * h + 2.0 * v * v / (r - 1.0) + 4.0 * std::max(0.0, term) * of_mean);
        noise[i / channel_count] += h;
    }
    std::vector<double> sorted(noise);
    const auto quiet = sorted.begin() + static_cast<std::ptrdiff_t>(quiet_share * static_cast<double>(pixels - 1));
    std::ranges::nth_element(sorted, quiet);
    PixelSum all, calm;
    for (std::size_t i = 0; i < pixels; ++i) {
        all.add(terms[i], errors[i]);
        if (noise[i] <= *quiet) calm.add(terms[i], errors[i]);
    }
    const auto count = static_cast<double>(arm.sum.size());
    const double value = std::max(all.sum, calm.sum);
    return {{value / count, std::max(all.sum - two_sided * all.error(), calm.sum - two_sided * calm.error()) / count,
                (value + two_sided * all.error()) / count},
        std::min(1.0, 2.0 * std::min(all.p(), calm.p()))};
}

// V at the greatest sample count, and half of its log interval. Where samples are independent (`scattered`), it comes
// from the samples of each pixel, which uses all of them. Else it comes from the scatter between replicates alone.
struct Noise {
    double variance = 0.0, log_half = 0.0;
};
Noise noise_of(const ArmTrials& arm, bool scattered) {
    const bool by_samples = scattered && arm.samples.back() > 1;
    std::vector<double> values = at_level(arm, &Replicate::squared_errors, arm.samples.size() - 1);
    Noise noise;
    if (by_samples) {
        for (std::size_t r = 0; r < values.size(); ++r)
            values[r] = arm.replicates[r].sample_variance / static_cast<double>(arm.samples.back());
        noise.variance = moments_of(values).mean;
    } else {
        noise.variance = between_replicates(arm);
    }
    const SampleMoments moments = moments_of(values);
    if (noise.variance > 0.0)
        noise.log_half =
            student_quantile(0.975, moments.count - 1.0) * std::sqrt(moments.variance_of_mean()) / noise.variance;
    return noise;
}

// The slope between the least and the greatest count of each replicate.
std::optional<Estimated> seconds_of_one_more(const ArmTrials& arm) {
    if (arm.samples.size() < 2) return std::nullopt;
    const auto more = static_cast<double>(arm.samples.back() - arm.samples.front());
    std::vector<double> slopes;
    for (const Replicate& replicate : arm.replicates)
        slopes.push_back((replicate.seconds.back() - replicate.seconds.front()) / more);
    const Estimated slope = bootstrapped_median(slopes);
    return slope.low > 0.0 ? std::optional(slope) : std::nullopt;
}

// The stages of an arm that have enough replicates, the longest last.
using Stages = std::vector<const ArmTrials*>;

// How far the times of renders of one count lie from their median: the logarithm that 95 % of all arms' replicates keep
// within. A median of n of them takes a part 1/n of their own scatter away.
double log_scatter_of_times(const std::vector<Stages>& arms) {
    std::vector<double> distances;
    for (const Stages& stages : arms) {
        const ArmTrials& arm = *stages.back();
        const std::vector<double> seconds = at_level(arm, &Replicate::seconds, arm.samples.size() - 1);
        const auto n = static_cast<double>(seconds.size());
        const double middle = median(seconds), part = std::sqrt(n / std::max(1.0, n - 1.0));
        for (const double one : seconds)
            distances.push_back(part * std::abs(std::log(std::max(one, 1e-9) / std::max(middle, 1e-9))));
    }
    if (distances.empty()) return 0.0;
    std::ranges::sort(distances);
    const auto rank = static_cast<std::size_t>(std::ceil(0.95 * static_cast<double>(distances.size())));
    return distances[rank - 1];
}

// d log(root of the squared error) / d log n by least squares, each error weighted by how well its logarithm is known.
// NaN with fewer than three known errors.
double slope_of(const std::vector<std::uint64_t>& samples, const std::vector<double>& squared_errors,
    const std::vector<double>& weights) {
    double count = 0.0, sum = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        if (!(squared_errors[i] > 0.0) || !(weights[i] > 0.0)) continue;
        const double log_n = std::log(static_cast<double>(samples[i])), log_e = 0.5 * std::log(squared_errors[i]);
        const double w = weights[i];
        count += 1.0;
        sum += w;
        x += w * log_n;
        y += w * log_e;
        xx += w * log_n * log_n;
        xy += w * log_n * log_e;
    }
    if (count < 3.0) return std::numeric_limits<double>::quiet_NaN();
    return (sum * xy - x * y) / (sum * xx - x * x);
}

// 1 / the relative variance of each mean squared error, as replicates and the reference make it. Errors that are lost
// in that noise have the weight 0. No error counts for more than a hundredth's accuracy: the fit is no better than the
// straight line.
std::vector<double> slope_weights(const ArmTrials& arm, double common) {
    constexpr double lost = 0.5, best = 0.01;
    std::vector<double> weights;
    for (std::size_t level = 0; level < arm.samples.size(); ++level) {
        const SampleMoments moments = moments_of(at_level(arm, &Replicate::squared_errors, level));
        const double relative = std::sqrt(moments.variance_of_mean() + common * common) / moments.mean;
        const bool known = moments.mean > 0.0 && relative < lost;
        weights.push_back(known ? 1.0 / (best * best + relative * relative) : 0.0);
    }
    return weights;
}

// By the jackknife over replicates [Efron, Tibshirani 1993, chapter 11], and the reference's noise, which all share.
std::optional<Estimated> slope_with_interval(const ArmTrials& arm, double common) {
    const auto mean_without = [&](std::size_t left_out) {
        std::vector<double> mean(arm.samples.size(), 0.0);
        double count = 0.0;
        for (std::size_t r = 0; r < arm.replicates.size(); ++r) {
            if (r == left_out) continue;
            count += 1.0;
            for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += arm.replicates[r].squared_errors[i];
        }
        for (double& value : mean) value /= count;
        return mean;
    };
    const std::size_t none = arm.replicates.size();
    const std::vector<double> weights = slope_weights(arm, common);
    std::vector<double> shifted = mean_without(none);
    const double whole = slope_of(arm.samples, shifted, weights), r = static_cast<double>(none);
    SampleMoments partial;
    for (std::size_t left_out = 0; left_out < none; ++left_out)
        partial.add(slope_of(arm.samples, mean_without(left_out), weights));
    for (double& value : shifted) value += common;
    const double half =
        std::hypot(student_quantile(0.975, r - 1.0) * std::sqrt((r - 1.0) * (r - 1.0) * partial.variance_of_mean()),
            two_sided * (slope_of(arm.samples, shifted, weights) - whole));
    if (!std::isfinite(whole) || !std::isfinite(half)) return std::nullopt;
    return Estimated{whole, whole - half, whole + half};
}

Stages stages_of(const CostSamples& samples, const std::string& name, StageRange range) {
    Stages stages;
    for (const ArmTrials& arm : samples.arms)
        if (arm.name == name && arm.stage >= range.from && arm.stage < range.until &&
            arm.replicates.size() >= fewest_replicates)
            stages.push_back(&arm);
    std::ranges::stable_sort(stages, {}, [](const ArmTrials* arm) { return arm->samples.back(); });
    return stages;
}

double samples_of_all(const ArmTrials* arm) {
    return static_cast<double>(arm->samples.back() * arm->replicates.size());
}

// Errors at the counts of one stage.
std::vector<CostPoint> points_of(const ArmTrials& samples, double scale, double common) {
    std::vector<CostPoint> points;
    for (std::size_t level = 0; level < samples.samples.size(); ++level) {
        const SampleMoments square = moments_of(at_level(samples, &Replicate::squared_errors, level));
        const double half = std::hypot(
            student_quantile(0.975, square.count - 1.0) * std::sqrt(square.variance_of_mean()), two_sided * common);
        const auto root = [&](double value) { return std::sqrt(std::max(0.0, scale * value)); };
        points.push_back(
            {samples.samples[level], bootstrapped_median_time(at_level(samples, &Replicate::seconds, level)),
                {root(square.mean), root(square.mean - half), root(square.mean + half)},
                moments_of(at_level(samples, &Replicate::relative_squared_errors, level)).mean});
    }
    return points;
}

ArmFigures figures_of(const CostArm& arm, const Stages& stages, const CostReference& reference, std::uint32_t width) {
    const ArmTrials& samples = *stages.back();
    const double mean = reference.image_mean(), scale = 1.0 / (mean * mean);
    const double common = product_error(reference);
    ArmFigures figures;
    figures.arm = arm;
    // Samples of a pixel tell its error.
    const bool scattered = arm.settings.render.generator != Generator::sobol && figures.has_forecasts();
    figures.independent = scattered && arm.settings.render.sampling == Sampling::uniform;
    figures.replicates = samples.replicates.size();
    for (const ArmTrials* stage : stages) figures.invalid += stage->invalid;
    for (auto stage = stages.rbegin(); stage != stages.rend(); ++stage) {
        std::vector<CostPoint> points = points_of(**stage, scale, common);
        if (!figures.points.empty())
            std::erase_if(points, [&](const CostPoint& p) { return p.samples >= figures.points.front().samples; });
        figures.points.insert(figures.points.begin(), points.begin(), points.end());
    }
    for (auto stage = stages.rbegin(); stage != stages.rend() && !figures.seconds_a_sample; ++stage)
        figures.seconds_a_sample = seconds_of_one_more(**stage);
    // Bias does not depend on the number of samples: the stage with the most tells it best.
    const ArmTrials& most = figures.has_forecasts() ? **std::ranges::max_element(stages, {}, samples_of_all) : samples;
    figures.samples_for_bias = samples_of_all(&most);
    figures.flip = samples.flip;
    figures.mse = moments_of(at_level(samples, &Replicate::squared_errors, samples.samples.size() - 1)).mean;
    figures.tile = most_biased_tile(most, reference, width);
    const Bias bias = bias_of(most, reference);
    figures.squared_bias = {scale * bias.square.value, scale * bias.square.low, scale * bias.square.high};
    figures.floor_p = bias.p;
    const Noise noise = noise_of(samples, scattered);
    figures.variance = scale * noise.variance;
    figures.log_half_of_variance = noise.log_half;
    if (figures.variance < no_variance) {
        figures.variance = 0.0;
        return figures;
    }
    for (auto stage = stages.rbegin(); stage != stages.rend() && !figures.slope; ++stage)
        figures.slope = slope_with_interval(**stage, common);
    if (!figures.has_forecasts()) return figures;
    const Estimated& seconds = figures.points.back().seconds;
    figures.efficiency =
        times_or_over(1.0 / (figures.variance * seconds.value), std::hypot(noise.log_half, log_half_of(seconds)));
    return figures;
}

// p of "this arm's cost is the baseline's".
double compare(const Stages& stages, const Stages& baseline, const ArmFigures& base, ArmFigures& figures) {
    PairedEffect time = paired_seconds(*stages.back(), *baseline.back());
    // The longest stage that both took part in.
    for (auto own = stages.rbegin(); own != stages.rend() && !std::isfinite(time.high); ++own)
        for (auto other = baseline.rbegin(); other != baseline.rend() && !std::isfinite(time.high); ++other)
            if ((*own)->stage == (*other)->stage) time = paired_seconds(**own, **other);
    figures.time_ratio = {std::exp(time.value), std::exp(time.low), std::exp(time.high)};
    if (!(base.variance > 0.0) || !(figures.variance > 0.0) || !figures.has_forecasts()) return 1.0;
    const auto per_sample = [](const ArmFigures& one) {
        return one.variance * static_cast<double>(one.points.back().samples);
    };
    const double log_ratio = time.value + std::log(per_sample(figures) / per_sample(base));
    const double of_time = 0.5 * (time.high - time.low);
    const double half = std::hypot(of_time, std::hypot(figures.log_half_of_variance, base.log_half_of_variance));
    figures.cost_ratio = times_or_over(std::exp(log_ratio), half);
    if (!(half > 0.0) || !std::isfinite(half)) return 1.0;
    // Satterthwaite's, as if the noise's part were known: few rounds tell the time, and its part is the greatest by
    // far.
    const double dof = time.dof * std::pow(half / of_time, 4.0);
    return 2.0 * student_upper_tail(std::abs(log_ratio) / half * student_quantile(0.975, dof), dof);
}

// Marks what is significant over all arms together.
void judge(std::vector<ArmFigures>& figures, const std::vector<double>& cost_p) {
    std::vector<double> floor_p, tile_p;
    for (const ArmFigures& arm : figures) {
        floor_p.push_back(arm.floor_p);
        tile_p.push_back(arm.tile ? arm.tile->p : 1.0);
    }
    const std::vector<double> tiles = holm_adjusted(tile_p);
    const std::vector<double> floors = holm_adjusted(floor_p), costs = holm_adjusted(cost_p);
    for (std::size_t i = 0; i < figures.size(); ++i) {
        // Below float's own rounding of an image there is no floor to speak of.
        constexpr double rounding = 1e-7;
        figures[i].has_floor = floors[i] <= family_level && figures[i].squared_bias.value > rounding * rounding;
        figures[i].cost_differs = costs[i] <= family_level;
        if (figures[i].tile) figures[i].tile->significant = tiles[i] <= family_level;
    }
}

void mark_pareto(std::vector<ArmFigures>& figures) {
    constexpr int steps = 40;
    for (int step = 0; step <= steps; ++step) {
        const double error = std::pow(10.0, -1.0 - 2.0 * step / steps);
        ArmFigures* soonest = nullptr;
        double least = std::numeric_limits<double>::infinity();
        for (ArmFigures& arm : figures) {
            const TimeToError time = arm.time_to(error);
            if (time.seconds && arm.is_safe_at(error) && time.seconds->value < least) {
                least = time.seconds->value;
                soonest = &arm;
            }
        }
        if (soonest != nullptr) soonest->pareto = true;
    }
}

using StageReplicates = std::vector<std::pair<std::uint32_t, std::size_t>>;
StageReplicates replicates_of(const Stages& stages) {
    StageReplicates all;
    for (const ArmTrials* trials : stages) all.emplace_back(trials->stage, trials->replicates.size());
    return all;
}

// Brings `known` up to date for the arms that have stages. An image's figures take milliseconds, so several at once.
void renew(const std::vector<CostArm>& arms, const std::vector<Stages>& stages, const CostSamples& samples,
    KnownFigures& known) {
    std::vector<std::size_t> changed;
    for (std::size_t i = 0; i < arms.size(); ++i) {
        if (stages[i].empty()) continue;
        if (known.by_name[arms[i].name()].replicates != replicates_of(stages[i])) changed.push_back(i);
    }
    if (changed.empty()) return;
    const Regions regions = regions_of(samples.reference, samples.width);
    std::vector<ArmFigures> figures(changed.size());
    at_once(changed.size(), usable_processors(), [&](std::size_t k) {
        const std::size_t i = changed[k];
        figures[k] = figures_of(arms[i], stages[i], samples.reference, samples.width);
        figures[k].regions = region_errors(*stages[i].back(), samples.reference, regions);
    });
    for (std::size_t k = 0; k < changed.size(); ++k)
        known.by_name[arms[changed[k]].name()] = {replicates_of(stages[changed[k]]), std::move(figures[k])};
}

}  // namespace

std::vector<ArmFigures> analyse_cost(const std::vector<CostArm>& arms, const CostSamples& samples, StageRange range) {
    KnownFigures nothing;
    return analyse_cost(arms, samples, range, nothing);
}

std::vector<ArmFigures> analyse_cost(
    const std::vector<CostArm>& arms, const CostSamples& samples, StageRange range, KnownFigures& known) {
    std::vector<Stages> stages;
    for (const CostArm& arm : arms) stages.push_back(stages_of(samples, arm.name(), range));
    if (stages.empty() || stages.front().empty()) return {};  // nothing to hold the others against
    renew(arms, stages, samples, known);
    std::vector<ArmFigures> figures;
    std::vector<double> cost_p;
    for (std::size_t i = 0; i < arms.size(); ++i) {
        if (stages[i].empty()) continue;
        figures.push_back(known.by_name.at(arms[i].name()).figures);
        figures.back().arm = arms[i];
        cost_p.push_back(i == 0 ? 1.0 : compare(stages[i], stages.front(), figures.front(), figures.back()));
        if (figures.back().has_forecasts()) compare_regions(figures.front(), figures.back());
    }
    judge(figures, cost_p);
    std::erase_if(stages, [](const Stages& one) { return one.empty(); });
    const double scatter = log_scatter_of_times(stages);
    for (ArmFigures& arm : figures) {
        arm.log_scatter_of_time = scatter;
        for (const double error : cost_errors) arm.times.push_back(arm.time_to(error));
    }
    mark_pareto(figures);
    return figures;
}

}  // namespace tandem
