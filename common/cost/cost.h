// The output of `tandem cost`, made from its samples: the JSON, the table and the recommendations.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/cost/confirm.h"

namespace tandem {

struct CostReport {
    std::string scene_file, scene, backend, device, driver;
    std::uint32_t width = 0, height = 0;
    std::vector<std::pair<std::string, std::string>> given;  // options of the baseline: name and value
    CostReference reference;
    std::string reference_backend;
    std::vector<ArmFigures> figures;  // [0] is the baseline
    std::vector<SkippedArm> skipped;
    std::vector<Confirmation> confirmations;  // of what is soonest; none for errors that were not measured anew
    double seconds = 0.0;
    bool whole = true;                     // no stop cut the measurements short
    double asked_error = 0.01;             // that the table is for
    std::vector<std::string> asked_knobs;  // whose settings all stand in the table
};

// Sentences that a person can act on: what each knob buys and costs, and the command to the errors of cost_errors. They
// also say what measuring anew found.
[[nodiscard]] std::vector<std::string> recommendations(const CostReport& report);

// What they recommend for an error: the soonest, unless measuring anew has refuted it. A forecast that was not measured
// anew gives way to the soonest of those whose renders reached the error, but to no other forecast. Nothing: none
// reaches it, as far as is known.
[[nodiscard]] const ArmFigures* recommended(const CostReport& report, double relative_error);

[[nodiscard]] nlohmann::json to_json(const CostReport& report);
// The table of a user: the settings of report.asked_knobs, and others up to `most_rows` in all. The soonest at
// report.asked_error is first.
inline constexpr std::size_t most_rows = 10;
[[nodiscard]] std::string to_text(const CostReport& report);
// All arms, and a sentence on each.
[[nodiscard]] std::string all_to_text(const CostReport& report);

}  // namespace tandem
