// The verdict on two renderers and one scene. Independent seeds decide, in a few looks at doubling sample counts.
// Paired seeds find differences that noise would hide. Works on any two Renderers.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/render/renderer.h"
#include "common/validation/verify/scene_verdict.h"

namespace tandem {

struct VerifyOptions {
    std::optional<RenderSettings> settings;  // empty: verification_settings(scene); the seed is replaced by `seed`
    Criteria criteria;                       // fixed_tolerance: at least what the settings' bounces let rounding do
    double budget_seconds = 120.0;           // of wall clock, both sides together
    std::uint64_t max_samples = 0;           // a pixel and side; 0: default_max_samples
    std::size_t max_looks = 6;
    std::uint64_t seed = 1;  // of the reference and of the paired candidate; the other takes seed + 1
    bool paired = true;
    bool explain = true;  // where the two disagree, look for the place of the fault and for planted bugs alike
    // The reference's code in the other precision: double if the reference is single, else single. It shows which paths
    // rounding alone parts. With nullptr, long paths and the candidate's arithmetic are not tested.
    Renderer* other_precision = nullptr;
    // Decides which side is wrong when the two disagree. It gets the rest of the budget, and at least a twentieth of
    // the whole. With nullptr nobody is asked.
    Renderer* oracle = nullptr;
    // The candidate with other kernels, by their names: which of them have a fault that no traced path shows.
    std::vector<std::string> kernels;
    std::function<std::unique_ptr<Renderer>(const std::string& kernel)> with_kernel;
    InPrecision in_precision;  // whether a side errs by its rounding
    bool equal_pixels = true;  // false: a mean over pixels is not quite one over the film, as closed forms are
    std::optional<Misreading> misreading;  // of the scene's file, which is a disagreement with the file
    std::size_t scenes = 1;                // of the run: they share the false alarms and the doubt equally
    std::stop_token stop;
    std::function<void(double fraction, const std::string& text)> progress;  // called from one thread at a time
};

// The scene's own settings with the film scaled so that its longer side has `longer_side` pixels (never enlarged).
[[nodiscard]] RenderSettings verification_settings(const Scene& scene, std::uint32_t longer_side = 128);

// 2^20 samples a pixel, and where a film has fewer than 128x128 pixels, as many in all as that one.
[[nodiscard]] std::uint64_t default_max_samples(const RenderSettings& settings);

// Throws what the renderers throw (UnsupportedError for a scene or setting that one of them cannot do). A stop request
// ends it with the verdict "undecided" on what there is, unless a fault was already certain.
[[nodiscard]] SceneVerdict verify_scene(
    const Scene& scene, Renderer& reference, Renderer& candidate, const VerifyOptions& options);

}  // namespace tandem
