// Whether what `tandem cost` recommends is the fastest when measured anew: the arm that was found soonest to an error
// among many has been lucky more often than not. So it and its nearest rivals run once more, side by side, on random
// numbers and in rounds that had no part in the choice.
#pragma once

#include <string>
#include <vector>

#include "common/cost/analysis.h"

namespace tandem {

// An arm's time to the error over that of the arm that was recommended at first, with an interval that holds for all
// rivals of an error together (95 %, Bonferroni).
struct Rival {
    std::string name;
    Estimated time_ratio{1.0, 1.0, 1.0};
};

// shown: every rival takes longer. open: none is shown to be sooner. refuted: one is.
enum class Confirmed { shown, open, refuted };

struct Confirmation {
    double relative_error = 0.0;
    std::string first;        // the arm that was found soonest before
    std::string recommended;  // the same, unless refuted: then the rival that was soonest now
    Confirmed outcome = Confirmed::open;
    Estimated seconds;      // of `recommended` to the error, as measured anew; 95 %
    bool forecast = false;  // they are: so many samples were not rendered
    std::size_t rounds = 0;
    std::vector<Rival> rivals;  // the nearest first
};

// The number of the first replicate of a confirmation: more than any measurement gets to.
inline constexpr std::uint64_t fresh_replicates = std::uint64_t{1} << 16;
inline constexpr std::size_t most_rivals = 3;  // of an error, and the baseline

// The names of the arms to be measured anew: the soonest to each of cost_errors, its nearest rivals that are safe at
// that error, and the baseline. Empty where nothing has a rival or noise.
[[nodiscard]] std::vector<std::string> arms_to_confirm(const std::vector<ArmFigures>& figures);

// Empty trials of those arms, at the sample counts of `samples`, for CostExperiment::measure to fill: of replicates
// that no other measurement uses.
[[nodiscard]] CostSamples trials_to_confirm(const std::vector<std::string>& names, const CostSamples& samples);

// For each of cost_errors that an arm reaches: floors and slopes are taken from `figures`, noise and times from `anew`
// alone. Errors whose arms have fewer than fewest_replicates replicates in `anew` are left out.
[[nodiscard]] std::vector<Confirmation> confirm(
    const std::vector<ArmFigures>& figures, const std::vector<CostArm>& arms, const CostSamples& anew);

}  // namespace tandem
