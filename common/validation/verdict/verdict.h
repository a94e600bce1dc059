// The three-way verdict on two images at one look: agree, disagree or undecided, and on what grounds.
//
// agree      every channel of the image and of every 16x16 tile is shown to lie within its margin (equivalent(), of
//            statistics/mean_tests.h), and nothing is significant.
// disagree   invalid samples, fixed pixels that differ, or a level that is significant: Holm over the levels, each
//            corrected for its own tests (levels.h). Where the scene has a closed form, each side against it is a level
//            too. Agreement then also needs both sides shown to lie within the image's margin of it.
// undecided  neither. "No significant difference" alone is never called agreement. Nor are two black images, unless
//            black is the scene's closed form: what no light reached has compared nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/validation/verdict/closed_form.h"
#include "common/validation/verdict/levels.h"
#include "common/validation/verdict/paired.h"

namespace tandem {

enum class Verdict { agree, disagree, undecided };
[[nodiscard]] const char* name_of(Verdict verdict);
// Verdict on several scenes: disagree if any does, undecided if any is or some did not run (not `whole`), else agree.
[[nodiscard]] Verdict combined(std::span<const Verdict> verdicts, bool whole = true);

// What this look may spend of the error rates that Criteria declares.
struct LookShare {
    double false_alarm = 0.01;
    double doubt = 0.05;
};

struct Judgement {
    Verdict verdict = Verdict::undecided;
    std::vector<LevelResult> levels;  // "image", "tiles 32x32", "tiles 16x16", "tiles 8x8", "pixels", ...
    FixedPixels fixed;
    bool black = false;              // both sides, every sample
    bool constant = false;           // both sides: one value above 0, without noise
    bool coarse_arithmetic = false;  // more samples part than single precision explains (Arithmetic)
    std::vector<double> pixel_p;
    std::uint64_t discoveries = 0;  // pixels and channels, at the discovery rate
    bool image_within_margin = false, tiles_within_margin = false, closed_form_within_margin = true;
    std::vector<std::string> reasons;  // of a disagreement, or of why there is no decision yet

    // Throws Error if there is no level of that name.
    [[nodiscard]] const LevelResult& level(const std::string& name) const;
    [[nodiscard]] bool significant(const std::string& name) const;  // false where there is no such level
};

// Names of the levels that hold a side to the closed form.
inline constexpr const char* closed_form_reference_level = "closed form, reference";
inline constexpr const char* closed_form_candidate_level = "closed form, candidate";

// Both sides must have the same size. `paired` and `closed_form` may be null.
[[nodiscard]] Judgement judge(const SampledImage& reference, const SampledImage& candidate, const PairedResult* paired,
    const Criteria& criteria, const LookShare& share, const ClosedForm* closed_form = nullptr);

// Whether the paired samples that were judged resolve what Criteria declares.
[[nodiscard]] bool pairs_resolve(const Judgement& judgement, const Criteria& criteria);

// How the candidate differs from the reference, in short: "+1.2 % (image, red)". It is by the most significant level of
// means, else by pixels without variance, invalid samples or the variance. For a judgement of disagreement.
[[nodiscard]] std::string off_by(const Judgement& judgement);

// How the candidate differs from the reference at one level of means, in short.
[[nodiscard]] std::string off_by(const LevelResult& level);

// "CPU and Vulkan agree within ±0.21 % overall (margin 0.50 %), worst 16×16 tile ±2.4 % (margin 10 %), at 95 %;
// detectable: 0.40 % overall".
[[nodiscard]] std::string sentence_of(const Judgement& judgement, const Criteria& criteria,
    const std::string& reference_name, const std::string& candidate_name);

}  // namespace tandem
