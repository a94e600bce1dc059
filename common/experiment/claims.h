// Published claims, as data, and the verdicts that readings give on them.
#pragma once

#include "common/experiment/runner.h"

namespace tandem {

// One arm against another of its family, at one workload.
struct Contrast {
    std::string family = {}, arm = {};
    std::string against = {};   // empty: the baseline
    std::string workload = {};  // "smallest" or "largest" along the family's factor, "samples=12"; empty: the largest
    std::string clock = {};     // empty: the family's
};

enum class Predicted : std::uint32_t {
    less,           // the effect is below zero by more than what is negligible
    more,           // above zero by more
    no_difference,  // within what is negligible, either way
    no_more,        // not above what is negligible
};

// A sentence that somebody published, tied to what was measured. Its effect is ratio - 1 of the contrast; with a second
// contrast, the first ratio over the second, - 1.
struct Claim {
    std::string id = {}, text = {}, source = {};
    Contrast contrast = {};
    std::optional<Contrast> over = {};
    Predicted predicted = Predicted::less;
    double negligible_relative = 0.01;  // an effect smaller than this would not matter to anybody
    std::string rule = {};              // in words: what would refute it here
};

enum class ClaimVerdict : std::uint32_t { confirmed, refuted, below_resolution, not_applicable };
[[nodiscard]] const char* name_of(ClaimVerdict verdict);

struct ClaimResult {
    Claim claim;
    ClaimVerdict verdict = ClaimVerdict::not_applicable;
    std::string reason;                          // where it is not applicable
    std::string workload, clock;                 // of the first contrast, where it was measured
    double effect = 0.0, low = 0.0, high = 0.0;  // relative: -0.02 is 2 % faster
    double smallest_detectable = 0.0;            // relative
    double p = 1.0, p_family = 1.0;              // of no effect; Holm over all claims
};

// How each direction of a claim is decided. What is neither confirmed nor refuted is below resolution.
// - less: confirmed if the effect is significant (Holm over the claims) and its interval reaches below -negligible.
//   Refuted if the whole interval is above -negligible.
// - more: the mirror image of less.
// - no_difference: confirmed if the interval lies within ± negligible, refuted if it lies outside.
// - no_more: as no_difference, by the upper side alone.
[[nodiscard]] std::vector<ClaimResult> judge_claims(
    const std::vector<Claim>& claims, const std::vector<ExperimentSamples>& samples);

}  // namespace tandem
