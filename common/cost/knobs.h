// The knobs that trade time for accuracy. Each setting has the option of `tandem render`, and the change of the
// settings that it makes. An arm of `tandem cost` is a set of such settings on top of a baseline.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/render/renderer.h"

namespace tandem {

// What an arm renders with.
struct ArmSettings {
    RenderSettings render;
    BackendOptions backend;
    bool denoise = false;  // the film, by `tandem denoise` (MODEL.md section 11.6)
};

// Its arms differ in the time to build hierarchies too, which no render's seconds hold.
inline constexpr const char* hierarchy_knob = "hierarchy-quality";

// One value of one knob.
struct KnobSetting {
    std::string knob, setting;  // "integrator", "next-event"
    std::string options;        // of `tandem render`: "--integrator next-event"; of denoise also what follows
    std::function<void(ArmSettings&)> apply;
    std::string reason;  // why it cannot matter in this scene; empty: it may
};

// Every setting of every knob but those that the baseline has already. What a backend lacks it refuses when the arm is
// prepared, with its reason.
// `renderer`: the baseline's. `mean`: of the image, which clamps are multiples of; 0: not known yet, then their options
// say so.
[[nodiscard]] std::vector<KnobSetting> knob_settings(
    const Scene& scene, const ArmSettings& baseline, const RendererInfo& renderer, double mean);

// Scattering events that a path may have where roulette is to end it. They are enough where some light is absorbed at
// every event: at most 0.95^256 = 2e-6 is cut off.
inline constexpr std::uint32_t unlimited_bounces = 256;
// The unlimited estimate of the transport equation (MODEL.md section 2) that the long reference renders.
[[nodiscard]] ArmSettings reference_settings(const ArmSettings& baseline, const std::string& reference_backend);

// Whether an arm's mean differs from the reference's, by design and but for rounding, by no more than the light of
// paths beyond the baseline's bounces. Else it is not recommended for errors that its floor may reach.
[[nodiscard]] bool keeps_estimate(const Scene& scene, const ArmSettings& baseline, const ArmSettings& arm);

// Whether images of both have one mean, and so one bias: they differ in no more than where samples are put and the
// hierarchy, and without a clamp (MODEL.md section 11.1) in how lights are chosen and where roulette begins.
[[nodiscard]] bool have_one_mean(const ArmSettings& a, const ArmSettings& b);

}  // namespace tandem
