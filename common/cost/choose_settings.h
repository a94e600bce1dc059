// Finds the settings that reach an error fastest, by short trials: for `render --target-error`. It tries only settings
// that estimate the same image (MODEL.md section 9), so the choice affects the time alone.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/render/renderer.h"

namespace tandem {

// What the user has left open.
struct OpenSettings {
    bool integrator = true;  // next-event against path
    bool roulette = true;    // where it may end a path, within the same bounces
    bool sampling = true;    // uniform against adaptive
    bool generator = true;   // Sobol points against the given one
};

struct ChoiceGoal {
    double relative_error = 0.01;  // that the render is to reach
    double most_seconds = 20.0;    // of all trials
    // The render takes at most so many. Trials take no greater share of these than of what the error takes.
    std::optional<std::uint64_t> most_samples = {};
    // So long after the first preparation the trial that is under way is given up. None: the first one goes on.
    std::optional<double> stop_seconds = {};
};

struct SettingsTrial {
    RenderSettings settings;
    std::string options;          // of `tandem render`; empty: as given
    double seconds_to_error = 0;  // forecast, of the render alone; 0 where a trial saw no noise
};

struct SettingsChoice {
    RenderSettings settings;
    std::unique_ptr<RenderJob> job;     // made for them
    std::vector<SettingsTrial> trials;  // in their order; empty: none came to its end
    std::size_t chosen = 0;
    std::string options;   // of the settings, as options of `tandem render`; empty: as given
    double seconds = 0.0;  // that the trials and their preparations took, without that of the chosen job
    std::optional<double> expected_samples = {};  // that the error takes; none of adaptive sampling, and without noise
};

// A trial of the given settings forecasts how long the render takes. Where the integrator is open, and the scene has
// light for them, it is of next events. Alternatives get trials as long as all of them together take no more than a
// share of that, and each until there is no doubt. The other integrator comes first, then roulette, Sobol points and
// adaptive sampling, each on the best so far. Trials use random numbers that the render does not. An alternative must
// be better by a tenth, as trials are short; the other integrator with Sobol points by a half. Roulette is tried on the
// best's own random numbers: without it where the scene has it, else from the fourth event on; where Sobol points are
// not to be had, from the first on, too. Its trial may take an eighth of the render where others have used up their
// share. Sobol points do not reduce the noise that it adds faster than 1/n. Adaptive sampling is judged by how uneven
// the noise of the best is, and how long paths take in the pixels that would get more. Sobol points are judged by two
// scramblings. Where a render needs no more than two, they are part of the first trial. Then they are left only where
// fewer samples than theirs suffice, or for adaptive sampling. In smaller images they come last, on the roulette that
// independent samples chose, and then without it. Where nothing is open, a short trial tells how many samples the error
// takes. Ends trying others after a stop.
[[nodiscard]] SettingsChoice choose_settings(const Scene& scene, const RenderSettings& given, const OpenSettings& open,
    Renderer& renderer, const ChoiceGoal& goal, std::stop_token stop);

}  // namespace tandem
