#include "vulkan/renderer/job/job_settings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "common/error.h"
#include "common/render/check_settings.h"
#include "common/scene/coincident_faces.h"
#include "vulkan/framework/shader_library.h"
#include "vulkan/renderer/job/ray_batch.h"
#include "vulkan/renderer/scene/double_geometry.h"

namespace tandem {

namespace {

// In place of a count, for kernels that serve any scene (shaders/kernels/settings.glsl).
constexpr std::uint32_t told_at_run_time = 0xffffffffu;

// That workgroups keep: with as many primitives as loops are unrolled for, less than half of the 16 KiB of shared
// memory that every device has.
constexpr std::size_t most_shared_materials = 32;

// The effects that the shaders can simulate.
constexpr EffectSet simulated = EffectSet::all();

Accumulation chosen_accumulation(const Device& device, const RenderSettings& settings, GeometryPrecision precision) {
    const Accumulation chosen = settings.accumulation.value_or(own_accumulation(device));
    if (precision != GeometryPrecision::single_precision && chosen != Accumulation::in_double)
        throw UnsupportedError("paths in mixed and double precision are summed in double; leave --accumulation out");
    return chosen;
}

EffectSet effects_of(const Scene& scene, const RenderSettings& settings) {
    if (settings.integrator == Integrator::bidirectional)
        throw UnsupportedError("the Vulkan renderer has no bidirectional integrator; the cpu backend has");
    return effects_to_simulate(scene, settings, simulated, "vulkan");
}

// General kernels carry what any scene may need; those of a scene's own effects what that scene does.
PathState path_state(EffectSet effects, bool general, const SceneData& scene) {
    const bool next_events = effects.has(Effect::light_sampling);
    const bool passing_emission = effects.has(Effect::emission) && (general || scene.passing_emission);
    return {next_events, next_events || passing_emission, effects.has(Effect::interiors)};
}

// As kernels kept for another scene would simulate.
EffectSet without_one(EffectSet effects) {
    for (const Effect effect : {Effect::background_gradient, Effect::one_sided_emission, Effect::fuzz, Effect::lens})
        if (effects.has(effect)) return effects.without(effect);
    return effects;
}

}  // namespace

float to_distance(double distance) {
    return static_cast<float>(std::min(distance, double{std::numeric_limits<float>::max()}));
}

std::uint32_t most_segments(EffectSet effects, const RenderSettings& settings) {
    const auto any = [&](std::initializer_list<Effect> some) {
        return std::ranges::any_of(some, [&](Effect effect) { return effects.has(effect); });
    };
    const bool goes_on = any({Effect::specular, Effect::translucent, Effect::smooth_conductor, Effect::boundary});
    const bool receives = any({Effect::diffuse, Effect::rough_conductor, Effect::medium_scattering});
    if (goes_on || (receives && settings.integrator != Integrator::whitted)) return settings.bounces + 1;
    // The shadow ray of direct light belongs to the second.
    return receives && effects.has(Effect::light_sampling) ? std::min(2u, settings.bounces + 1) : 1;
}

Specialisation specialise(const Device& device, const Scene& described, const SceneData& scene,
    const RenderSettings& settings, PlantedFault fault) {
    const EffectSet effects = effects_of(described, settings);
    const bool general = effects != needed_effects(described, settings);
    const SceneTrees& trees = scene.trees;
    const bool has_trees = trees.triangles || trees.spheres || trees.cuboids;
    // Corners that are the same in float may not be in double.
    const bool unrolled = !general && !has_trees && !scene.in_double &&
                          scene.triangle_count + scene.sphere_count + scene.cuboid_count <= most_unrolled;
    const bool fit = scene.triangle_count <= uniform_block_bytes / sizeof(gpu::Triangle) &&
                     std::max(scene.sphere_count, scene.cuboid_count) <= uniform_block_bytes / sizeof(gpu::Convex);
    // Not on a CPU: it gathers lane by lane from uniform blocks, unrolled loops have their primitives in registers, and
    // Mesa 22.3's lavapipe crashes on loops over several of the blocks.
    // In double there are no such blocks.
    const bool from_blocks = device.description().type != DeviceType::cpu && !scene.in_double;
    const auto count = [&](std::uint32_t primitives) { return general ? told_at_run_time : primitives; };
    return {fault.bug == PlantedBug::stale_constant ? without_one(effects) : effects,
        path_state(effects, general, scene), fit && from_blocks && !general,
        unrolled ? std::optional(describe_unrolled(scene)) : std::nullopt, count(scene.triangle_count),
        count(scene.sphere_count), count(scene.cuboid_count), trees.triangles, trees.spheres, trees.cuboids,
        to_distance(settings.ray_min), to_distance(settings.ray_max), fault, settings.intersection, false,
        std::isfinite(settings.clamp) ? std::optional(static_cast<float>(settings.clamp)) : std::nullopt,
        settings.generator, settings.mis, settings.accumulation == Accumulation::plain,
        settings.sampling == Sampling::adaptive, !general && !scene.in_double && is_unturned(scene),
        passed_faces_coincide(described), unrolled && from_blocks,
        unrolled && scene.materials.size() <= most_shared_materials ? static_cast<std::uint32_t>(scene.materials.size())
                                                                    : 0};
}

SceneData flatten_for(
    const Scene& scene, const RenderSettings& settings, Acceleration acceleration, GeometryPrecision precision) {
    SceneData result = flatten(scene, settings, acceleration);
    if (precision != GeometryPrecision::single_precision)
        result.in_double = place_in_double(scene, settings, result, false);
    if (precision == GeometryPrecision::double_precision)
        result.in_double->shading = shading_in_double(scene, result, result.in_double->lights);
    return result;
}

RenderSettings checked_settings(
    const Device& device, const Scene& scene, RenderSettings settings, GeometryPrecision precision) {
    settings.accumulation = chosen_accumulation(device, settings, precision);
    check_settings(scene, settings);
    check_kernels(settings.intersection);
    return settings;
}

RenderSettings mutated_settings(RenderSettings settings, PlantedFault fault) {
    if (fault.bug == PlantedBug::one_bounce_more) ++settings.bounces;
    if (fault.bug == PlantedBug::one_bounce_fewer && settings.bounces > 0) --settings.bounces;
    return settings;
}

Accumulation own_accumulation(const Device& device) {
    const bool can =
        device.features().doubles && !shader_variant(Stage::megakernel, ShaderVariant::double_sums).empty();
    return can ? Accumulation::in_double : Accumulation::compensated;
}

}  // namespace tandem
