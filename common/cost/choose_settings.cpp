#include "common/cost/choose_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>

#include "common/error.h"
#include "common/render/adaptive_sampling.h"
#include "common/render/check_settings.h"
#include "common/stopwatch.h"

namespace tandem {

namespace {

constexpr std::uint64_t trial_begin = std::uint64_t{1} << 62;  // samples that no render gets to
constexpr double clearly_better = 0.9;
constexpr std::uint64_t least_samples = 16, most_samples = 4096;

std::vector<SettingsTrial> candidates(const Scene& scene, const RenderSettings& given, const OpenSettings& open) {
    std::vector<Integrator> integrators{given.integrator};
    const bool either = given.integrator == Integrator::path || given.integrator == Integrator::next_event;
    // Punctual lights are found by next events alone: with them the two are different images.
    if (open.integrator && either && scene.lights.empty())
        integrators.push_back(given.integrator == Integrator::path ? Integrator::next_event : Integrator::path);
    std::vector<std::uint32_t> starts{given.roulette_start};
    for (const std::uint32_t start : {1u, 4u})
        if (open.roulette && start != given.roulette_start && start <= given.bounces) starts.push_back(start);
    std::vector<SettingsTrial> all;
    for (const Integrator integrator : integrators)
        for (const std::uint32_t start : starts) {
            SettingsTrial trial{given, "", 0.0};
            trial.settings.integrator = integrator;
            if (integrator != given.integrator) trial.settings.mis = true;
            trial.settings.roulette_start = start;
            if (given.effects) trial.settings.effects = given.effects->united(needed_effects(scene, trial.settings));
            if (integrator != given.integrator) trial.options = "--integrator " + integrator_name(integrator);
            if (trial.settings.mis != given.mis) trial.options += " --mis on";
            if (start != given.roulette_start)
                trial.options += fmt::format("{}--roulette {}", trial.options.empty() ? "" : " ", start);
            all.push_back(std::move(trial));
        }
    return all;
}

struct Trial {
    double cost = 0.0;              // variance of a sample times its seconds
    double seconds_a_sample = 0.0;  // of all pixels
    std::uint64_t pixels = 0;
    std::optional<Foretold> adaptive;
    [[nodiscard]] double share_of(std::size_t some) const {
        return static_cast<double>(some) / static_cast<double>(pixels);
    }
};

// Renders at least `least_samples`, for about `seconds`. Nothing after a stop.
std::optional<Trial> trial_of(RenderJob& job, double seconds, std::stop_token stop) {
    const auto render = [&](std::uint64_t samples) {
        return job.render({trial_begin, trial_begin + samples}, {.stop = stop, .progress = {}});
    };
    RenderResult result = render(1);  // warms up
    if (result.estimate.count() == 0) return std::nullopt;
    const double wanted = seconds / std::max(result.seconds, 1e-9);
    std::uint64_t samples = least_samples;
    while (static_cast<double>(2 * samples) <= wanted && samples < most_samples) samples *= 2;
    result = render(samples);
    if (result.estimate.count() < samples) return std::nullopt;
    const std::vector<double> variances = variance_of(result.estimate);
    const double variance =
        std::accumulate(variances.begin(), variances.end(), 0.0) / static_cast<double>(variances.size());
    const double seconds_a_sample = result.seconds / static_cast<double>(samples);
    return Trial{variance * seconds_a_sample, std::max(seconds_a_sample, 1e-12), result.estimate.pixel_count(),
        foretell(result.estimate)};
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

// How much longer adaptive samples take than as many uniform ones: noisy pixels may have longer paths, and passes over
// few of them, the last of which is as long as the noisiest pixel wants, keep a device less busy. Nothing after a stop.
std::optional<double> slowness_of_passes(RenderJob& job, const Trial& trial, double seconds, std::stop_token stop) {
    const std::span<const std::uint32_t> favoured(trial.adaptive->favoured);
    const std::optional<double> many = seconds_of_pass(job, favoured, seconds, stop);
    const std::optional<double> one = seconds_of_pass(job, favoured.first(1), seconds, stop);
    if (!many || !one) return std::nullopt;
    const double of_paths = *many / (trial.seconds_a_sample * trial.share_of(favoured.size()));
    return uniform_share + (1.0 - uniform_share) * of_paths + trial.adaptive->most * *one / trial.seconds_a_sample;
}

// The chosen settings with adaptive sampling, as one more trial, and as the choice if it is clearly better.
void try_adaptive(const Scene& scene, const Trial& of_choice, double seconds, Renderer& renderer,
    SettingsChoice& choice, std::stop_token stop) {
    const double error = of_choice.adaptive->squared_error;
    SettingsTrial trial = choice.trials[choice.chosen];
    trial.settings.sampling = Sampling::adaptive;
    trial.options += trial.options.empty() ? "--sampling adaptive" : " --sampling adaptive";
    trial.cost *= error;
    std::unique_ptr<RenderJob> job;
    if (error < clearly_better) {
        try {
            job = renderer.prepare(scene, trial.settings);
        } catch (const UnsupportedError&) {
            return;  // not an alternative here
        }
        const std::optional<double> slowness = slowness_of_passes(*job, of_choice, seconds, stop);
        if (!slowness) return;
        trial.cost *= *slowness;
    }
    const bool better = trial.cost < clearly_better * choice.trials[choice.chosen].cost;
    choice.trials.push_back(trial);
    if (!better) return;
    choice.job = std::move(job);
    choice.settings = trial.settings;
    choice.chosen = choice.trials.size() - 1;
}

}  // namespace

SettingsChoice choose_settings(const Scene& scene, const RenderSettings& given, const OpenSettings& open,
    Renderer& renderer, double seconds, std::stop_token stop) {
    const Stopwatch watch;
    SettingsChoice choice;
    choice.job = renderer.prepare(scene, given);
    choice.settings = given;
    const std::vector<SettingsTrial> all = candidates(scene, given, open);
    if (all.size() < 2 && !(open.sampling && may_adapt(given))) return choice;
    const double each = seconds / (2.0 * static_cast<double>(all.size()));  // half of the time, as jobs take some too
    double least = 0.0;
    std::optional<Trial> best;
    for (const SettingsTrial& one : all) {
        const bool first = choice.trials.empty();
        if (!first && (watch.seconds() > seconds || stop.stop_requested())) break;
        std::unique_ptr<RenderJob> job;
        try {
            if (!first) job = renderer.prepare(scene, one.settings);
        } catch (const UnsupportedError&) {
            continue;  // not an alternative here
        }
        std::optional<Trial> trial = trial_of(first ? *choice.job : *job, each, stop);
        if (!trial) break;
        choice.trials.push_back(one);
        choice.trials.back().cost = trial->cost;
        if (first) {
            least = trial->cost * clearly_better;
            best = std::move(trial);
        } else if (trial->cost < least) {
            least = trial->cost;
            best = std::move(trial);
            choice.chosen = choice.trials.size() - 1;
            choice.job = std::move(job);
            choice.settings = one.settings;
        }
    }
    if (open.sampling && best && best->adaptive && may_adapt(choice.settings))
        try_adaptive(scene, *best, each, renderer, choice, stop);
    choice.seconds = watch.seconds();
    return choice;
}

}  // namespace tandem
