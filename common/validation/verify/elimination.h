// Finds the features that a disagreement needs, by delta debugging [Zeller, Hildebrandt 2002]. Features are taken out
// of the scene on both sides, halves first. Paired samples tell whether the difference stays. If it does, the features
// stay out, until every feature that is left is needed. This names no side and changes no verdict.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/render/renderer.h"
#include "common/stopwatch.h"
#include "common/validation/explanation/scene_features.h"
#include "common/validation/verdict/criteria.h"
#include "common/validation/verdict/sample_pairs.h"

namespace tandem {

// What paired samples of one scene show.
struct PairedLook {
    std::uint64_t pairs = 0;             // a pixel
    std::uint64_t invalid = 0;           // samples, of both sides
    SampleCount sums;                    // of a few samples of a pixel: lit ones, and those that parted
    double lit_share = 0.0;              // of all sums
    double relative = 0.0, error = 0.0;  // of means, where the whole scene's differ most surely; one standard error
    double p = 1.0;  // bound on the chance that the means of the image or a tile differ by more than rounding may do
};

enum class Need : std::uint8_t { needed, not_needed, unknown };
inline constexpr std::array<std::string_view, 3> need_names{"needed", "not needed", "unknown"};

struct FeatureTrial {
    SceneFeature feature;
    Need need = Need::unknown;
    PairedLook with;                    // the plainest scene by then that differs
    std::optional<PairedLook> without;  // that scene without it, and without others if those are not needed either
};

struct Elimination {
    std::vector<FeatureTrial> trials;  // the most particular feature first
    PairedLook whole;                  // the scene as it is
    std::size_t scenes = 0;            // that were rendered
    double seconds = 0.0;
    bool by_samples = false;  // samples that part told, or else means
    // The candidate draws the reference's samples again with one bounce more (1) or fewer (-1).
    std::optional<int> bounces_off;
    std::string left_out;  // why nothing, or not all, was tried; empty: all was
};

struct EliminationQuestion {
    const Scene& scene;
    RenderSettings settings;  // the seed is that of both sides
    Renderer& reference;
    Renderer& candidate;
    Renderer* other_precision = nullptr;  // of the reference: what rounding alone parts; nullptr: not known
    Criteria criteria;
    bool same_samples = true;       // samples part by rounding alone (MODEL.md section 3)
    std::vector<double> suspicion;  // by Subsystem: what is suspected least is taken out first; empty: all alike
    double budget_seconds = 10.0;
    double expected_seconds = 1.0;  // of the first scene
    std::stop_token stop;
    std::function<void(const std::string& what)> progress;
    std::function<double()> now = steady_seconds;  // the clock of the budget
};

// For two sides that draw the same numbers. A scene that a side refuses, or that is dark, decides nothing.
[[nodiscard]] Elimination eliminate(const EliminationQuestion& question);

// Parts whose features are all out of a scene that differs still, so that nothing of them is left in it.
[[nodiscard]] std::vector<Subsystem> cleared_parts(const Elimination& elimination);

// "the sides agree without it: 128 pairs a pixel, difference 0.02 % ± 0.05 %; with it 2.1 %"
[[nodiscard]] std::string told(const Elimination& elimination, const FeatureTrial& needed);
// "with one bounce more the candidate has the samples of the reference"; where bounces_off is set.
[[nodiscard]] std::string told_of_bounces(const Elimination& elimination);
// "features taken out on both sides (7 scenes in 3.2 s): needed: a lens; not needed: ...; not known: ..."
[[nodiscard]] std::string told(const Elimination& elimination);

}  // namespace tandem
