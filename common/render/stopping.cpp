#include "common/render/stopping.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

#include "common/deadline.h"
#include "common/error.h"
#include "common/render/adaptive_sampling.h"
#include "common/render/scrambled_film.h"
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

// So many black samples a pixel, and paths in all, say that the image is black: it then has no relative error that
// could be met.
constexpr std::uint64_t black_samples = 1024, black_paths = std::uint64_t{1} << 20;

// A multiple of a sixteenth of the power of two below. Sobol points stay nearly as even as a power of two there. An end
// that is forecast is rounded up to it, by a fortieth in the mean, so that few miss the error.
std::uint64_t look_after(std::uint64_t samples) {
    const std::uint64_t unit = std::max<std::uint64_t>(1, std::bit_floor(samples) / 16);
    return (samples + unit - 1) / unit * unit;
}

std::uint64_t whole_blocks_of(std::uint64_t samples) {
    return (samples + samples_per_block - 1) / samples_per_block * samples_per_block;
}

// How many samples a film has next.
class Looks {
public:
    // `goes_on`: samples within a block need not be rendered anew.
    Looks(const StoppingRule& rule, Sampling sampling, unsigned scramblings, bool goes_on)
        : rule_(rule),
          sampling_(sampling),
          goes_on_(goes_on),
          last_(rule.samples      ? *rule.samples / scramblings
                : scramblings > 1 ? most_points
                                  : numbers_alike),
          scramblings_(scramblings),
          steps_(rule.relative_error || !rule.samples || sampling == Sampling::adaptive || scrambled()) {}

    [[nodiscard]] std::uint64_t last() const { return scramblings_ * last_; }  // as many in every scrambling

    // All that are left, if they are uniform and without a target error. Else they are a quarter of what there is, but
    // no more than the error is expected to need. So the error is looked at often, the overshoot is small, and a stop
    // finds useful adaptive samples and scramblings. Where an expectation missed within a block that is rendered anew,
    // it then has a quarter more, or is whole.
    [[nodiscard]] std::uint64_t next(std::uint64_t done, std::optional<double> error) const {
        if (!steps_) return last();
        const std::uint64_t has = done / scramblings_;  // of each scrambling
        std::uint64_t end = has + std::max(samples_per_block, has / 4);
        end = whole_blocks_of(scrambled() ? look_after(end) : end);
        if (const std::optional<double> needed = samples_needed(done, error)) {
            const double of_each = std::min(static_cast<double>(last_), std::ceil(*needed / scramblings_));
            const std::uint64_t least =
                renders_anew(has) ? std::min(whole_blocks_of(has), has + (has + 3) / 4) : has + 1;
            const std::uint64_t look = look_after(std::max(static_cast<std::uint64_t>(of_each), least));
            if (look < end) end = rule_.whole_blocks ? whole_blocks_of(look) : look;
        }
        return scramblings_ * std::min(end, last_);
    }

private:
    [[nodiscard]] bool scrambled() const { return scramblings_ > 1; }
    // Adaptive samples are in passes of any length.
    [[nodiscard]] bool renders_anew(std::uint64_t has) const {
        return !goes_on_ && has % samples_per_block != 0 && (sampling_ == Sampling::uniform || has <= least_alike);
    }
    [[nodiscard]] std::optional<double> samples_needed(std::uint64_t done, std::optional<double> error) const {
        if (!rule_.relative_error) return std::nullopt;
        if (done == 0) return rule_.expected_samples;
        if (!error) return std::nullopt;
        return static_cast<double>(done) * std::pow(*error / *rule_.relative_error, 2.0);
    }

    const StoppingRule& rule_;
    Sampling sampling_;
    bool goes_on_;
    std::uint64_t last_;  // of each scrambling
    unsigned scramblings_;
    bool steps_;
};

double fraction_done(const StoppingRule& rule, double samples, double seconds, std::optional<double> error) {
    double fraction = 0.0;
    if (rule.samples) fraction = std::max(fraction, samples / static_cast<double>(*rule.samples));
    if (rule.seconds) fraction = std::max(fraction, seconds / *rule.seconds);
    if (rule.relative_error && error) fraction = std::max(fraction, std::pow(*rule.relative_error / *error, 2.0));
    return fraction;
}

// Variance of the mean of every pixel, its channels added up, as they share paths.
std::vector<double> pixel_errors(const FilmMoments& film) {
    std::vector<double> errors(film.pixel_count(), 0.0);
    for (std::size_t i = 0; i < film.moments.size(); ++i) {
        const std::uint64_t count = film.counts[i / channel_count];
        errors[i / channel_count] += variance_from(film.moments[i], count) / static_cast<double>(count);
    }
    return errors;
}

// Root of the mean of squared errors over pixels and channels, divided by the image's mean over them.
std::optional<double> relative_error_from(double mean, const std::vector<double>& pixel_errors) {
    if (!(mean > 0.0) || pixel_errors.empty()) return std::nullopt;
    const double sum = std::accumulate(pixel_errors.begin(), pixel_errors.end(), 0.0);
    return std::sqrt(sum / static_cast<double>(pixel_errors.size() * channel_count)) / mean;
}

// Interval of the root of a mean of squared errors whose expectation is sum v_p / P. Its width has two parts. One is
// how much such a mean itself scatters (a pixel's channels counting as one: 2 sum v_p^2 / (sum v_p)^2). The other is
// how much the variances may be misjudged.
ErrorInterval interval_from(double relative_error, double scatter, const VarianceScatter::Misjudged& misjudged) {
    const double half = 0.5 * std::hypot(normal_quantile(0.975) * scatter,
                                  student_quantile(0.975, misjudged.degrees) * misjudged.relative);
    return {relative_error * std::exp(-half), relative_error * std::exp(half)};
}

// The parts of the render show how much the variances may be misjudged. For one part alone a bound holds: the variance
// of a pixel's estimate is at most the mean of its square, and pixels are independent.
std::optional<ErrorInterval> interval_of(
    const FilmMoments& film, double relative_error, const VarianceScatter& scatter) {
    double sum = 0.0, of_squares = 0.0;
    for (const double own : pixel_errors(film)) {
        sum += own;
        of_squares += own * own;
    }
    if (!(sum > 0.0)) return std::nullopt;
    const double square = of_squares / (sum * sum);
    const auto misjudged = scatter.misjudged(film.counts);
    return interval_from(relative_error, std::sqrt(2.0 * square),
        misjudged.value_or(VarianceScatter::Misjudged{.relative = std::sqrt(square), .degrees = 1.0 / square}));
}

// By R scramblings (MODEL.md section 11.4). With a_r a scrambling's deviation from the truth, a pixel's squared error
// less its estimate is the sum over r != s of a_r a_s / (R (R - 1)). Its variance is 2 R / (R - 1) e^2, whatever the
// tails [Hoeffding 1948]. An estimate's square is at least e^2 in the mean, and few pixels may make up the sum of them.
// So that has Satterthwaite's degrees of freedom, from the fourth powers [Satterthwaite 1946].
std::optional<ErrorInterval> interval_of(
    double relative_error, const std::vector<double>& errors, unsigned scramblings) {
    double sum = 0.0, of_squares = 0.0, of_fourths = 0.0;
    for (const double own : errors) {
        const double square = own * own;
        sum += own;
        of_squares += square;
        of_fourths += square * square;
    }
    if (!(sum > 0.0)) return std::nullopt;
    const double count = scramblings, relative = std::sqrt(2.0 * count / (count - 1.0) * of_squares) / sum;
    return interval_from(
        relative_error, 0.0, {.relative = relative, .degrees = 2.0 * of_squares * of_squares / of_fourths});
}

// The film of one or more scramblings, or of independent samples: render_until() goes on with either.
class AnyFilm {
public:
    AnyFilm(RenderJob& job, Sampling sampling, unsigned scramblings) : scramblings_(scramblings) {
        if (scramblings > 1)
            scrambled_.emplace(job, scramblings);
        else
            growing_.emplace(job, sampling);
    }
    GrowingFilm::Growth grow_to(std::uint64_t samples, const RenderControl& control) {
        return scrambled_ ? scrambled_->grow_to(samples / scramblings_, control) : growing_->grow_to(samples, control);
    }
    [[nodiscard]] double samples() const { return scrambled_ ? scrambled_->samples() : growing_->samples(); }
    // The relative error.
    [[nodiscard]] std::optional<double> look() {
        if (scrambled_) {
            look_ = scrambled_->look();
            return relative_error_from(look_.mean, look_.pixel_errors);
        }
        film_ = growing_->film();
        return relative_error_of(film_);
    }
    // As look() saw them last; 0 before each has a mean.
    [[nodiscard]] std::uint64_t pixels() const { return scrambled_ ? look_.pixel_errors.size() : film_.counts.size(); }
    // The image and its interval, as look() saw it last.
    void tell(StoppedRender& result) {
        result.film = scrambled_ ? scrambled_->film() : std::move(film_);
        if (result.relative_error)
            result.relative_error_interval =
                scrambled_ ? interval_of(*result.relative_error, look_.pixel_errors, scramblings_)
                           : interval_of(result.film, *result.relative_error, growing_->scatter());
    }

private:
    unsigned scramblings_;
    std::optional<GrowingFilm> growing_;
    std::optional<ScrambledFilm> scrambled_;
    ScrambledFilm::Look look_;
    FilmMoments film_;  // without scramblings
};

}  // namespace

std::uint64_t least_judged(std::uint64_t pixels, unsigned scramblings) {
    constexpr std::uint64_t paths = std::uint64_t{1} << 17, least = 8, least_points = 16;
    const std::uint64_t samples = std::clamp(paths / std::max<std::uint64_t>(1, pixels), least, samples_per_block);
    return scramblings > 1 ? std::max(samples, scramblings * least_points) : samples;
}

std::optional<double> relative_error_of(const FilmMoments& film) {
    if (film.counts.empty() || *std::ranges::min_element(film.counts) < 2) return std::nullopt;
    double sum = 0.0;
    for (std::size_t i = 0; i < film.moments.size(); ++i)
        sum += mean_from(film.moments[i], film.counts[i / channel_count]);
    return relative_error_from(sum / static_cast<double>(film.moments.size()), pixel_errors(film));
}

StoppedRender render_until(RenderJob& job, const StoppingRule& rule, std::stop_token stop,
    const std::function<void(const RenderProgress&)>& progress, Sampling sampling, unsigned scramblings) {
    const Stopwatch watch;
    if (rule.samples && *rule.samples < scramblings) scramblings = 1;
    if (scramblings > 1 && rule.samples.value_or(0) / scramblings > most_points)
        throw UnsupportedError(
            fmt::format("{} samples are more than {} scramblings of Sobol points have, 2^32 each; use "
                        "another --generator",
                *rule.samples, scramblings));
    TimeLimit limit(rule, stop);
    StoppedRender result;
    AnyFilm film(job, sampling, scramblings);
    const Looks looks(rule, sampling, scramblings, job.goes_on_in_blocks());
    std::uint64_t done = 0;
    for (;;) {
        const std::uint64_t end = looks.next(done, result.relative_error);
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
        if (growth.device_seconds) result.device_seconds = result.device_seconds.value_or(0.0) + *growth.device_seconds;
        done = end;
        if (film.samples() > 0.0) result.relative_error = film.look();
        result.seconds = rule.relative_error ? watch.seconds() : result.seconds + growth.seconds;
        if (stop.stop_requested()) {
            result.complete = growth.complete && rule.samples && done == looks.last();
            break;
        }
        if (limit.passed() || done == looks.last()) break;
        if (!rule.relative_error) continue;
        if (result.relative_error && *result.relative_error <= *rule.relative_error) break;
        const bool tells_black =
            done >= black_samples && done >= black_paths / std::max<std::uint64_t>(1, film.pixels());
        if (!result.relative_error && tells_black && !rule.samples && !rule.seconds) {
            result.complete = false;
            break;
        }
    }
    if (film.samples() > 0.0) film.tell(result);
    return result;
}

}  // namespace tandem
