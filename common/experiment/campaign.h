// How a campaign shares its time over all experiments of some families. Each arm is made anew in every round, by one
// process or by several in turn. The command starts the processes.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/experiment/results.h"
#include "common/experiment/runner.h"

namespace tandem {

struct CampaignOptions {
    double seconds = 120.0;         // of all experiments together
    double narrow = 0.01;           // an experiment ends early once each ratio is known to within ± this
    unsigned replicates = 8;        // of every arm
    std::uint64_t seed = 1;         // of the order in which arms run
    std::vector<std::string> only;  // arms besides the baseline; empty: all
    std::stop_token stop;
    std::function<void(double fraction, const std::string& text)> progress;
    // Takes what there is so far, after every experiment.
    std::function<void(const BenchResults&)> keep;
    std::function<double()> now;  // seconds; empty: the steady clock
};

// Rounds over all experiments that are not known well enough yet. In each round every arm is made anew. Two jobs of one
// arm differ by their luck with memory and threads, and slow drifts of the machine outlast many blocks. The first round
// is made whatever the time; what is left of it is shared by what is left to do. Arms pass the identity gate in the
// first round alone. Adds to `results`; returns for how many whole rounds there was time, `replicates` after a stop.
[[nodiscard]] unsigned run_campaign(
    const std::vector<Family>& families, const CampaignOptions& options, BenchResults& results);

// Arms at workloads, and those of them that `results` tells nothing of.
struct ArmCount {
    std::size_t all = 0, missing = 0;
};
[[nodiscard]] ArmCount count_arms(
    const std::vector<Family>& families, const std::vector<std::string>& only, const BenchResults& results);

// Takes over the readings of another file or process. Throws InputError, naming `whose`, where they are of another
// device, driver, build or scene.
void merge(BenchResults& results, BenchResults other, const std::string& whose);

// What each of `processes` processes is to do of a campaign: shares of the time and the replicates, and a seed of its
// own. There is none without a replicate.
struct CampaignPart {
    double seconds = 0.0;
    unsigned replicates = 0;
    std::uint64_t seed = 0;
};
[[nodiscard]] std::vector<CampaignPart> parts_of(const CampaignOptions& options, unsigned processes);

}  // namespace tandem
