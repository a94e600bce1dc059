#include "common/cost/choose_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <utility>

#include "common/deadline.h"
#include "common/error.h"
#include "common/render/adaptive_sampling.h"
#include "common/render/check_settings.h"
#include "common/render/scrambled_film.h"
#include "common/render/stopping.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

constexpr std::uint64_t trial_begin = std::uint64_t{1} << 62;      // samples that no render gets to
constexpr std::uint64_t next_scrambling = std::uint64_t{1} << 32;  // MODEL.md section 3.2
constexpr double clearly_better = 0.9;
constexpr double trials_share = 0.18;  // of the seconds that the best settings so far are forecast to take
constexpr std::uint64_t least_trial_samples = 8, most_trial_samples = 4096, least_points = 16;
constexpr double known_enough = 0.05;  // how far a trial's squared error may be off, relatively

// What a trial showed of settings. Errors are squared, and relative to the image's mean. With Sobol points that of n
// points falls as n^-(1 + gain).
struct Trial {
    double noise = 0.0;         // error of one independent sample
    double error_of_one = 0.0;  // where errors fall so from there; of independent samples the noise
    double gain = 0.0;
    double seconds_a_sample = 0.0;  // of all pixels, by the device's clock where there is one
    double seconds_a_call = 0.0;    // beside that: trials are short, so it would seem to grow with their samples
    std::uint64_t pixels = 0;
    double noise_uncertainty = 0.0, uncertainty = 0.0;  // of noise and error_of_one, relative: standard errors, at most
    std::uint64_t least = 0;                            // samples that a render has at least
    unsigned scramblings = 1;
    std::optional<Foretold> adaptive;
    std::uint64_t samples = 0;  // of all scramblings
    double points = 0.0;        // of each scrambling; 0: of independent samples

    [[nodiscard]] double share_of(std::size_t some) const {
        return static_cast<double>(some) / static_cast<double>(pixels);
    }
    // Relative standard error of seconds_to, at most. How even Sobol points are follows from the same error. So the
    // further its fall is followed, the less it is known.
    [[nodiscard]] double uncertainty_at(double relative_error) const {
        if (points == 0.0) return uncertainty;
        const double fall = 1.0 + gain, squared = error_of_one / std::pow(points, fall);
        const double further = std::log(std::max(1.0, squared / (scramblings * relative_error * relative_error)));
        return uncertainty * (1.0 / fall + further / (fall * fall * std::log(points)));
    }
    [[nodiscard]] double samples_to(double relative_error) const {
        const double of_one = error_of_one / (scramblings * relative_error * relative_error);
        return scramblings * std::pow(of_one, 1.0 / (1.0 + gain));
    }
    [[nodiscard]] double seconds_of(double wanted) const {
        return seconds_a_call + std::max(static_cast<double>(least), wanted) * seconds_a_sample;
    }
    // With two standard errors more, so that few renders miss the error there. They are bounds, so no more than half is
    // added: a block may be less. Between powers of two Sobol points' errors lie up to 3.5 % above their fall, as
    // measured on two scenes. Nothing without noise, which may be rare.
    [[nodiscard]] std::optional<double> samples_surely_to(double relative_error) const {
        constexpr double most_added = 0.5, uneven = 0.07;
        if (!(error_of_one > 0.0)) return std::nullopt;
        const double added = std::min(most_added, 2.0 * uncertainty_at(relative_error) + (points > 0.0 ? uneven : 0.0));
        return std::max(static_cast<double>(least), (1.0 + added) * samples_to(relative_error));
    }
    void take_time(double seconds, double on_device, double taken) {
        seconds_a_sample = std::max(on_device / taken, 1e-12);
        seconds_a_call = std::max(0.0, seconds - on_device);
    }
    // By a trial with so many samples, the first one included that warms up.
    [[nodiscard]] double seconds_taken(std::uint64_t trial_samples) const {
        return 2.0 * seconds_a_call + static_cast<double>(trial_samples) * seconds_a_sample;
    }
    [[nodiscard]] double seconds_to(double relative_error) const {
        return error_of_one > 0.0 ? seconds_of(samples_to(relative_error)) : 0.0;
    }
    // With independent samples in place of Sobol points.
    [[nodiscard]] Trial independent() const {
        Trial trial = *this;
        trial.error_of_one = noise;
        trial.uncertainty = noise_uncertainty;
        trial.gain = trial.points = 0.0;
        trial.scramblings = 1;
        trial.least = least_judged(pixels, 1);
        return trial;
    }
};

double mean_of_all(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Pixels are independent, and the variance of an estimate is at most the mean of its square. So a sum of pixels'
// estimates is off by at most the root of the sum of their squares, for any distribution.
double uncertainty_of(const std::vector<double>& values) {
    double sum = 0.0, of_squares = 0.0;
    for (std::size_t i = 0; i < values.size(); i += channel_count) {
        const double own = values[i] + values[i + 1] + values[i + 2];
        sum += own;
        of_squares += own * own;
    }
    return sum > 0.0 ? std::sqrt(of_squares) / sum : 0.0;
}

// So many samples. Nothing after a stop, and of a black image.
std::optional<Trial> independent_trial(RenderJob& job, std::uint64_t samples, std::stop_token stop) {
    const RenderResult result = job.render({trial_begin, trial_begin + samples}, {.stop = stop, .progress = {}});
    if (result.estimate.count() < samples) return std::nullopt;
    const double mean = mean_of_all(mean_of(result.estimate));
    if (!(mean > 0.0)) return std::nullopt;
    const std::vector<double> variances = variance_of(result.estimate);
    Trial trial;
    trial.noise = trial.error_of_one = mean_of_all(variances) / (mean * mean);
    trial.noise_uncertainty = trial.uncertainty = uncertainty_of(variances);
    trial.take_time(result.seconds, result.device_seconds.value_or(result.seconds), static_cast<double>(samples));
    trial.pixels = result.estimate.pixel_count();
    trial.least = least_judged(trial.pixels, 1);
    trial.adaptive = foretell(result.estimate);
    trial.samples = samples;
    return trial;
}

// Two scramblings with half of the samples each. How even the points are shows in how much closer their means are
// than those of as many independent samples. Sobol points are no less even than those.
std::optional<Trial> scrambled_trial(RenderJob& job, std::uint64_t samples, std::stop_token stop) {
    const std::uint64_t points = samples / 2;
    const auto render = [&](std::uint64_t begin) {
        return job.render({begin, begin + points}, {.stop = stop, .progress = {}});
    };
    RenderResult a = render(trial_begin);
    const RenderResult b = render(trial_begin + next_scrambling);
    if (a.estimate.count() < points || b.estimate.count() < points) return std::nullopt;
    const std::vector<double> means_a = mean_of(a.estimate), means_b = mean_of(b.estimate);
    std::vector<double> between(means_a.size());  // variance of a mean
    for (std::size_t i = 0; i < between.size(); ++i) between[i] = 0.5 * std::pow(means_a[i] - means_b[i], 2.0);
    const double mean = 0.5 * (mean_of_all(means_a) + mean_of_all(means_b));
    if (!(mean > 0.0)) return std::nullopt;
    const double error = mean_of_all(between), n = static_cast<double>(points);
    // Points differ more from their mean where that has less variance: E s^2 = n / (n - 1) (variance - error).
    const std::vector<double> within_a = variance_of(a.estimate), within_b = variance_of(b.estimate);
    std::vector<double> noises(between);
    for (std::size_t i = 0; i < noises.size(); ++i) noises[i] += (1.0 - 1.0 / n) * 0.5 * (within_a[i] + within_b[i]);
    const double noise = mean_of_all(noises);
    a.estimate.merge(b.estimate);
    constexpr double steepest = 1.0;  // a squared error of n^-2, which images with edges do not have
    Trial trial;
    trial.noise = noise / (mean * mean);
    if (noise > 0.0 && error > 0.0) trial.gain = std::clamp(std::log(noise / (n * error)) / std::log(n), 0.0, steepest);
    trial.error_of_one = trial.gain > 0.0 ? error * std::pow(n, 1.0 + trial.gain) / (mean * mean) : trial.noise;
    trial.noise_uncertainty = uncertainty_of(noises);
    trial.uncertainty = uncertainty_of(between);
    trial.adaptive = foretell(a.estimate);
    trial.samples = samples;
    trial.points = n;
    const auto on_device = [](const RenderResult& one) { return one.device_seconds.value_or(one.seconds); };
    trial.take_time(0.5 * (a.seconds + b.seconds), 0.5 * (on_device(a) + on_device(b)), n);
    trial.pixels = a.estimate.pixel_count();
    trial.scramblings = scramblings_for(trial.pixels);
    trial.least = least_judged(trial.pixels, trial.scramblings);
    return trial;
}

// A trial beside the best one so far.
struct Compared {
    double seconds = 0.0;      // to the error
    double uncertainty = 0.0;  // of how many times those of the best they are, relative: a standard error
};

// Trials of one generator are compared by their noise until it is known how even points are. Few points do not tell.
Compared compare(const Trial& trial, const Trial& best, double relative_error) {
    constexpr auto few = static_cast<double>(least_points);
    const bool alike = (trial.points > 0.0) == (best.points > 0.0) && best.noise > 0.0;
    if (!alike || (trial.points >= few && best.points >= few))
        return {trial.seconds_to(relative_error),
            std::hypot(trial.uncertainty_at(relative_error), best.uncertainty_at(relative_error))};
    return {trial.seconds_of(best.samples_to(relative_error) * trial.noise / best.noise),
        std::hypot(trial.noise_uncertainty, best.noise_uncertainty)};
}

// As short a trial as tells enough: until `is_clear`, but of no more than so many seconds where more than the least
// samples, or than those of a trial before.
std::optional<Trial> trial_of(const RenderSettings& settings, RenderJob& job, std::uint64_t samples, double seconds,
    std::stop_token stop, const std::function<bool(const Trial&)>& is_clear = {},
    std::optional<Trial> trial = std::nullopt) {
    constexpr std::uint64_t growth = 4;
    const Stopwatch watch;
    if (!trial && job.render({trial_begin, trial_begin + 1}, {.stop = stop, .progress = {}}).estimate.count() == 0)
        return std::nullopt;  // else it is warm now
    if (trial) samples = growth * trial->samples;
    for (;; samples *= growth) {
        if (trial) {
            if (trial->uncertainty <= known_enough || samples > most_trial_samples || (is_clear && is_clear(*trial)))
                return trial;
            if (watch.seconds() + trial->seconds_taken(samples) > seconds) return trial;
        }
        trial = settings.generator == Generator::sobol ? scrambled_trial(job, samples, stop)
                                                       : independent_trial(job, samples, stop);
        if (!trial) return std::nullopt;
    }
}

bool may_adapt(const RenderSettings& settings) {
    RenderSettings adaptive = settings;
    adaptive.sampling = Sampling::adaptive;
    try {
        check_sampling(adaptive);
    } catch (const UnsupportedError&) {
        return false;
    }
    return settings.sampling == Sampling::uniform;
}

// Seconds of a sample of some pixels, in about `seconds` or a block. Nothing after a stop.
std::optional<double> seconds_of_pass(
    RenderJob& job, std::span<const std::uint32_t> pixels, double seconds, std::stop_token stop) {
    RenderResult result;
    std::uint64_t samples = 1;  // warms up
    for (const bool timed : {false, true}) {
        if (timed)
            samples = static_cast<std::uint64_t>(
                std::clamp(seconds / std::max(result.seconds, 1e-9), 1.0, static_cast<double>(samples_per_block)));
        result = job.render_pixels({trial_begin, trial_begin + samples}, pixels, {.stop = stop, .progress = {}});
        if (result.estimate.count() < samples) return std::nullopt;
    }
    return result.seconds / static_cast<double>(samples);
}

// How much longer adaptive samples take than as many uniform ones. Noisy pixels may have longer paths. Passes over few
// pixels keep a device less busy, and the last pass is as long as the noisiest pixel wants. Nothing after a stop.
std::optional<double> slowness_of_passes(RenderJob& job, const Trial& trial, double seconds, std::stop_token stop) {
    const std::span<const std::uint32_t> favoured(trial.adaptive->favoured);
    const std::optional<double> many = seconds_of_pass(job, favoured, seconds, stop);
    const std::optional<double> one = seconds_of_pass(job, favoured.first(1), seconds, stop);
    if (!many || !one) return std::nullopt;
    const double of_paths = *many / (trial.seconds_a_sample * trial.share_of(favoured.size()));
    return uniform_share + (1.0 - uniform_share) * of_paths + trial.adaptive->most * *one / trial.seconds_a_sample;
}

std::string options_of(const RenderSettings& settings, const RenderSettings& given) {
    std::string options;
    const auto add = [&](const std::string& option) { options += (options.empty() ? "" : " ") + option; };
    if (settings.integrator != given.integrator) add("--integrator " + integrator_name(settings.integrator));
    if (settings.mis != given.mis) add("--mis on");
    if (settings.generator != given.generator)
        add(fmt::format("--generator {}", generator_names[static_cast<std::size_t>(settings.generator)]));
    if (settings.roulette_start != given.roulette_start) add(fmt::format("--roulette {}", settings.roulette_start));
    if (settings.sampling != given.sampling) add("--sampling adaptive");
    return options;
}

// The trials so far, and the time that is left for others.
class Choosing {
public:
    // `presumed`: the first trial has Sobol points, which tell the noise of independent samples as well.
    Choosing(const Scene& scene, const RenderSettings& given, Renderer& renderer, const ChoiceGoal& goal, bool adapts,
        bool presumed, std::stop_token stop)
        : scene_(scene),
          given_(given),
          renderer_(renderer),
          goal_(goal),
          user_stop_(std::move(stop)),
          may_still_adapt_(adapts) {
        const Stopwatch preparing;
        if (presumed) {
            choice_.settings = given;
            choice_.settings.generator = Generator::sobol;
            choice_.job = prepared(choice_.settings);
        }
        if (!choice_.job) {
            choice_.settings = given;
            choice_.job = renderer.prepare(scene, given);
        }
        preparation_ = preparing.seconds();
        limit_.emplace(user_stop_, goal.stop_seconds);
        stop_ = limit_->token();
    }

    // First a short one, which says how long the trials may be. False: nothing can be judged.
    bool try_given() {
        const Stopwatch watch;
        best_ = trial_of(choice_.settings, *choice_.job, least_trial_samples, 0.0, stop_);
        if (!best_ && stop_.stop_requested()) {
            // Independent samples tell their error at any stop.
            if (choice_.settings.generator != given_.generator && !user_stop_.stop_requested())
                choose(given_, renderer_.prepare(scene_, given_), 0.0, 0);
            spent_ += watch.seconds();
            return false;
        }
        best_seconds_ = best_ ? best_->seconds_to(goal_.relative_error) : 0.0;
        choice_.trials.push_back({given_, "", best_seconds_});
        if (choice_.settings.generator != given_.generator) {
            const double independent = best_ ? best_->independent().seconds_to(goal_.relative_error) : 0.0;
            choice_.trials.front().seconds_to_error = independent;
            choice_.trials.push_back({choice_.settings, options_of(choice_.settings, given_), best_seconds_});
            choice_.chosen = 1;
            // Fewer samples than scramblings have may suffice.
            if (best_ && preparation_ + independent < clearly_better * best_seconds_ && !stop_.stop_requested()) {
                best_ = best_->independent();
                choose(given_, renderer_.prepare(scene_, given_), independent, 0);
            }
        }
        spent_ += watch.seconds();
        return best_.has_value();
    }

    // A longer trial of the best, in an equal share of the time with so many `others`. It ends when its noise is known,
    // and enough samples tell how long one takes.
    void know_noise(std::size_t others) {
        const double each = seconds_left() / static_cast<double>(others + 1);
        go_on(each, [](const Trial& trial) {
            return trial.noise_uncertainty <= known_enough && trial.samples >= 2 * least_points;
        });
    }

    // The best so far with a change, if there is time for it, in an equal share with so many `others` that are to come.
    // It must be better by more than a standard error.
    template <class Change>
    void try_with(const Change& change, std::size_t others) {
        RenderSettings settings = choice_.settings;
        change(settings);
        const bool sobol = settings.generator == Generator::sobol;
        const std::uint64_t least = sobol && !is_sobol() ? 2 * least_points : least_trial_samples;
        const double needed = preparation_ + best_->seconds_taken(least + 1);
        const double left = seconds_left();
        if (needed > left || stop_.stop_requested()) return;
        const double each = std::max(needed, left / static_cast<double>(others + 1));
        const Stopwatch watch;
        std::unique_ptr<RenderJob> job = prepared(settings);
        std::optional<Trial> trial;
        // That Sobol points are not better may be for want of points.
        const auto is_clear = [&](const Trial& one) {
            const Compared compared = compare(one, *best_, goal_.relative_error);
            const double doubt = 1.0 + 2.0 * compared.uncertainty, ratio = compared.seconds / best_seconds_;
            const bool few = one.points > 0.0 && one.points < static_cast<double>(least_points);
            return (!few && ratio * doubt < clearly_better) || (sobol == is_sobol() && ratio > clearly_better * doubt);
        };
        if (job) trial = trial_of(settings, *job, least, each - watch.seconds(), stop_, is_clear);
        spent_ += watch.seconds();
        if (!trial) return;
        Compared compared = compare(*trial, *best_, goal_.relative_error);
        // How even points are may differ as much between integrators as their noise does.
        if (trial->points > 0.0 && trial->points < static_cast<double>(least_points)) compared.uncertainty += 1.0;
        take(settings, std::move(job), std::move(*trial), compared, sobol == is_sobol() ? 1.0 : 0.0);
    }

    // Roulette spares what dim paths take, for more variance. It is held against the best so far on the same random
    // numbers, where the bright paths of both are the same.
    void try_roulette(std::uint32_t start) {
        RenderSettings settings = choice_.settings;
        settings.roulette_start = start;
        const double needed = preparation_ + best_->seconds_taken(best_->samples + 1);
        if (needed > seconds_left() || stop_.stop_requested()) return;
        const Stopwatch watch;
        std::unique_ptr<RenderJob> job = prepared(settings);
        std::optional<Trial> trial;
        if (job) trial = trial_of(settings, *job, best_->samples, 0.0, stop_);
        spent_ += watch.seconds();
        if (!trial) return;
        const Compared compared = compare(*trial, *best_, goal_.relative_error);
        take(settings, std::move(job), std::move(*trial), compared, 0.0);
    }

    // Sobol points and adaptive sampling exclude each other; the sooner is chosen. Only where what it is foretold,
    // without the slowness of its passes, is better than the best, and it is known how even Sobol points are.
    void try_adaptive() {
        const Trial independent = (independent_ ? *independent_ : *best_).independent();
        RenderSettings settings = choice_.settings;
        settings.generator = given_.generator;
        if (!independent.adaptive || !may_adapt(settings)) return;
        const double one = independent.seconds_a_sample;
        const double alike = static_cast<double>(least_alike) * one;  // up to so many samples it is uniform sampling
        const double uniform_seconds = independent.seconds_to(goal_.relative_error);
        if (uniform_seconds <= alike) return;
        settings.sampling = Sampling::adaptive;
        const auto seconds_with = [&](double slowness) {
            return std::max(alike, uniform_seconds * independent.adaptive->squared_error * slowness);
        };
        const double hoped = seconds_with(1.0);
        if (best_->points > 0.0 && hoped < clearly_better * best_seconds_) go_on(seconds_left(), {});
        may_still_adapt_ = false;
        const double left = seconds_left();
        SettingsTrial tried{settings, options_of(settings, given_), hoped};
        std::unique_ptr<RenderJob> job;
        const bool known = best_->points == 0.0 || best_->points >= static_cast<double>(least_points);
        if (known && hoped < clearly_better * best_seconds_ && preparation_ + 2.0 * one <= left &&
            !stop_.stop_requested()) {
            const Stopwatch watch;
            job = prepared(settings);
            if (!job) return;
            const double each = std::clamp(0.25 * (left - preparation_), one, 32.0 * one);
            const std::optional<double> slowness = slowness_of_passes(*job, independent, each, stop_);
            spent_ += watch.seconds();
            if (!slowness) return;
            tried.seconds_to_error = seconds_with(*slowness);
        }
        const double seconds = tried.seconds_to_error;
        choice_.trials.push_back(std::move(tried));
        if (job && seconds < clearly_better * best_seconds_)
            choose(settings, std::move(job), seconds, choice_.trials.size() - 1);
    }

    [[nodiscard]] bool is_sobol() const { return choice_.settings.generator == Generator::sobol; }
    [[nodiscard]] SettingsChoice taken() {
        choice_.seconds = spent_;
        if (best_ && choice_.settings.sampling == Sampling::uniform)
            choice_.expected_samples = best_->samples_surely_to(goal_.relative_error);
        return std::move(choice_);
    }

private:
    // Adaptive sampling is the one way whose gain is foretold before it is tried. So no trial is to take a share of
    // what it may save.
    [[nodiscard]] double seconds_left() const {
        double best = best_seconds_;
        if (may_still_adapt_ && best_->adaptive)
            best =
                std::min(best, best_->adaptive->squared_error * best_->independent().seconds_to(goal_.relative_error));
        return std::min(goal_.most_seconds, trials_share * best) - spent_;
    }
    // A longer trial of the best.
    void go_on(double seconds, const std::function<bool(const Trial&)>& is_enough) {
        const Stopwatch watch;
        if (std::optional<Trial> longer =
                trial_of(choice_.settings, *choice_.job, 0, seconds, stop_, is_enough, best_)) {
            best_ = std::move(longer);
            best_seconds_ = best_->seconds_to(goal_.relative_error);
            choice_.trials[choice_.chosen].seconds_to_error = best_seconds_;
        }
        spent_ += watch.seconds();
    }
    // Nothing: the renderer has no such settings.
    [[nodiscard]] std::unique_ptr<RenderJob> prepared(RenderSettings& settings) {
        if (settings.effects) settings.effects = settings.effects->united(needed_effects(scene_, settings));
        try {
            return renderer_.prepare(scene_, settings);
        } catch (const UnsupportedError&) {
            return nullptr;
        }
    }
    // Better by a tenth, and by so many standard errors.
    void take(const RenderSettings& settings, std::unique_ptr<RenderJob> job, Trial trial, const Compared& compared,
        double errors) {
        choice_.trials.push_back({settings, options_of(settings, given_), compared.seconds});
        if (!(compared.seconds < clearly_better * best_seconds_)) return;
        if (compared.seconds * (1.0 + errors * compared.uncertainty) > best_seconds_) return;
        if (trial.points > 0.0 && best_->points == 0.0) independent_ = best_;
        best_ = std::move(trial);
        choose(settings, std::move(job), compared.seconds, choice_.trials.size() - 1);
    }
    void choose(const RenderSettings& settings, std::unique_ptr<RenderJob> job, double seconds, std::size_t trial) {
        best_seconds_ = seconds;
        choice_.settings = settings;
        choice_.job = std::move(job);
        choice_.chosen = trial;
    }

    const Scene& scene_;
    const RenderSettings given_;
    Renderer& renderer_;
    ChoiceGoal goal_;
    std::stop_token user_stop_, stop_;  // the second comes with the limit, too
    std::optional<Deadline> limit_;
    SettingsChoice choice_;
    std::optional<Trial> best_;         // what is chosen so far, with uniform sampling
    std::optional<Trial> independent_;  // the best of independent samples, where Sobol points came after it
    bool may_still_adapt_;
    double best_seconds_ = 0.0;               // forecast, of what is chosen so far
    double preparation_ = 0.0, spent_ = 0.0;  // seconds
};

}  // namespace

SettingsChoice choose_settings(const Scene& scene, const RenderSettings& given, const OpenSettings& open,
    Renderer& renderer, const ChoiceGoal& goal, std::stop_token stop) {
    const bool either = given.integrator == Integrator::path || given.integrator == Integrator::next_event;
    // Punctual lights are found by next events alone: with them the two are different images.
    const bool integrators = open.integrator && either && scene.lights.empty();
    // Plain sums run over all samples one after another, which those of scramblings are not.
    const bool generators = open.generator && given.generator != Generator::sobol &&
                            given.sampling == Sampling::uniform && given.accumulation != Accumulation::plain;
    const bool adapts = open.sampling && may_adapt(given);
    std::vector<std::uint32_t> starts;
    for (const std::uint32_t start : {1u, 4u})
        if (open.roulette && start != given.roulette_start && start <= given.bounces) starts.push_back(start);
    const bool any = integrators || generators || !starts.empty() || adapts;
    // Eight scramblings of a small image would be many samples.
    const bool presumed = generators && scramblings_for(std::uint64_t{given.width} * given.height) == 2;
    Choosing choosing(scene, given, renderer, goal, adapts, presumed, std::move(stop));
    const std::size_t others = starts.size() + (generators && !presumed ? 1 : 0) + (open.sampling ? 1 : 0);
    // Adaptive sampling and plain sums make nothing of how many samples an error takes.
    const bool foretells = given.sampling == Sampling::uniform && given.accumulation != Accumulation::plain;
    if (!any && !foretells) return choosing.taken();
    if (!choosing.try_given() || !any) return choosing.taken();
    choosing.know_noise(others + (integrators ? 1 : 0));
    // What gains most, as a rule, comes first, as time may be short.
    if (integrators)
        choosing.try_with(
            [](RenderSettings& settings) {
                settings.integrator =
                    settings.integrator == Integrator::path ? Integrator::next_event : Integrator::path;
                settings.mis = true;
            },
            others);
    if (!starts.empty()) choosing.know_noise(others);
    for (const std::uint32_t start : starts) choosing.try_roulette(start);
    if (generators && !presumed)
        choosing.try_with([](RenderSettings& settings) { settings.generator = Generator::sobol; }, 0);
    if (open.sampling) choosing.try_adaptive();
    return choosing.taken();
}

}  // namespace tandem
