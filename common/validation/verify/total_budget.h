// Many scenes within one budget of seconds. A first round looks at all scenes. Later rounds give the rest of the time
// to undecided scenes, by the forecast of what each needs. This file knows verdicts only; the caller renders.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "common/validation/verify/scene_verdict.h"

namespace tandem {

// Seconds after which an undecided verdict on two right sides would agree. Intervals shrink as samples^-1/2, so that
// the last look's seconds are multiplied by (bound/margin)^2 of what is furthest from its margin. Nothing for a scene
// that is decided, that was not looked at, or that is black: more samples do not help.
[[nodiscard]] std::optional<double> forecast_seconds(const SceneVerdict& verdict);

// A round begins an undecided scene anew, with seeds of its own. All rounds share the scene's error rates equally, so
// that VerifyOptions::scenes is most_rounds times the number of scenes.
inline constexpr std::size_t most_rounds = 3;

struct TotalBudget {
    std::size_t scenes = 0;
    double seconds = 0.0;       // of all
    double most_seconds = 1e9;  // of one scene in one round
    std::stop_token stop;
    std::function<double()> elapsed;  // seconds since the budget began
    std::function<SceneVerdict(std::size_t scene, double seconds, std::size_t round)> verify;
};

// Sets the last verdict on each scene; nothing where its turn never came. What `verify` throws is passed on, and leaves
// the verdicts that there are.
//
// The first round may take half of the budget, in equal parts; what a scene leaves may double those after it. In a
// later round scenes come by their forecast, the least first. Where all forecasts fit, what is left is shared by them.
// Else a scene gets half as much again as its forecast, and one whose forecast does not fit keeps the verdict that it
// has.
void verify_within(const TotalBudget& budget, std::vector<std::optional<SceneVerdict>>& verdicts);

// Seconds that the undecided scenes are foretold to need together; nothing where one has no forecast.
[[nodiscard]] std::optional<double> seconds_needed(const std::vector<SceneVerdict>& verdicts);

}  // namespace tandem
