// Which effects the CPU path tracer simulates, and the sets that it is compiled for. (MODEL.md says what each effect
// is.)
#pragma once

#include <string_view>

#include "common/render/effects.h"

namespace tandem::cpu::variants {

// Surfaces, materials and emission found by scattering alone.
inline constexpr EffectSet lean_path{Effect::triangles, Effect::spheres, Effect::cuboids, Effect::lens, Effect::diffuse,
    Effect::specular, Effect::fuzz, Effect::translucent, Effect::schlick, Effect::emission, Effect::one_sided_emission,
    Effect::translucent_emission, Effect::background, Effect::background_gradient, Effect::roulette};

// The same with next events.
inline constexpr EffectSet lean_next_event =
    lean_path.united({Effect::light_sampling, Effect::triangle_lights, Effect::sphere_lights, Effect::cuboid_lights});

// Everything; what a job does not simulate is left out at run time.
inline constexpr EffectSet general = EffectSet::all();

inline constexpr EffectSet supported = general;

[[nodiscard]] constexpr std::string_view name(EffectSet variant) {
    if (variant == lean_path) return "lean-path";
    return variant == lean_next_event ? "lean-next-event" : "general";
}

}  // namespace tandem::cpu::variants
