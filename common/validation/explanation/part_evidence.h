// How much an observation speaks for or against a part of a path tracer: its log-likelihood ratio, counted over planted
// bugs. That is the log of how often bugs of the part show it, over how often bugs of other parts do. Ratios of
// observations that are independent add up [Good 1985, "Weight of evidence"].
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "common/validation/explanation/likeness.h"
#include "common/validation/verify/elimination.h"
#include "common/validation/verify/path_partings.h"

namespace tandem {

// What taking features out of the scene told of a part.
enum class PartNeed : std::uint8_t {
    unknown,
    needed,            // a feature of it that few faults of other parts need (Naming::particular)
    needed_alone,      // the same, and no feature of any other part is needed
    needed_generally,  // one that many need, and no particular one of another part is needed
    needed_shape,      // the same of a shape alone
    needed_beside,     // general or a shape, beside a particular one of another part
    not_needed,        // some of its features are not, and none is known to be
    cleared,           // nothing of it is left in a scene that differs
};
inline constexpr std::array<std::string_view, 8> part_need_names{
    "unknown", "needed", "needed alone", "needed generally", "needed shape", "needed beside", "not needed", "cleared"};
using PartNeeds = std::array<PartNeed, subsystem_names.size()>;
[[nodiscard]] PartNeeds needs_by_part(const Elimination& elimination);

// One row of the record: what else a planted bug showed (planted_needs.def).
struct PlantedNeeds {
    std::string_view bug;
    std::string_view planting;  // "cpu" or "vulkan"
    Subsystem subsystem = Subsystem::count;
    PartNeeds needs{};
    bool independent_draws = false;
    NumberUse numbers = NumberUse::same;
};
[[nodiscard]] std::span<const PlantedNeeds> planted_needs();

// The score of a part by its pattern (likeness.h), in bands.
inline constexpr std::array pattern_bands{0.02, 0.1, 0.3, 0.6, 0.9, 1.3};  // bounds, from below
[[nodiscard]] std::size_t pattern_band(double score);

// Whether most paths part, and their draws are about as far apart as those of different samples.
[[nodiscard]] bool draws_are_independent(const PathPartings& partings);

// Natural logarithms. Half a bug is added to each count, so that what was never seen is unlikely, not impossible.
struct EvidenceWeights {
    std::array<double, pattern_bands.size() + 1> pattern{};
    std::array<double, part_need_names.size()> need{};
    // For random numbers.
    std::array<double, 2> draws{};  // alike, and independent
    std::array<double, number_use_names.size()> numbers{};
};
// Over the rows of bugs other than `left_out`. Each row's pattern is judged without the rows of its own bug.
[[nodiscard]] EvidenceWeights evidence_weights(
    std::span<const PlantedSignature> patterns, std::span<const PlantedNeeds> needs, std::string_view left_out = {});

// What was observed of a difference.
struct PartEvidence {
    Scores pattern{};                // likeness.h
    std::optional<PartNeeds> needs;  // nothing: no feature was taken out
    bool independent_draws = false;
    NumberUse numbers = NumberUse::same;
};
// The observations overlap in what they tell, so shares of them count. These were about the likeliest for the
// subsystems of left-out planted bugs, between 0.5 and 1.
inline constexpr double pattern_share = 0.6, need_share = 0.5;
// The sum of its log-likelihood ratios, for each part.
[[nodiscard]] Scores weight_of_evidence(const PartEvidence& evidence, const EvidenceWeights& weights);

}  // namespace tandem
