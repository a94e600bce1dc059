// `tandem cost` from its samples to what a person reads: the JSON, the table and the recommendations.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/cost/analysis.h"

namespace tandem {

struct CostReport {
    std::string scene_file, scene, backend, device, driver;
    std::uint32_t width = 0, height = 0;
    CostReference reference;
    std::string reference_backend;
    std::vector<ArmFigures> figures;  // [0] is the baseline
    std::vector<SkippedArm> skipped;
    double seconds = 0.0;
};

// Sentences that a person can act on: what each knob buys and costs, and the command to the errors of cost_errors.
[[nodiscard]] std::vector<std::string> recommendations(const CostReport& report);
// The figures that reach `relative_error` soonest: the baseline, unless another is significantly sooner.
[[nodiscard]] const ArmFigures* soonest(const std::vector<ArmFigures>& figures, double relative_error);

[[nodiscard]] nlohmann::json to_json(const CostReport& report);
[[nodiscard]] std::string to_text(const CostReport& report);

}  // namespace tandem
