// The time at which an arm of `tandem cost` reaches an error, between measured counts or by a forecast.
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/cost/analysis.h"

namespace tandem {

Estimated ArmFigures::seconds_at(double samples) const {
    const CostPoint &first = points.front(), &last = points.back();
    const auto n = [](const CostPoint& point) { return static_cast<double>(point.samples); };
    const auto in_proportion = [&](const CostPoint& point) {
        const double share = samples / n(point);
        return Estimated{share * point.seconds.value, share * point.seconds.low, share * point.seconds.high};
    };
    if (samples >= n(last)) {
        if (!seconds_a_sample) return in_proportion(last);
        const double more = samples - n(last);
        return {last.seconds.value + more * seconds_a_sample->value, last.seconds.low + more * seconds_a_sample->low,
            last.seconds.high + more * seconds_a_sample->high};
    }
    if (samples <= n(first)) return in_proportion(first);
    std::size_t i = 1;
    while (n(points[i]) < samples) ++i;
    const CostPoint &a = points[i - 1], &b = points[i];
    const double share = std::log(samples / n(a)) / std::log(n(b) / n(a));
    const double value = std::exp(
        std::lerp(std::log(std::max(a.seconds.value, 1e-9)), std::log(std::max(b.seconds.value, 1e-9)), share));
    return times_or_over(value, log_half_of(b.seconds));
}

Estimated ArmFigures::bias_floor() const {
    const auto root = [](double square) { return std::sqrt(std::max(0.0, square)); };
    return {root(squared_bias.value), root(squared_bias.low), root(squared_bias.high)};
}

bool ArmFigures::is_safe_at(double relative_error) const {
    return arm.keeps_estimate || (has_forecasts() && squared_bias.high < relative_error * relative_error);
}

namespace {

// Whether what the last count was measured to have tells of so small an error. The noise of the reference may hide a
// greater one: then the arm's own noise, which is free of it, is greater, or the interval ends far above the error.
// Twice the error is about halfway, in logarithms, to the next greater of cost_errors, which is 3.3 or 5 times as
// great.
bool tells(const ArmFigures& arm, double error) {
    constexpr double far = 2.0;
    const double noise = std::sqrt(arm.variance * std::exp(-arm.log_half_of_variance));
    return noise <= error && arm.points.back().rmse.high <= far * error;
}

// Where the errors that were measured cross `error` for good: log-linear between two counts. Nothing: they do not.
std::optional<TimeToError> measured_time(const ArmFigures& arm, double error) {
    if (!tells(arm, error)) return std::nullopt;
    const std::vector<CostPoint>& points = arm.points;
    std::size_t first = points.size();
    while (first > 0 && points[first - 1].rmse.value <= error) --first;
    if (first == points.size()) return std::nullopt;
    const CostPoint& below = points[first];
    TimeToError result;
    result.relative_error = error;
    double samples = static_cast<double>(below.samples), log_half = 0.0;
    if (first > 0) {
        const CostPoint& above = points[first - 1];
        // Where the reference's noise hides the error below, it is known to be met there, and not where between.
        const double steps = std::log(above.rmse.value / std::max(below.rmse.value, 1e-300));
        const double share =
            below.rmse.value > 0.0 ? std::clamp(std::log(above.rmse.value / error) / steps, 0.0, 1.0) : 1.0;
        const double ratio = static_cast<double>(below.samples) / static_cast<double>(above.samples);
        samples = static_cast<double>(above.samples) * std::pow(ratio, share);
        // The error's interval, through the slope between the two counts.
        const double error_half = std::log(std::max(1.0, below.rmse.high / std::max(below.rmse.value, 1e-300)));
        log_half = error_half * std::log(ratio) / std::max(steps, 0.1);
    }
    result.samples = samples;
    result.samples_interval = times_or_over(samples, log_half);
    result.seconds = times_or_over(arm.seconds_at(samples).value, std::hypot(log_half, log_half_of(below.seconds)));
    return result;
}

}  // namespace

TimeToError ArmFigures::time_to(double relative_error) const {
    TimeToError result;
    result.relative_error = relative_error;
    const double aim = relative_error * relative_error;
    const auto most = static_cast<double>(points.back().samples);
    if (!has_forecasts()) {
        if (auto measured = measured_time(*this, relative_error)) return *measured;
        result.not_measured = true;
        return result;
    }
    if (has_floor && squared_bias.value >= aim && points.back().rmse.value > relative_error) return result;
    if (auto measured = measured_time(*this, relative_error)) return *measured;
    result.extrapolated = true;
    // V(n) = V N/n of independent samples. For others no more is taken for granted.
    const auto samples_for = [&](double squared_floor) {
        const double left = aim - squared_floor;
        return left > 0.0 ? std::max(most, most * variance / left) : std::numeric_limits<double>::infinity();
    };
    const double samples_needed = samples_for(has_floor ? squared_bias.value : 0.0);
    if (!std::isfinite(samples_needed)) return result;
    constexpr double no_image = 1.0;  // an error as large as the mean: a few bright samples decide the variance too
    if (points.back().rmse.value >= no_image) {
        result.unknown = true;
        return result;
    }
    result.samples = samples_needed;
    result.floor_unknown = !arm.is_unbiased() && !has_floor && squared_bias.high >= aim;
    const Estimated seconds = seconds_at(samples_needed);
    // The forecast is of one render, which takes more or less than the median of many.
    const double log_half_of_time = std::hypot(log_half_of(seconds), log_scatter_of_time);
    Estimated time = times_or_over(seconds.value, std::hypot(log_half_of_variance, log_half_of_time));
    Estimated count = times_or_over(samples_needed, log_half_of_variance);
    if (has_floor)
        for (Estimated* one : {&time, &count}) {
            one->low *= samples_for(std::max(0.0, squared_bias.low)) / samples_needed;
            one->high *= samples_for(squared_bias.high) / samples_needed;
        }
    if (arm.settings.render.generator == Generator::sobol) {
        // Their errors fall at least as fast as those of independent samples. But for smooth integrands they fall no
        // faster than 1/n [Owen 1997]. How long they go on as between the measured counts is not known.
        const double fastest = slope ? std::clamp(-slope->low, 0.5, 1.0) : 1.0;
        const double fewest = std::max(most, most * std::pow(samples_needed / most, 0.5 / fastest));
        for (Estimated* one : {&time, &count}) one->low *= fewest / samples_needed;
    }
    result.seconds = time;
    result.samples_interval = count;
    return result;
}

}  // namespace tandem
