// Looks at single samples under conditions that the looks at means never meet. Both sides draw the same random numbers:
// - counters: seeds and sample numbers with high words, on both sides of powers of two.
// - other sizes: odd ones, more than 65,536 pixels, and small tiles where the candidate has tiles.
// - bounce by bounce: paths as long as the scene allows.
// - arithmetic: the share of samples that rounding parts, against that of single precision itself.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/render/renderer.h"
#include "common/validation/verdict/paired.h"

namespace tandem {

struct SampleLooksRequest {
    const Scene& scene;
    RenderSettings settings;
    Renderer& reference;
    Renderer& candidate;
    // The reference's code in the other precision: double if the reference is single, else single. With nullptr it is
    // not known how single precision parts long paths, and only short ones are looked at.
    Renderer* other_precision = nullptr;
    double budget_seconds = 12.0;  // a look that would end later leaves out some of its conditions
    std::stop_token stop;
    std::function<void(const std::string& what)> progress;
};

struct SampleLooks {
    std::vector<LevelResult> levels;
    std::optional<Arithmetic> arithmetic;
    std::uint64_t invalid_reference = 0, invalid_candidate = 0;
    double reference_seconds = 0.0, candidate_seconds = 0.0;
    bool stopped = false;
    std::vector<std::string> left_out;  // levels, in whole or in part, for want of time
};

// For two sides that follow MODEL.md section 3, in a scene without coincident faces.
[[nodiscard]] SampleLooks look_at_samples(const SampleLooksRequest& request);

// The limits of bounces that are looked at after a limit of 1, rising: every one of them, or as many as are
// `affordable` and the deepest, so that none is left out. Empty where not even one is.
[[nodiscard]] std::vector<std::uint32_t> later_limits(std::uint32_t deepest, double affordable);

// The seed whose paired samples are looked at beside those of `seed`: its high word is not 0.
[[nodiscard]] constexpr std::uint64_t high_seed(std::uint64_t seed) { return seed ^ (std::uint64_t{0x9E3779B9} << 32); }

}  // namespace tandem
