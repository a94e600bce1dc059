#include "common/cost/choose_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>

#include "common/adaptive_sampling.h"
#include "common/error.h"

namespace tandem {

namespace {

constexpr std::uint64_t trial_begin = std::uint64_t{1} << 62;  // samples that no render gets to
constexpr double clearly_better = 0.9;
constexpr std::uint64_t least_samples = 16, most_samples = 4096;

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

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
    double cost = 0.0;               // variance of a sample times its seconds
    std::optional<double> adaptive;  // what adaptive sampling makes of it, a factor
};

// Of at least `least_samples` and about `seconds`. Nothing after a stop.
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
    return Trial{variance * result.seconds / static_cast<double>(samples), foretold_error_ratio(result.estimate)};
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

// The chosen settings with adaptive sampling, as one more trial, and as the choice if it is clearly better.
void try_adaptive(const Scene& scene, double ratio, Renderer& renderer, SettingsChoice& choice) {
    SettingsTrial trial = choice.trials[choice.chosen];
    trial.settings.sampling = Sampling::adaptive;
    trial.options += trial.options.empty() ? "--sampling adaptive" : " --sampling adaptive";
    trial.cost *= ratio;
    choice.trials.push_back(trial);
    if (!(ratio < clearly_better)) return;
    try {
        choice.job = renderer.prepare(scene, trial.settings);
    } catch (const UnsupportedError&) {
        choice.trials.pop_back();
        return;
    }
    choice.settings = trial.settings;
    choice.chosen = choice.trials.size() - 1;
}

}  // namespace

SettingsChoice choose_settings(const Scene& scene, const RenderSettings& given, const OpenSettings& open,
    Renderer& renderer, double seconds, std::stop_token stop) {
    const double start = now();
    SettingsChoice choice;
    choice.job = renderer.prepare(scene, given);
    choice.settings = given;
    const std::vector<SettingsTrial> all = candidates(scene, given, open);
    if (all.size() < 2 && !(open.sampling && may_adapt(given))) return choice;
    const double each = seconds / (2.0 * static_cast<double>(all.size()));  // half of the time, as jobs take some too
    double least = 0.0;
    std::optional<double> adaptive;  // of the choice
    for (const SettingsTrial& one : all) {
        const bool first = choice.trials.empty();
        if (!first && (now() - start > seconds || stop.stop_requested())) break;
        std::unique_ptr<RenderJob> job;
        try {
            if (!first) job = renderer.prepare(scene, one.settings);
        } catch (const UnsupportedError&) {
            continue;  // not an alternative here
        }
        const auto trial = trial_of(first ? *choice.job : *job, each, stop);
        if (!trial) break;
        choice.trials.push_back(one);
        choice.trials.back().cost = trial->cost;
        if (first) {
            least = trial->cost * clearly_better;
            adaptive = trial->adaptive;
        } else if (trial->cost < least) {
            least = trial->cost;
            adaptive = trial->adaptive;
            choice.chosen = choice.trials.size() - 1;
            choice.job = std::move(job);
            choice.settings = one.settings;
        }
    }
    if (open.sampling && adaptive && may_adapt(choice.settings)) try_adaptive(scene, *adaptive, renderer, choice);
    choice.seconds = now() - start;
    return choice;
}

}  // namespace tandem
