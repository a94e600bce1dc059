// Verdicts as JSON: the keys that scripts rely on, and everything that the HTML report shows, except images.
#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "common/validation/verify/verify.h"

namespace tandem {

// {"verdict", "scenes": [{"scene", "verdict", "relative_difference", "relative_difference_low",
// "relative_difference_high", "margin_relative", "worst_tile_relative", "samples_reference", "samples_candidate",
// "seconds_reference", "seconds_candidate", "minimum_detectable_relative", ...}], "device": {"name", "driver", "api"}}.
// Figures of the image are those of the channel whose interval reaches furthest from zero. A figure that is not known
// (nothing rendered, an unbounded interval) is null. `device` is the candidate's. "outvoted" is "reference",
// "candidate", "both" or null, by "closed_form" (null where the scene has none), else by "referee" (null where none was
// asked). "not_run" names the scenes that a stop or an error left out.
[[nodiscard]] nlohmann::json to_json(
    std::span<const SceneVerdict> verdicts, const std::vector<std::string>& not_run = {});
[[nodiscard]] nlohmann::json to_json(const SceneVerdict& verdict);

}  // namespace tandem
