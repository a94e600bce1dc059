#include "common/cost/choose_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>

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
            if (integrator != given.integrator) trial.options = "--integrator " + integrator_name(integrator);
            if (trial.settings.mis != given.mis) trial.options += " --mis on";
            if (start != given.roulette_start)
                trial.options += fmt::format("{}--roulette {}", trial.options.empty() ? "" : " ", start);
            all.push_back(std::move(trial));
        }
    return all;
}

// Variance of a sample times its seconds, of at least `least_samples` and about `seconds`. Nothing after a stop.
std::optional<double> cost_of(RenderJob& job, double seconds, std::stop_token stop) {
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
    return std::accumulate(variances.begin(), variances.end(), 0.0) / static_cast<double>(variances.size()) *
           result.seconds / static_cast<double>(samples);
}

}  // namespace

SettingsChoice choose_settings(const Scene& scene, const RenderSettings& given, const OpenSettings& open,
    Renderer& renderer, double seconds, std::stop_token stop) {
    const double start = now();
    SettingsChoice choice;
    choice.job = renderer.prepare(scene, given);
    choice.settings = given;
    const std::vector<SettingsTrial> all = candidates(scene, given, open);
    if (all.size() < 2) return choice;
    const double each = seconds / (2.0 * static_cast<double>(all.size()));  // half of the time, as jobs take some too
    double least = 0.0;
    for (const SettingsTrial& one : all) {
        const bool first = choice.trials.empty();
        if (!first && (now() - start > seconds || stop.stop_requested())) break;
        std::unique_ptr<RenderJob> job;
        try {
            if (!first) job = renderer.prepare(scene, one.settings);
        } catch (const UnsupportedError&) {
            continue;  // not an alternative here
        }
        const auto cost = cost_of(first ? *choice.job : *job, each, stop);
        if (!cost) break;
        choice.trials.push_back(one);
        choice.trials.back().cost = *cost;
        if (first) {
            least = *cost * clearly_better;
        } else if (*cost < least) {
            least = *cost;
            choice.chosen = choice.trials.size() - 1;
            choice.job = std::move(job);
            choice.settings = one.settings;
        }
    }
    choice.seconds = now() - start;
    return choice;
}

}  // namespace tandem
