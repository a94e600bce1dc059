// What `tandem cost` measures next: successive halving. All arms have a short stage. Then, error by error from the
// largest on, the arms that could reach it fastest are rendered until they reach it. What is surely far behind, or of a
// mean whose bias another arm has shown to be greater (have_one_mean), takes no time from them; but the baseline is
// measured afterwards, where there is time. In between, arms without a bound on their bias get the samples that bound
// it. Where an error is too far to be met, the arms that may be soonest render more samples, fewer of them each time.
// Decisions follow from the samples alone, so a continued measurement goes on where it stopped.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/cost/analysis.h"

namespace tandem {

inline constexpr std::uint32_t short_stage = 0, floor_stage = 1, first_growth_stage = 2, growth_steps = 4;
inline constexpr std::uint32_t first_goal_stage = first_growth_stage + growth_steps, attempts = 3;
// Where error `index` of cost_errors is measured; attempts after the first are for arms that were not there yet.
[[nodiscard]] constexpr std::uint32_t goal_stage(std::size_t index, std::uint32_t attempt = 0) {
    return first_goal_stage + attempts * static_cast<std::uint32_t>(index) + attempt;
}

// Where the baseline alone goes to an error afterwards. No other arm is in its rounds, so they confirm nothing.
[[nodiscard]] constexpr std::uint32_t baseline_stage(std::size_t index) {
    return goal_stage(cost_errors.size()) + static_cast<std::uint32_t>(index);
}

// A floor below this is bounded well enough.
inline constexpr double floor_bound = 0.01;

// Arms that take part in a goal: fewer for smaller errors. The best adaptive and Sobol arms come besides.
inline constexpr std::array<std::size_t, cost_errors.size()> goal_arms{8, 6, 4};

// Sample counts of a later stage, ascending. The last is `wanted`, or beyond it by a quarter or a block: most of what a
// replicate takes. It is 2^30 at most.
[[nodiscard]] std::vector<std::uint64_t> levels_up_to(double wanted);

// Seconds that a replicate of these trials takes, by what the arm's longest replicates took.
[[nodiscard]] double seconds_a_replicate(const ArmTrials& trials, const CostSamples& samples);

// The next stage that `seconds` allow. Nothing: none is left, or none fits.
[[nodiscard]] std::optional<CostStage> next_stage(
    const std::vector<ArmFigures>& figures, const CostSamples& samples, double seconds);

}  // namespace tandem
