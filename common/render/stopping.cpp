#include "common/render/stopping.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <vector>

#include "common/deadline.h"
#include "common/render/adaptive_sampling.h"
#include "common/statistics/distributions.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

// The end of a render by a stop request or by time: when that is over, as soon as every pixel has a sample.
class TimeLimit {
public:
    TimeLimit(const StoppingRule& rule, const std::stop_token& stop)
        : time_({}, rule.seconds),
          last_(stop, rule.seconds ? rule.first_sample_seconds : std::nullopt),
          on_last_(last_.token(), [this] { ending_.request_stop(); }),
          on_time_(time_.token(), [this] { end_if_over(); }) {}

    [[nodiscard]] std::stop_token token() const { return ending_.get_token(); }
    [[nodiscard]] bool passed() const { return ending_.stop_requested(); }
    // So many samples a pixel are done, the last one in part.
    void has(double samples) {
        if (samples >= 1.0) has_sample_ = true;
        end_if_over();
    }

private:
    void end_if_over() {
        if (has_sample_ && time_.passed()) ending_.request_stop();
    }

    std::atomic<bool> has_sample_ = false;
    std::stop_source ending_;
    Deadline time_, last_;
    std::stop_callback<std::function<void()>> on_last_, on_time_;
};

// So many black samples a pixel say that the image is black: it then has no relative error that could be met.
constexpr std::uint64_t black_samples = 1024;

// Samples to ask for next: of uniform samples without a target error all that are left; else a quarter of what there
// is, so that the error is looked at often but the overshoot stays small, no more than the error is expected to need,
// and so that a stop finds adaptive samples where they are of use.
std::uint64_t next_end(const StoppingRule& rule, std::uint64_t done, std::optional<double> error, Sampling sampling) {
    const std::uint64_t last = rule.samples.value_or(std::uint64_t{1} << 40);
    std::uint64_t step = last - done;
    if (rule.relative_error || !rule.samples || sampling == Sampling::adaptive) {
        step = std::min(step, std::max(samples_per_block, done / 4));
        if (rule.relative_error && error) {
            const double needed = static_cast<double>(done) * std::pow(*error / *rule.relative_error, 2.0);
            const double left = std::max(1.0, std::ceil(needed - static_cast<double>(done)));
            if (left < static_cast<double>(step)) step = static_cast<std::uint64_t>(left);
        }
    }
    std::uint64_t end = done + step;
    if (end < last) end = (end + samples_per_block - 1) / samples_per_block * samples_per_block;
    return std::min(end, last);
}

double fraction_done(const StoppingRule& rule, double samples, double seconds, std::optional<double> error) {
    double fraction = 0.0;
    if (rule.samples) fraction = std::max(fraction, samples / static_cast<double>(*rule.samples));
    if (rule.seconds) fraction = std::max(fraction, seconds / *rule.seconds);
    if (rule.relative_error && error) fraction = std::max(fraction, std::pow(*rule.relative_error / *error, 2.0));
    return fraction;
}

// Variance of the mean of every pixel, its channels added up, as they share paths.
std::vector<double> pixel_errors(const FilmMoments& film) {
    const std::vector<double> variances = variance_of(film);
    std::vector<double> errors(film.pixel_count(), 0.0);
    for (std::size_t i = 0; i < variances.size(); ++i)
        errors[i / channel_count] += variances[i] / static_cast<double>(film.counts[i / channel_count]);
    return errors;
}

// Interval of the root of a mean of squared errors whose expectation is sum v_p / P. Its width has two parts: how much
// such a mean itself scatters (a pixel's channels counting as one: 2 sum v_p^2 / (sum v_p)^2), and how much the
// variances may be misjudged, which the parts of the render show.
std::optional<ErrorInterval> interval_of(
    const FilmMoments& film, double relative_error, const VarianceScatter& scatter) {
    const auto misjudged = scatter.misjudged(film.counts);
    if (!misjudged) return std::nullopt;
    double sum = 0.0, of_squares = 0.0;
    for (const double own : pixel_errors(film)) {
        sum += own;
        of_squares += own * own;
    }
    const double half = 0.5 * std::hypot(normal_quantile(0.975) * std::sqrt(2.0 * of_squares) / sum,
                                  student_quantile(0.975, misjudged->degrees) * misjudged->relative);
    return ErrorInterval{relative_error * std::exp(-half), relative_error * std::exp(half)};
}

}  // namespace

std::optional<double> relative_error_of(const FilmMoments& film) {
    if (film.counts.empty() || *std::ranges::min_element(film.counts) < 2) return std::nullopt;
    double mean = 0.0, variance = 0.0;
    for (const double value : mean_of(film)) mean += value;
    if (mean <= 0.0) return std::nullopt;
    for (const double error : pixel_errors(film)) variance += error;
    const double values = static_cast<double>(film.pixel_count() * channel_count);
    return std::sqrt(variance / values) / (mean / values);
}

StoppedRender render_until(RenderJob& job, const StoppingRule& rule, std::stop_token stop,
    const std::function<void(const RenderProgress&)>& progress, Sampling sampling) {
    const Stopwatch watch;
    TimeLimit limit(rule, stop);
    StoppedRender result;
    GrowingFilm film(job, sampling);
    std::uint64_t done = 0;
    for (;;) {
        const std::uint64_t end = next_end(rule, done, result.relative_error, sampling);
        const RenderControl control{
            .stop = limit.token(), .progress = [&](double samples) {
                const double all = static_cast<double>(done) + samples;
                limit.has(all);
                if (film.samples() == 0.0) result.begun = std::min(all, 1.0);
                if (progress)
                    progress(
                        {all, fraction_done(rule, all, watch.seconds(), result.relative_error), result.relative_error});
            }};
        const GrowingFilm::Growth growth = film.grow_to(end, control);
        limit.has(film.samples());
        result.seconds += growth.seconds;
        if (growth.device_seconds) result.device_seconds = result.device_seconds.value_or(0.0) + *growth.device_seconds;
        done = end;
        if (film.samples() > 0.0) {
            result.film = film.film();
            result.relative_error = relative_error_of(result.film);
        }
        if (stop.stop_requested()) {
            result.complete = growth.complete && done == rule.samples;
            break;
        }
        if (limit.passed() || done == rule.samples) break;
        if (!rule.relative_error) continue;
        if (result.relative_error && *result.relative_error <= *rule.relative_error) break;
        if (!result.relative_error && done >= black_samples && !rule.samples && !rule.seconds) {
            result.complete = false;
            break;
        }
    }
    if (result.relative_error)
        result.relative_error_interval = interval_of(result.film, *result.relative_error, film.scatter());
    return result;
}

}  // namespace tandem
