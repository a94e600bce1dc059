// Which settings bring a scene to an error soonest, by a short trial of each: for `render --target-error`. Only
// settings that estimate the same image are tried (MODEL.md section 9), so that nothing but time is at stake.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "common/render/renderer.h"

namespace tandem {

// What the user has left open.
struct OpenSettings {
    bool integrator = true;  // path against next-event
    bool roulette = true;    // where it may end a path, within the same bounces
    bool sampling = true;    // uniform against adaptive
};

struct SettingsTrial {
    RenderSettings settings;
    std::string options;  // of `tandem render`; empty: the given ones
    double cost = 0.0;    // variance of one sample x its seconds; 0 where a trial saw no noise. Of adaptive sampling
                          // as foretold of the trial that it would change and of what its passes take
};

struct SettingsChoice {
    RenderSettings settings;
    std::unique_ptr<RenderJob> job;     // made for them
    std::vector<SettingsTrial> trials;  // [0] the given ones
    std::size_t chosen = 0;
    double seconds = 0.0;  // that it took
};

// The given settings and every alternative get a trial of equal length, on random numbers that the render does not use;
// the alternative must be better by a tenth, as trials are short. Whether to sample adaptively is asked of the best of
// them, by how uneven its noise is and how long a path takes in the pixels that would get more. Ends trying others
// after `seconds` or a stop.
[[nodiscard]] SettingsChoice choose_settings(const Scene& scene, const RenderSettings& given, const OpenSettings& open,
    Renderer& renderer, double seconds, std::stop_token stop);

}  // namespace tandem
