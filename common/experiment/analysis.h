// What the raw readings of experiments say: effects with intervals, crossovers, and verdicts on claims.
#pragma once

#include "common/experiment/runner.h"
#include "common/statistics/paired_effect.h"

namespace tandem {

// One arm against the baseline at one workload, over all processes.
struct ArmResult {
    std::string family, arm, text, baseline, clock;
    Workload workload;
    Identity identity = Identity::nothing_to_compare;
    std::string reason;
    std::map<std::string, double> seconds;  // trimmed mean a run, by clock, without warm-up
    double baseline_seconds = 0.0;          // of `clock`
    PairedEffect log_ratio;                 // of log(arm / baseline); no blocks: nothing was timed
    PairedEffect difference;                // arm - baseline, seconds
    double p_family = 1.0;                  // of log_ratio, Holm over the family's arms and workloads
    std::size_t warm_up = 0;                // blocks left out, all processes together

    [[nodiscard]] bool timed() const { return log_ratio.blocks > 0; }
    [[nodiscard]] double ratio() const;
    [[nodiscard]] double ratio_low() const;
    [[nodiscard]] double ratio_high() const;
    // The smallest |ratio - 1| that would have been found.
    [[nodiscard]] double smallest_detectable_relative() const;
};

// Where along the workload an arm begins to be the better one, or the worse. Between `below`, the largest size at which
// one side was surely better, and `above`, the smallest from which the other surely is; `at` by interpolation of the
// log ratio over the logarithm of the size.
struct Crossover {
    std::string family, arm, along;
    bool exists = false;        // false: one side was never surely beaten
    bool faster_above = false;  // the arm beats the baseline above
    double below = 0.0, at = 0.0, above = 0.0;
    std::string text;
};

// Processes of the same experiment are told by family and workload name; their order does not matter.
[[nodiscard]] std::vector<ArmResult> analyse(const std::vector<ExperimentSamples>& samples);
// One for each arm of the family that was timed at two workloads or more.
[[nodiscard]] std::vector<Crossover> crossovers(
    const std::vector<ArmResult>& results, const std::string& along, const std::string& family);

}  // namespace tandem
