// Analysis of the raw readings of experiments: effects with intervals, crossovers, and verdicts on claims.
#pragma once

#include "common/experiment/runner.h"
#include "common/statistics/paired_effect.h"

namespace tandem {

// What may be said of one time against another.
enum class Change : std::uint32_t {
    same,       // the whole interval of the ratio lies within the margin
    faster,     // significantly
    slower,     // likewise
    ambiguous,  // neither
};
[[nodiscard]] const char* name_of(Change change);
inline constexpr double negligible_change = 0.02;  // the margin, relative

// What a ratio's 95 % interval and the p-value of no effect say.
[[nodiscard]] Change change_of(double low, double high, double p);

// One arm against the baseline at one workload, over all processes.
struct ArmResult {
    std::string family, arm, text, baseline, clock;
    Workload workload;
    Identity identity = Identity::nothing_to_compare;
    std::string reason;
    // Times of a run, by clock, without warm-up: the median over replicates of each one's trimmed mean. A replicate in
    // which the device was slow as a whole moves it by no more than any other one.
    std::map<std::string, double> seconds;
    std::vector<double> replicate_seconds;  // trimmed means by `clock`
    PairedEffect log_ratio;                 // of log(arm / baseline); no blocks: nothing was timed
    PairedEffect difference;                // arm - baseline, seconds
    double p_family = 1.0;                  // of log_ratio, Holm over the family's arms and workloads
    std::size_t warm_up = 0;                // blocks left out, all processes together

    [[nodiscard]] bool timed() const { return log_ratio.blocks > 0; }
    [[nodiscard]] Change verdict() const;  // Holm over the family
    [[nodiscard]] double ratio() const;
    [[nodiscard]] double ratio_low() const;
    [[nodiscard]] double ratio_high() const;
    // The smallest |ratio - 1| that would have been found.
    [[nodiscard]] double smallest_detectable_relative() const;
};

// Where along the workload an arm begins to be the better one, or the worse. `below` is the largest size at which one
// side was surely better, `above` the smallest from which the other surely is. `at` between them interpolates the log
// ratio over the logarithm of the size.
struct Crossover {
    std::string family, arm, along;
    bool exists = false;        // false: one side was never surely beaten
    bool faster_above = false;  // the arm beats the baseline above
    double below = 0.0, at = 0.0, above = 0.0;
    std::string text;
};

// Processes of the same experiment are told by family and workload name; their order does not matter.
[[nodiscard]] std::vector<ArmResult> analyse(const std::vector<ExperimentSamples>& samples);
// One replicate alone, its blocks as they are.
struct ReplicateResult {
    std::string family, arm, baseline, clock;
    Workload workload;
    std::size_t replicate = 0;  // of its experiment, from 1 on
    std::size_t blocks = 0;     // without warm-up
    double seconds = 0.0;       // trimmed mean a run; NaN: not timed
    double ratio = 0.0;         // exp of the trimmed mean of log ratios; NaN: the baseline, or not timed
};
[[nodiscard]] std::vector<ReplicateResult> replicates_of(const std::vector<ExperimentSamples>& samples);

// The crossover of each arm of the family that was timed at two workloads or more.
[[nodiscard]] std::vector<Crossover> crossovers(
    const std::vector<ArmResult>& results, const std::string& along, const std::string& family);

}  // namespace tandem
