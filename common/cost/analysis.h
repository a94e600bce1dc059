// Analysis of the samples of `tandem cost`: MSE(n) = b^2 + V(n), with intervals, and the time that each arm takes to a
// given error. Errors are root mean squares over pixels and channels, relative to the mean of the reference image.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/cost/measure.h"
#include "common/statistics/interval.h"
#include "common/statistics/paired_effect.h"

namespace tandem {

inline constexpr std::array<double, 3> cost_errors{0.05, 0.01, 0.003};

struct CostPoint {
    std::uint64_t samples = 0;
    Estimated seconds;  // median and its bootstrap interval
    Estimated rmse;
    double relmse = 0.0;
};

// When an arm is at an error. Nothing: never, as its floor is above it, or not known.
struct TimeToError {
    double relative_error = 0.0;
    std::optional<Estimated> seconds;           // the median where it was measured, one render's where forecast
    std::optional<Estimated> samples_interval;  // of `samples`
    std::optional<double> samples;
    // A forecast: the error is below all that were measured. Else it lies between measured ones, or at one.
    bool extrapolated = false;
    bool floor_unknown = false;  // a floor as high as this error is not excluded; none is assumed
    bool unknown = false;        // all errors that were measured are 100 % or more: no base for a forecast
    bool not_measured = false;   // of an arm without forecasts: all errors that were measured are greater
};

// Error of a part of the image, which the reference decides over: relative to that part's mean.
struct RegionError {
    std::string name;
    double share = 0.0;  // of the pixels
    // At the greatest sample count. The variance is that between replicates: neither bias nor the reference is in it.
    double rmse = 0.0, variance = 0.0;
    // (variance x seconds) over the baseline's, in this part.
    double cost_ratio = 1.0;
};

// The 16x16 tile whose bias is most significant: a leak of light is great there, and nothing in the image's mean.
struct TileBias {
    std::uint32_t x = 0, y = 0;  // of its upper left pixel
    Estimated relative;          // mean of the arm less the reference's, over that (at least 1 % of the image's mean)
    double p = 1.0;              // of no bias in any tile (Bonferroni); the interval holds for all of them together
    bool significant = false;    // over all arms together (Holm)
};

struct ArmFigures {
    CostArm arm;
    bool independent = true;  // samples are, and as many in every pixel: V(n) = s^2 / n
    std::size_t replicates = 0;
    std::vector<CostPoint> points;
    Estimated squared_bias;         // b^2; may come out below 0 by chance. See bias_of
    double floor_p = 1.0;           // of no floor
    double samples_for_bias = 0.0;  // a pixel, of all replicates that squared_bias is from
    double mse = 0.0;               // at the greatest sample count, in the image's own unit
    double flip = 0.0;              // of one replicate there
    std::vector<RegionError> regions;
    std::optional<TileBias> tile;         // nothing: the image is no larger than a tile
    bool has_floor = false;               // b^2 is significantly above 0, over all arms together (Holm)
    double variance = 0.0;                // V at the greatest sample count
    double log_half_of_variance = 0.0;    // its interval is times or over exp of this
    std::optional<Estimated> slope;       // of log rmse against log n; nothing without noise
    std::optional<Estimated> efficiency;  // 1 / (variance of one sample x its seconds)
    // Time of one more sample, without a render's start. Nothing: one count was measured, or noise hides it.
    std::optional<Estimated> seconds_a_sample;
    // Nineteen of twenty renders take the arm's median time, times or over exp of this: by the replicates of all arms.
    double log_scatter_of_time = 0.0;
    std::vector<TimeToError> times;  // at cost_errors
    bool pareto = false;             // the soonest to some error from 10 to 0.1 %
    // Against the baseline, of rounds that both took part in: seconds a sample, and the efficiency's inverse.
    Estimated time_ratio{1.0, 1.0, 1.0}, cost_ratio{1.0, 1.0, 1.0};
    bool cost_differs = false;  // significantly, over all arms together (Holm)
    std::uint64_t invalid = 0;

    // Whether errors at greater counts follow from those measured. Those of denoised images do not: their bias falls
    // with n, their variance other than as 1/n. Theirs are measured, bias at the greatest count, and there is no
    // efficiency.
    [[nodiscard]] bool has_forecasts() const { return !arm.settings.denoise; }
    // Whether its floor is excluded there, by design or by what was measured. Never that of denoised images.
    [[nodiscard]] bool is_safe_at(double relative_error) const;
    [[nodiscard]] Estimated bias_floor() const;  // b, 0 where b^2 is below it
    // Seconds of a render of so many samples: between the measured counts log-linear, beyond them by one more sample's.
    [[nodiscard]] Estimated seconds_at(double samples) const;
    // Seconds to any error, as in `times`.
    [[nodiscard]] TimeToError time_to(double relative_error) const;
};

// Figures that arms have by themselves, of one reference, one range of stages, and replicates that are only added to.
struct KnownFigures {
    struct One {
        std::vector<std::pair<std::uint32_t, std::size_t>> replicates;  // of each stage
        ArmFigures figures;
    };
    std::map<std::string, One> by_name;
};

// Figures from all stages from `from` until before `until`. Arms with fewer than fewest_replicates replicates in each
// are left out. arms[0] is the baseline.
struct StageRange {
    std::uint32_t from = 0, until = ~std::uint32_t{0};
};
[[nodiscard]] std::vector<ArmFigures> analyse_cost(
    const std::vector<CostArm>& arms, const CostSamples& samples, StageRange stages = {});
// The same, but arms that `known` has with as many replicates are not looked at again. What is new is added to it.
[[nodiscard]] std::vector<ArmFigures> analyse_cost(
    const std::vector<CostArm>& arms, const CostSamples& samples, StageRange stages, KnownFigures& known);

// What is left of rounding parts equal images by this much, relative to their mean and squared: it is no noise.
inline constexpr double no_variance = 1e-24;

// The variance of one replicate, at one value of the image and in the mean over all; >= 2 replicates. The reference has
// no part in it.
[[nodiscard]] double between_replicates(const ArmTrials& arm, std::size_t value);
[[nodiscard]] double between_replicates(const ArmTrials& arm);

// Ratio of an arm's seconds a sample to another's, as the logarithm, over the rounds of both. It is at the greatest
// number of samples that both have rendered, so that fixed costs of a render count alike. Without such a number it is
// at each one's greatest. Nothing is known where no round had both: its interval is then infinite.
[[nodiscard]] PairedEffect paired_seconds(const ArmTrials& arm, const ArmTrials& other);

// The figures that reach `relative_error` soonest: the baseline (figures[0]), unless another is significantly sooner.
// Nothing: none reaches it. Without `forecasts`, of the baseline and of those whose renders have reached it.
[[nodiscard]] const ArmFigures* soonest(
    const std::vector<ArmFigures>& figures, double relative_error, bool forecasts = true);

// Settings that are worth measuring together. First the best of each knob that beats the baseline significantly without
// a floor. Then these with Sobol points and with adaptive sampling, in place of what they exclude. Each mix has two
// settings at least. Where the limit of bounces is not known to leave less than the hardest of cost_errors, there are
// such mixes without it, or with a higher one that leaves less than half of 1 %. Sobol points and adaptive sampling are
// also mixed with that alone.
[[nodiscard]] std::vector<std::vector<std::size_t>> mixed_settings(const std::vector<ArmFigures>& figures);

}  // namespace tandem
