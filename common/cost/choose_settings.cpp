#include "common/cost/choose_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "common/cost/settings_trial.h"
#include "common/deadline.h"
#include "common/error.h"
#include "common/render/adaptive_sampling.h"
#include "common/render/check_settings.h"
#include "common/render/scrambled_film.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

constexpr double clearly_better = 0.9;
constexpr double trials_share = 0.18;  // of the seconds that the best settings so far are forecast to take
// Roulette's trial may take this share of them where others have had theirs. Without it cornell-classic took 1.6 times
// as long at 5 %, in half of the runs; there the trial takes a tenth of what few samples forecast, or a little more.
constexpr double roulette_share = 0.13;
// By how much Sobol points shorten that time where they are yet to be tried: about the medians of times to 5 % of
// README.md.
constexpr double sobol_gain = 2.3;
// How much more even Sobol points may be with one integrator than with the other. The points of a trial do not show it.
// 0.44 is the root mean square of that ratio's logarithm, over 44 pairs of tests/records/accuracy/target_error.json.
constexpr double evenness_of_integrators = 0.5;
constexpr std::uint64_t least_trial_samples = 8, most_trial_samples = 4096;
constexpr double foretelling_share = 0.1;  // of the time for trials; more would leave other trials too little
constexpr double known_enough = 0.05;      // how far a trial's squared error may be off, relatively

// As short a trial as tells enough: until `is_clear`, but of no more than so many seconds where more than the least
// samples, or than those of a trial before.
std::optional<ShortTrial> trial_of(const RenderSettings& settings, RenderJob& job, std::uint64_t samples,
    double seconds, std::stop_token stop, const std::function<bool(const ShortTrial&)>& is_clear = {},
    std::optional<ShortTrial> trial = std::nullopt) {
    constexpr std::uint64_t growth = 4;
    const Stopwatch watch;
    const bool sobol = settings.generator == Generator::sobol;
    bool is_warm = trial.has_value();
    if (trial) samples = growth * trial->samples;
    if (!is_warm && !sobol) {
        is_warm = job.render({trial_begin, trial_begin + 1}, {.stop = stop, .progress = {}}).estimate.count() > 0;
        if (!is_warm) return std::nullopt;
    }
    for (;; samples *= growth) {
        if (trial) {
            if (trial->uncertainty <= known_enough || samples > most_trial_samples || (is_clear && is_clear(*trial)))
                return trial;
            if (watch.seconds() + trial->seconds_taken(samples) > seconds) return trial;
        }
        trial = sobol ? scrambled_trial(job, samples, is_warm, stop) : independent_trial(job, samples, stop);
        if (!trial) return std::nullopt;
        is_warm = true;
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
std::optional<double> slowness_of_passes(
    RenderJob& job, const ShortTrial& trial, double seconds, std::stop_token stop) {
    const Foretold& foretold = *trial.adaptive();
    const std::span<const std::uint32_t> favoured(foretold.favoured);
    const std::optional<double> many = seconds_of_pass(job, favoured, seconds, stop);
    const std::optional<double> one = seconds_of_pass(job, favoured.first(1), seconds, stop);
    if (!many || !one) return std::nullopt;
    const double of_paths = *many / (trial.seconds_a_sample * trial.share_of(favoured.size()));
    return uniform_share + (1.0 - uniform_share) * of_paths + foretold.most * *one / trial.seconds_a_sample;
}

std::string options_of(const RenderSettings& settings, const RenderSettings& given) {
    std::string options;
    const auto add = [&](const std::string& option) { options += (options.empty() ? "" : " ") + option; };
    if (settings.integrator != given.integrator) add("--integrator " + integrator_name(settings.integrator));
    if (settings.mis != given.mis) add("--mis on");
    if (settings.generator != given.generator)
        add(fmt::format("--generator {}", generator_names[static_cast<std::size_t>(settings.generator)]));
    if (settings.roulette_start != given.roulette_start)
        add(fmt::format("--roulette {}", settings.roulette_start == no_roulette ? 0 : settings.roulette_start));
    if (settings.sampling != given.sampling) add("--sampling adaptive");
    return options;
}

// Where roulette may begin instead: never, from the fourth event on, or from the first on. The last spoils how even
// Sobol points are, and few points do not show it. Over the rows of TARGET_ERROR.md it saves up to 1.2 times there, and
// loses up to 2.5 times.
std::vector<std::uint32_t> other_roulette(const RenderSettings& given, bool no_sobol) {
    constexpr std::uint32_t first = 1, late = 4;
    std::vector<std::uint32_t> starts;
    if (given.roulette_start != no_roulette) starts.push_back(no_roulette);
    // A start between the two is much like `late`.
    if (given.roulette_start == no_roulette || given.roulette_start == first) starts.push_back(late);
    if (no_sobol && given.roulette_start != first) starts.push_back(first);
    std::erase_if(starts, [&](std::uint32_t start) { return start != no_roulette && start > given.bounces; });
    return starts;
}

// The trials so far, and the time that is left for others.
class Choosing {
public:
    // `start`: what the first trial is of, with the generator that is given. `presumed`: that trial has Sobol points,
    // which tell the noise of independent samples as well. `sobol`: they are tried later.
    Choosing(const Scene& scene, const RenderSettings& given, const RenderSettings& start, Renderer& renderer,
        const ChoiceGoal& goal, bool adapts, bool presumed, bool sobol, std::stop_token stop)
        : scene_(scene),
          given_(given),
          start_(start),
          renderer_(renderer),
          goal_(goal),
          user_stop_(std::move(stop)),
          may_still_adapt_(adapts),
          sobol_to_come_(sobol) {
        const Stopwatch preparing;
        if (!prepare_first(start, presumed) && !prepare_first(given, presumed))
            choice_.job = renderer.prepare(scene, given);
        preparation_ = preparing.seconds();
        limit_.emplace(user_stop_, goal.stop_seconds);
        stop_ = limit_->token();
    }

    // First a short one, which says how long the trials may be. False: nothing can be judged.
    bool try_first() {
        const Stopwatch watch;
        keep(trial_of(choice_.settings, *choice_.job, least_trial_samples, 0.0, stop_));
        if (!best_ && stop_.stop_requested()) {
            // Nothing speaks for others then, and independent samples tell their error at any stop. But where preparing
            // takes longer than trials may, doing it again would take the time of the image.
            const bool is_soon = !goal_.stop_seconds || preparation_ <= *goal_.stop_seconds;
            if (!options_of(choice_.settings, given_).empty() && !user_stop_.stop_requested() && is_soon)
                choose(given_, renderer_.prepare(scene_, given_), 0.0, 0);
            spent_ += watch.seconds();
            return false;
        }
        best_seconds_ = best_ ? best_->seconds_to(goal_.relative_error) : 0.0;
        choice_.trials.push_back({start_, options_of(start_, given_), best_seconds_});
        if (choice_.settings.generator != start_.generator) {
            const double independent = best_ ? best_->independent().seconds_to(goal_.relative_error) : 0.0;
            choice_.trials.front().seconds_to_error = independent;
            choice_.trials.push_back({choice_.settings, options_of(choice_.settings, given_), best_seconds_});
            choice_.chosen = 1;
            // Fewer samples than scramblings have may suffice.
            if (best_ && preparation_ + independent < clearly_better * best_seconds_ && !stop_.stop_requested())
                if (std::unique_ptr<RenderJob> job = prepared(start_)) {
                    keep(best_->independent());
                    choose(start_, std::move(job), independent, 0);
                }
        }
        spent_ += watch.seconds();
        return best_.has_value();
    }

    // A longer trial of the best, in an equal share of the time with so many `others`. It ends when its noise is known,
    // and enough samples tell how long one takes.
    void know_noise(std::size_t others) {
        const double each = seconds_left() / static_cast<double>(others + 1);
        go_on(each, [](const ShortTrial& trial) {
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
        const auto needed_for = [&](std::uint64_t samples) {
            return preparation_ + best_->seconds_taken(samples + (sobol ? 0 : 1));
        };
        const double left = seconds_left();
        std::uint64_t samples = samples_worth_calls(least);
        while (samples > least && needed_for(samples) > 0.5 * left) samples /= 2;  // others are to come
        const double needed = needed_for(samples);
        if (needed > left || stop_.stop_requested()) return;
        const double each = std::max(needed, left / static_cast<double>(others + 1));
        const Stopwatch watch;
        std::unique_ptr<RenderJob> job = prepared(settings);
        std::optional<ShortTrial> trial;
        const bool of_points = sobol && is_sobol();
        const double taken_below = of_points ? 1.0 / (1.0 + evenness_of_integrators) : clearly_better;
        // That Sobol points are not better may be for want of points.
        const auto is_clear = [&](const ShortTrial& one) {
            const ComparedTrials compared = compare_trials(one, *best_, goal_.relative_error);
            const double doubt = 1.0 + 2.0 * compared.uncertainty, ratio = compared.seconds / best_seconds_;
            const bool few = one.points > 0.0 && one.points < static_cast<double>(least_points);
            return (!few && ratio * doubt < taken_below) || (sobol == is_sobol() && ratio > taken_below * doubt);
        };
        if (job) trial = trial_of(settings, *job, samples, each - watch.seconds(), stop_, is_clear);
        spent_ += watch.seconds();
        if (!trial) return;
        ComparedTrials compared = compare_trials(*trial, *best_, goal_.relative_error);
        if (of_points) compared.uncertainty += evenness_of_integrators;
        take(settings, std::move(job), std::move(*trial), compared, sobol == is_sobol() ? 1.0 : 0.0);
    }

    void try_sobol(std::size_t others) {
        sobol_to_come_ = false;
        try_with([](RenderSettings& settings) { settings.generator = Generator::sobol; }, others);
    }

    // Roulette spares what dim paths take, for more variance. It is held against the best so far on the same random
    // numbers, where the bright paths of both are the same.
    void try_roulette(std::uint32_t start) {
        RenderSettings settings = choice_.settings;
        if (settings.roulette_start == start) return;
        settings.roulette_start = start;
        const double needed = preparation_ + best_->seconds_taken(best_->samples + 1);
        const double at_any_rate = std::min(goal_.most_seconds - spent_, roulette_share * seconds_of_render());
        if (needed > std::max(seconds_left(), at_any_rate) || stop_.stop_requested()) return;
        const Stopwatch watch;
        std::unique_ptr<RenderJob> job = prepared(settings);
        std::optional<ShortTrial> trial;
        if (job) trial = trial_of(settings, *job, best_->samples, 0.0, stop_);
        spent_ += watch.seconds();
        if (!trial) return;
        if (trial->noise < best_->noise && best_->added == 0.0) {
            best_ = with_roulette(std::move(*best_), *trial);
            best_seconds_ = best_->seconds_to(goal_.relative_error);
            choice_.trials[choice_.chosen].seconds_to_error = best_seconds_;
        } else {
            trial = with_roulette(std::move(*trial), *best_);
        }
        const ComparedTrials compared = compare_trials(*trial, *best_, goal_.relative_error);
        take(settings, std::move(job), std::move(*trial), compared, 0.0);
    }

    // Sobol points and adaptive sampling exclude each other; the sooner is chosen. Only where what it is foretold,
    // without the slowness of its passes, is better than the best, and it is known how even Sobol points are.
    void try_adaptive() {
        const ShortTrial independent = (independent_ ? *independent_ : *best_).independent();
        RenderSettings settings = choice_.settings;
        settings.generator = given_.generator;
        const double one = independent.seconds_a_sample;
        const double alike = static_cast<double>(least_alike) * one;  // up to so many samples it is uniform sampling
        const double uniform_seconds = independent.seconds_to(goal_.relative_error);
        // Seconds to foretell it, to prepare it and to time two of its passes. Without them it is not forecast either.
        const double needed = independent.seconds_to_adaptive() + preparation_ + 2.0 * one;
        if (uniform_seconds <= alike || needed > most_seconds_left() || !may_adapt(settings)) return;
        const Foretold* foretold = foretold_by(independent);
        if (foretold == nullptr) return;
        settings.sampling = Sampling::adaptive;
        const auto seconds_with = [&](double slowness) {
            return std::max(alike, uniform_seconds * foretold->squared_error * slowness);
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
        choice_.options = options_of(choice_.settings, given_);
        if (best_ && choice_.settings.sampling == Sampling::uniform)
            choice_.expected_samples = best_->samples_surely_to(goal_.relative_error);
        return std::move(choice_);
    }

private:
    // False: the renderer has no such settings.
    bool prepare_first(const RenderSettings& start, bool presumed) {
        choice_.settings = start_ = start;
        if (presumed) {
            choice_.settings.generator = Generator::sobol;
            choice_.job = prepared(choice_.settings);
        }
        if (!choice_.job) choice_.job = prepared(choice_.settings = start);
        return choice_.job != nullptr;
    }
    // Adaptive sampling is the one way whose gain is foretold before it is tried. So no trial is to take a share of
    // what it may save. Where foretelling takes too long for that, trials have their share of uniform sampling's time.
    [[nodiscard]] double seconds_left() {
        double most = most_seconds_left();
        if (!may_still_adapt_ || best_->seconds_to_adaptive() > foretelling_share * most) return most;
        const Foretold* foretold = foretold_by(*best_);
        most = most_seconds_left();
        if (foretold == nullptr) return most;
        const double adaptive = foretold->squared_error * best_->independent().seconds_to(goal_.relative_error);
        return std::min(most, trials_share * adaptive - spent_);
    }
    // That takes time, once a trial.
    [[nodiscard]] const Foretold* foretold_by(const ShortTrial& trial) {
        const Stopwatch watch;
        const Foretold* foretold = trial.adaptive();
        spent_ += watch.seconds();
        return foretold;
    }
    // As many samples, up to those that tell how even points are, as take as long as a trial's two calls do beside
    // them.
    [[nodiscard]] std::uint64_t samples_worth_calls(std::uint64_t samples) const {
        while (samples < 2 * least_points &&
               static_cast<double>(samples) * best_->seconds_a_sample < 2.0 * best_->seconds_a_call)
            samples *= 2;
        return samples;
    }
    // By the best settings so far.
    [[nodiscard]] double seconds_of_render() const {
        const double seconds = best_seconds_ / (sobol_to_come_ ? sobol_gain : 1.0);
        if (!goal_.most_samples) return seconds;
        return std::min(seconds, best_->seconds_of(static_cast<double>(*goal_.most_samples)));
    }
    [[nodiscard]] double most_seconds_left() const {
        return std::min(goal_.most_seconds, trials_share * seconds_of_render()) - spent_;
    }
    // Its samples only where adaptive sampling may be foretold by them.
    void keep(std::optional<ShortTrial> trial) {
        best_ = std::move(trial);
        if (best_ && !may_still_adapt_) best_->pilot.reset();
    }
    // A longer trial of the best.
    void go_on(double seconds, const std::function<bool(const ShortTrial&)>& is_enough) {
        const Stopwatch watch;
        if (std::optional<ShortTrial> longer =
                trial_of(choice_.settings, *choice_.job, 0, seconds, stop_, is_enough, best_)) {
            if (best_->added > 0.0) longer->fall_as(*best_);
            keep(std::move(longer));
            best_seconds_ = best_->seconds_to(goal_.relative_error);
            choice_.trials[choice_.chosen].seconds_to_error = best_seconds_;
        }
        spent_ += watch.seconds();
    }
    // Nothing: the renderer has no such settings.
    [[nodiscard]] std::unique_ptr<RenderJob> prepared(RenderSettings& settings) {
        if (given_.effects) settings.effects = given_.effects->united(needed_effects(scene_, settings));
        try {
            return renderer_.prepare(scene_, settings);
        } catch (const UnsupportedError&) {
            return nullptr;
        }
    }
    // Better by a tenth, and by so many standard errors.
    void take(const RenderSettings& settings, std::unique_ptr<RenderJob> job, ShortTrial trial,
        const ComparedTrials& compared, double errors) {
        choice_.trials.push_back({settings, options_of(settings, given_), compared.seconds});
        if (!(compared.seconds < clearly_better * best_seconds_)) return;
        if (compared.seconds * (1.0 + errors * compared.uncertainty) > best_seconds_) return;
        if (trial.points > 0.0 && best_->points == 0.0) independent_ = best_;
        keep(std::move(trial));
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
    RenderSettings start_;
    Renderer& renderer_;
    ChoiceGoal goal_;
    std::stop_token user_stop_, stop_;  // the second comes with the limit, too
    std::optional<Deadline> limit_;
    SettingsChoice choice_;
    std::optional<ShortTrial> best_;         // what is chosen so far, with uniform sampling
    std::optional<ShortTrial> independent_;  // the best of independent samples, where Sobol points came after it
    bool may_still_adapt_;
    bool sobol_to_come_;
    double best_seconds_ = 0.0;               // forecast, of what is chosen so far
    double preparation_ = 0.0, spent_ = 0.0;  // seconds
};

// Over the scenes of tests/records/accuracy/target_error.json the best by paths takes up to 30 times as long as the
// best by next events, which takes at most twice as long as that. A short render has no time to find out.
std::optional<RenderSettings> with_next_events(RenderSettings settings, const Scene& scene) {
    settings.integrator = Integrator::next_event;
    settings.mis = true;
    if (!needed_effects(scene, settings).has(Effect::light_sampling)) return std::nullopt;
    return settings;
}

}  // namespace

SettingsChoice choose_settings(const Scene& scene, const RenderSettings& given, const OpenSettings& open,
    Renderer& renderer, const ChoiceGoal& goal, std::stop_token stop) {
    const bool either = given.integrator == Integrator::path || given.integrator == Integrator::next_event;
    // Punctual lights are found by next events alone: with them the two are different images. Without any light for
    // them they are the same.
    const std::optional<RenderSettings> next_events = with_next_events(given, scene);
    const bool integrators = open.integrator && either && scene.lights.empty() && next_events.has_value();
    // Plain sums run over all samples one after another, which those of scramblings are not.
    const bool generators = open.generator && given.generator != Generator::sobol &&
                            given.sampling == Sampling::uniform && given.accumulation != Accumulation::plain;
    const bool adapts = open.sampling && may_adapt(given);
    const bool no_sobol = !generators && given.generator != Generator::sobol;
    const std::vector<std::uint32_t> starts =
        open.roulette ? other_roulette(given, no_sobol) : std::vector<std::uint32_t>();
    const bool any = integrators || generators || !starts.empty() || adapts;
    // Eight scramblings of a small image would be many samples.
    const bool presumed = generators && scramblings_for(std::uint64_t{given.width} * given.height) == 2;
    Choosing choosing(scene, given, integrators ? *next_events : given, renderer, goal, adapts, presumed,
        generators && !presumed, std::move(stop));
    const std::size_t others = starts.size() + (generators && !presumed ? 1 : 0) + (open.sampling ? 1 : 0);
    // Adaptive sampling and plain sums make nothing of how many samples an error takes.
    const bool foretells = given.sampling == Sampling::uniform && given.accumulation != Accumulation::plain;
    if (!any && !foretells) return choosing.taken();
    if (!choosing.try_first() || !any) return choosing.taken();
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
    if (generators && !presumed) {
        choosing.try_sobol(starts.empty() ? 0 : 1);
        // Roulette that independent samples chose may spoil Sobol points.
        if (choosing.is_sobol() && !starts.empty()) choosing.try_roulette(no_roulette);
    }
    if (open.sampling) choosing.try_adaptive();
    return choosing.taken();
}

}  // namespace tandem
