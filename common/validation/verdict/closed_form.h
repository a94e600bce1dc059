// A scene's closed form (Scene::expect) as a reference. Each side's image mean is compared with it, so that a fault of
// both sides shows too.
#pragma once

#include <optional>
#include <string>

#include "common/render/renderer.h"
#include "common/validation/verdict/levels.h"

namespace tandem {

struct ClosedForm {
    std::array<double, channel_count> radiance{};  // mean over the image
    std::string formula;
    // The most that one sample of a right renderer can be (greatest_sample.h), finite: what the bound below needs.
    std::array<double, channel_count> greatest{};
    // Relative rounding of float transport, a side: half of float_transport_tolerance.
    double rounding = 0.0;
};

// The closed form at these settings, or why there is none to hold a renderer to. It is a mean over the film at the
// file's own bounces and interval of ray lengths. The shape of the film, --filter, --fresnel and --clamp change that
// mean. Roulette, the number of pixels and an integrator that follows indirect light do not (MODEL.md section 9).
struct ClosedFormUse {
    std::optional<ClosedForm> form;
    std::string skipped;  // why a scene's closed form is left out; empty where it has none
};
[[nodiscard]] ClosedFormUse closed_form_of(const Scene& scene, const RenderSettings& settings);

// `side`'s image mean against the closed form, a channel a region; `reference` of a region is the closed form's.
//
// Counted is what exceeds an allowance: Negligible::image and the rounding. Where no pixel of the channel has variance,
// it is the rounding alone, but for another program, whose sums may drift: those of Cycles by 3.4e-6 at 2^14 samples.
// It is relative to the larger of the channel and Margins::channel_floor times the three's mean.
// The p of a channel is the larger of two. One is Student's t, from the pixels' variances. The other is the empirical
// Bernstein bound, which holds for any distribution of samples below `greatest`. So rare bright paths that were not yet
// met raise no alarm.
[[nodiscard]] LevelResult compare_closed_form(const std::string& name, const ClosedForm& form, const SampledImage& side,
    const Criteria& criteria, double alpha_each_side);

}  // namespace tandem
