// Tests whether the recommendation of `tandem cost` is the fastest when measured anew. The fastest of many arms was
// probably lucky. So further stages of the schedule measure it and its nearest rivals side by side. The random numbers
// and rounds of these stages had no part in the choice.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/cost/analysis.h"

namespace tandem {

// An arm's time to the error over that of the arm that was recommended at first. Its interval holds for all rivals of
// an error together (95 %, Bonferroni).
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
    Estimated seconds;      // of `recommended` to the error, as measured anew; 95 %, of one render if forecast
    bool forecast = false;  // they are: so many samples were not rendered
    std::size_t rounds = 0;
    std::vector<Rival> rivals;  // the nearest first
};

inline constexpr std::size_t most_rivals = 3;  // of an error, and the baseline

// For each of cost_errors that an arm reaches and that had a stage of its own. Where no two arms had one, the last
// growth stage of two or more is it. Floors are taken from all that came before it. Noise and times come from that
// stage alone, whose random numbers had no part in the choice of arms. What did not render there is compared by what
// was known of it before.
[[nodiscard]] std::vector<Confirmation> confirm(const std::vector<CostArm>& arms, const CostSamples& samples);

// At one error: `before` all figures without `anew`, `now` those of `anew` alone.
[[nodiscard]] std::optional<Confirmation> confirm_at(
    double error, const std::vector<ArmFigures>& before, const std::vector<ArmFigures>& now, const CostSamples& anew);

}  // namespace tandem
