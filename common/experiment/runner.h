// Runs the arms of one family at one workload. It makes them, checks their results, and times them in blocks of random
// order. It ends when the intervals are narrow or the budget is spent. It keeps raw readings, which analysis.h
// interprets.
#pragma once

#include <stop_token>

#include "common/experiment/experiment.h"

namespace tandem {

enum class Identity : std::uint32_t {
    nothing_to_compare,  // no output
    identical,           // the baseline's bits
    agrees,              // the statistical verdict (other arithmetic)
    undecided,           // neither agreement nor a difference was shown (other arithmetic)
    differs,             // its time counts for nothing
    not_applicable,
};
[[nodiscard]] const char* name_of(Identity identity);
[[nodiscard]] Identity identity_named(const std::string& name);  // throws InputError

// What one arm showed in one process: [block], in seconds a run, by clock. A clock that failed once is left out.
struct ArmSamples {
    std::string arm, text;
    Identity identity = Identity::nothing_to_compare;
    std::string reason;  // why it is not applicable, or how it differs
    std::map<std::string, std::vector<double>> seconds;
};

// One process's blocks of one experiment, in order; arms[0] is the baseline.
struct ExperimentSamples {
    std::string family, clock, along;
    Workload workload;
    std::uint64_t seed = 0;            // of the order within blocks
    std::uint64_t runs_a_reading = 1;  // a reading is their mean, where one run is too short
    std::string ended;                 // "narrow", "budget", "blocks", "stopped", "not applicable"
    double made_seconds = 0.0;         // on making arms and gating them
    double seconds = 0.0;              // on blocks
    std::vector<ArmSamples> arms;
};

struct RunnerOptions {
    double seconds = 10.0;          // of blocks
    double least_reading = 2e-3;    // seconds: shorter runs are repeated within a reading,
    double longest_reading = 0.1;   // but no arm's reading gets longer than this by repetition
    double narrow = 0.01;           // stop once every ratio's 95 % interval is within ± this
    std::size_t least_blocks = 16;  // before "narrow" is believed,
    double least_seconds = 0.5;     // and so long: a device that idled may take some tenths to reach its full clock
    std::size_t fewest_blocks = 5;  // even where the budget has run out; then Student's t makes them wide
    std::size_t most_blocks = 400;
    std::uint64_t seed = 1;
    std::vector<std::string> only;  // arms besides the baseline; empty: all
    std::stop_token stop;
    std::function<void(double fraction)> progress;
    std::function<double()> now;  // seconds; empty: the steady clock
};

// Throws UnsupportedError where the baseline itself cannot run. If the family is not for everywhere, all its arms are
// then not applicable, with the baseline's reason.
[[nodiscard]] ExperimentSamples run_experiment(
    const Family& family, const Workload& workload, const RunnerOptions& options);

// Index and seconds of log ratios to the baseline, by block, without warm-up; empty where there is nothing to compare.
[[nodiscard]] std::vector<double> log_ratios(const ExperimentSamples& samples, std::size_t arm);
// Index and difference in seconds to the baseline, by block, without warm-up; empty where there is nothing to compare.
[[nodiscard]] std::vector<double> differences(const ExperimentSamples& samples, std::size_t arm);
// Blocks that are warm-up: the most that any arm's readings show (paired_effect.h).
[[nodiscard]] std::size_t warm_up_blocks(const ExperimentSamples& samples);

}  // namespace tandem
