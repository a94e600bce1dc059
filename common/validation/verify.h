// The main job: one scene, two renderers, one verdict. Independent seeds decide over a few looks at doubling sample
// counts; paired seeds beside them find what noise would hide. Works on any two Renderers.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/renderer.h"
#include "common/validation/registration.h"
#include "common/validation/verdict.h"

namespace tandem {

struct VerifyOptions {
    std::optional<RenderSettings> settings;  // empty: verification_settings(scene); the seed is replaced by `seed`
    Criteria criteria;                       // fixed_tolerance is derived from the settings' bounces
    double budget_seconds = 120.0;           // of wall clock, both sides together
    std::uint64_t max_samples = 1u << 20;    // a pixel and side
    std::size_t max_looks = 6;
    std::uint64_t seed = 1;  // of the reference and of the paired candidate; the other takes seed + 1
    bool paired = true;
    std::size_t scenes = 1;  // of the run: they share the false alarms and the doubt equally
    std::stop_token stop;
    std::function<void(double fraction, const std::string& text)> progress;  // called from one thread at a time
};

// The scene's own settings with the film scaled so that its longer side has `longer_side` pixels (never enlarged).
[[nodiscard]] RenderSettings verification_settings(const Scene& scene, std::uint32_t longer_side = 128);

// One row of the history of looks.
struct Look {
    std::uint64_t samples = 0;  // a pixel and side
    LookShare share;
    Verdict verdict = Verdict::undecided;
    double least_p = 1.0;      // over levels, each corrected for its own tests
    double image_bound = 0.0;  // relative
    double tile_bound = 0.0;
    double seconds = 0.0;  // since the start
};

// Everything that a report says of one scene (or of one comparison of images).
struct SceneVerdict {
    std::string scene;
    Verdict verdict = Verdict::undecided;
    std::string sentence;
    Judgement judgement;  // of the last look
    PairedResult paired;
    std::vector<Look> looks;
    std::optional<Registration> registration;  // looked for where the sides disagree
    std::string reference_name, candidate_name;
    RendererInfo reference_info, candidate_info;
    RenderSettings settings;
    Criteria criteria;
    std::uint64_t reference_seed = 0, candidate_seed = 0;
    SampledImage reference, candidate;
    double reference_seconds = 0.0, candidate_seconds = 0.0;  // rendering, paired samples included
    double seconds = 0.0;                                     // all
    bool stopped = false;
};

// Throws what the renderers throw (UnsupportedError for a scene or setting that one of them cannot do). A stop request
// ends it with the verdict "undecided" on what there is, unless a fault was already certain.
[[nodiscard]] SceneVerdict verify_scene(
    const Scene& scene, Renderer& reference, Renderer& candidate, const VerifyOptions& options);

}  // namespace tandem
