#include "vulkan/renderer/job/job_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "common/error.h"
#include "common/render/check_settings.h"
#include "common/render/memory_forecast.h"
#include "common/scene/coincident_faces.h"
#include "vulkan/framework/shader_library.h"
#include "vulkan/renderer/job/memory.h"
#include "vulkan/renderer/job/ray_batch.h"
#include "vulkan/renderer/kernels/bindings.h"
#include "vulkan/renderer/kernels/kernel_shape.h"
#include "vulkan/renderer/kernels/megakernel_plan.h"
#include "vulkan/renderer/scene/double_geometry.h"

namespace tandem {

namespace {

// That workgroups keep. With as many primitives as loops are unrolled for, they take less than half of the 16 KiB of
// shared memory that every device has.
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

bool picks_candidates(const Specialisation& specialisation, CandidatePattern wanted) {
    const bool can_pick = specialisation.unrolled && specialisation.triangles > 0 &&
                          specialisation.intersection.triangles == TriangleKernel::watertight;
    if (wanted == CandidatePattern::edges && !can_pick)
        throw UnsupportedError(
            "candidates are picked of a few triangles, by kernels made for the scene that loop over them, with the "
            "watertight test in single precision");
    return wanted == CandidatePattern::automatic ? specialisation.picks_candidates : wanted == CandidatePattern::edges;
}

// Materials that workgroups copy.
std::uint32_t shared_materials(const Specialisation& specialisation, const Device& device, const TracerTuning& tuning) {
    const bool on_cpu = device.description().type == DeviceType::cpu;
    if (tuning.hit_data == HitDataPattern::shared &&
        (tuning.kernel != KernelShape::megakernel || specialisation.shared_materials == 0))
        throw UnsupportedError(
            "workgroups of a megakernel alone copy what hits need, of small scenes, in single precision");
    const bool copied =
        tuning.hit_data == HitDataPattern::shared || (tuning.hit_data == HitDataPattern::automatic && !on_cpu);
    return copied ? specialisation.shared_materials : 0;
}

void check_workgroup(const Device& device, std::uint32_t workgroup) {
    const vk::PhysicalDeviceLimits& limits = device.limits();
    if (workgroup == 0 || workgroup > limits.maxComputeWorkGroupInvocations ||
        workgroup > limits.maxComputeWorkGroupSize[0])
        throw UnsupportedError(
            fmt::format("{} has no workgroups of {} invocations", device.description().name, workgroup));
}

// The largest buffer of a large scene is that of its trees' nodes, one a primitive.
void check_buffers(const Device& device, const Scene& scene, const RenderSettings& settings) {
    const std::uint64_t primitives = nodes_of(placed_counts(scene, placed_meshes(scene, settings))),
                        nodes = primitives * sizeof(gpu::BvhNode);
    if (const std::uint64_t range = device.limits().maxStorageBufferRange; nodes > range)
        throw UnsupportedError(fmt::format(
            "{} lets shaders see {} KiB of a buffer, and the tree of {} primitives takes {}; use a smaller scene, "
            "another --device, or --backend cpu",
            device.description().name, range >> 10, primitives, (nodes >> 10) + 1));
}

}  // namespace

// Whatever the roulette: it ends no path where nothing is absorbed.
bool fits_whole_paths(const RenderSettings& settings) { return settings.bounces < most_whole_path_segments; }

float to_distance(double distance) {
    return static_cast<float>(std::min(distance, double{std::numeric_limits<float>::max()}));
}

std::uint32_t most_segments(EffectSet effects, const RenderSettings& settings) {
    const auto any = [&](EffectSet some) { return effects.without(some) != effects; };
    const bool goes_on = any({Effect::specular, Effect::translucent, Effect::smooth_conductor, Effect::boundary});
    const bool receives = any(light_receiving_effects());
    if (goes_on || (receives && settings.integrator != Integrator::whitted)) return settings.bounces + 1;
    // The shadow ray of direct light belongs to the second.
    return receives && effects.has(Effect::light_sampling) ? std::min(2u, settings.bounces + 1) : 1;
}

// Sixteen times as far as the camera, where a triangle has a corner beyond. Points made from such corners lose four
// bits or more of what is seen.
std::optional<float> far_corner(const Scene& described, const SceneData& scene) {
    constexpr double many_times = 16.0;
    const auto size = [](const glm::dvec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); };
    const float limit =
        to_distance(many_times * std::max(size(described.camera.position), size(described.camera.target)));
    const bool any = std::ranges::any_of(
        std::span(scene.sources).first(scene.triangle_count), [&](const gpu::PrimitiveSource& source) {
            const gpu::EntityTransform& m = scene.transforms[source.entity];
            const auto beyond = [&](std::uint32_t vertex) {
                const gpu::Vec4& v = scene.vertices[vertex];
                const auto along = [&](const gpu::Vec4& row) {
                    return row.x * v.x + row.y * v.y + row.z * v.z + row.w;
                };
                return size({along(m.to_world0), along(m.to_world1), along(m.to_world2)}) > limit;
            };
            return beyond(source.index0) || beyond(source.index1) || beyond(source.index2);
        });
    return (any || scene.meshes.reach > double{limit}) && !scene.in_double ? std::optional(limit) : std::nullopt;
}

Specialisation specialise(const Device& device, const Scene& described, const SceneData& scene,
    const RenderSettings& settings, PlantedFault fault) {
    const EffectSet effects = effects_of(described, settings);
    const bool general = effects != needed_effects(described, settings);
    const SceneTrees& trees = scene.trees;
    const bool has_trees = trees.triangles || trees.spheres || trees.cuboids || trees.meshes;
    // Corners that are the same in float may not be in double.
    const bool unrolled = !general && !has_trees && !scene.in_double &&
                          scene.triangle_count + scene.sphere_count + scene.cuboid_count <= most_unrolled;
    const bool fit = scene.triangle_count <= uniform_block_bytes / sizeof(gpu::Triangle) &&
                     std::max(scene.sphere_count, scene.cuboid_count) <= uniform_block_bytes / sizeof(gpu::Convex);
    // Not on a CPU. It gathers lane by lane from uniform blocks, and unrolled loops have their primitives in registers.
    // Mesa 22.3's lavapipe crashes on loops over several of the blocks. In double there are no such blocks.
    const bool from_blocks = device.description().type != DeviceType::cpu && !scene.in_double;
    const auto count = [&](std::uint32_t primitives) { return general ? told_at_run_time : primitives; };
    const bool shares_materials = unrolled && scene.materials.size() <= most_shared_materials;
    return {.effects = fault.bug == PlantedBug::stale_constant ? without_one(effects) : effects,
        .path = path_state(effects, general, scene),
        .few_primitives = fit && from_blocks && !general,
        .unrolled = unrolled ? std::optional(describe_unrolled(scene)) : std::nullopt,
        .triangles = count(scene.triangle_count),
        .spheres = count(scene.sphere_count),
        .cuboids = count(scene.cuboid_count),
        .triangle_root = trees.triangles,
        .sphere_root = trees.spheres,
        .cuboid_root = trees.cuboids,
        .mesh_root = trees.meshes,
        .first_mesh_slot = scene.meshes.first_slot,
        .place_count = scene.meshes.places,
        .ray_min = to_distance(settings.ray_min),
        .ray_max = to_distance(settings.ray_max),
        .planted_bug = fault,
        .intersection = settings.intersection,
        .clamp = std::isfinite(settings.clamp) ? std::optional(static_cast<float>(settings.clamp)) : std::nullopt,
        .filter = settings.filter,
        .generator = settings.generator,
        .mis = settings.mis,
        .light_tree = scene.light_tree,
        .plain_sums = settings.accumulation == Accumulation::plain,
        .lists_pixels = settings.sampling == Sampling::adaptive,
        .unturned = !general && !scene.in_double && is_unturned(scene),
        .far_corner = far_corner(described, scene),
        .faces_coincide = passed_faces_coincide(described),
        .picks_candidates = unrolled && from_blocks,
        .shared_materials = shares_materials ? static_cast<std::uint32_t>(scene.materials.size()) : 0};
}

Specialisation with_patterns(
    Specialisation specialisation, const Device& device, const JobPatterns& patterns, const gpu::Settings& told) {
    const TracerTuning& tuning = patterns.tracer;
    check_workgroup(device, tuning.workgroup);
    if (tuning.pixels == PixelPattern::claimed && tuning.kernel != KernelShape::megakernel)
        throw UnsupportedError("pixels are claimed by the invocations of a megakernel alone");
    specialisation.workgroup = tuning.workgroup;
    specialisation.path.in_half = tuning.half_state;
    if (brings_trees(tuning.kernel)) {  // kernels hardly loop
        specialisation.unrolled.reset();
        specialisation.few_primitives = false;
    }
    specialisation.shared_materials = shared_materials(specialisation, device, tuning);
    specialisation.picks_candidates = picks_candidates(specialisation, tuning.candidates);
    if (patterns.vulkan.parameters == ParameterPattern::specialisation)
        specialisation.parameters = fixed_parameters(told);
    return specialisation;
}

gpu::Settings told_settings(const RenderSettings& settings, const SceneData& scene) {
    gpu::Settings result;
    result.seed = {static_cast<std::uint32_t>(settings.seed), static_cast<std::uint32_t>(settings.seed >> 32)};
    result.width = settings.width;
    result.height = settings.height;
    result.bounces = settings.bounces;
    result.roulette_start = settings.roulette_start;
    result.light_count = static_cast<std::uint32_t>(scene.lights.size());
    result.triangle_count = scene.triangle_count;
    result.sphere_count = scene.sphere_count;
    result.cuboid_count = scene.cuboid_count;
    result.ray_min = to_distance(settings.ray_min);
    result.ray_max = to_distance(settings.ray_max);
    result.direct_only = settings.integrator == Integrator::whitted;
    return result;
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

RenderSettings with_possible_instancing(
    RenderSettings settings, GeometryPrecision precision, std::optional<KernelShape> shape) {
    if (precision != GeometryPrecision::single_precision || (shape && brings_trees(*shape)))
        settings.instancing = Instancing::never;
    return settings;
}

RenderSettings checked_settings(
    const Device& device, const Scene& scene, RenderSettings settings, GeometryPrecision precision, KernelShape shape) {
    settings.accumulation = chosen_accumulation(device, settings, precision);
    check_settings(scene, settings);
    check_kernels(settings.intersection);
    if (brings_trees(shape) && settings.hierarchy != HierarchyQuality::high)
        throw UnsupportedError(
            "the driver builds the hierarchy of kernels that leave traversal to the device; leave --hierarchy-quality "
            "out, or take --kernel stages");
    settings = with_possible_instancing(settings, precision, shape);
    check_buffers(device, scene, settings);
    return settings;
}

Accumulation own_accumulation(const Device& device) {
    const bool can =
        device.features().doubles && !shader_variant(Stage::megakernel, ShaderVariant::double_sums).empty();
    return can ? Accumulation::in_double : Accumulation::compensated;
}

}  // namespace tandem
