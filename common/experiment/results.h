// The file that `tandem bench --json` writes: raw readings first, then everything that follows from them.
#pragma once

#include <nlohmann/json.hpp>

#include "common/experiment/analysis.h"
#include "common/experiment/claims.h"

namespace tandem {

inline constexpr int results_version = 1;

struct BenchResults {
    nlohmann::json device;  // BenchTarget::device
    std::string command, git, scene;
    std::vector<double> empty_submissions;  // seconds each
    std::vector<nlohmann::json> families;   // their texts: name, question, hypothesis, source, held, clock, along
    std::vector<ExperimentSamples> samples;
};

[[nodiscard]] nlohmann::json texts_of(const Family& family);

// {"version", "device", "arms": […], "claims": […], "crossovers", "floor", "families", "raw"}. An arm is {"family",
// "arm", "baseline", "workload", "ratio", "ratio_low", "ratio_high", "unit", "identical", "samples", …}. A claim is
// {"id", "text", "source", "verdict", "effect", "effect_low", "effect_high", "smallest_detectable", …}.
[[nodiscard]] nlohmann::json to_json(const BenchResults& results, const std::vector<Claim>& claims);

// Raw readings of such a file. Throws InputError that names `file` and a JSON pointer.
[[nodiscard]] BenchResults results_from_json(const nlohmann::json& json, const std::string& file);
[[nodiscard]] BenchResults load_results(const std::string& file);

// As comma-separated values [RFC 4180], units in the header. Each arm at each workload has a row for each replicate,
// and one for all of them together.
[[nodiscard]] std::string to_csv(const BenchResults& results);

// As text: a table a family, then claims and crossovers.
[[nodiscard]] std::string to_text(const BenchResults& results, const std::vector<Claim>& claims);

}  // namespace tandem
