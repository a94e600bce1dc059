#include "vulkan/renderer/kernels/stages.h"

#include <algorithm>
#include <array>
#include <exception>
#include <utility>

#include "common/error.h"
#include "common/stopwatch.h"
#include "vulkan/core/device_selection.h"
#include "vulkan/framework/spirv_decorations.h"
#include "vulkan/framework/spirv_merging.h"
#include "vulkan/framework/spirv_optimizer.h"
#include "vulkan/renderer/kernels/constant_ids.h"
#include "vulkan/renderer/kernels/kernel_shape.h"

namespace tandem {

static_assert(sizeof(gpu::Settings) == settings_bytes);

std::vector<SpecialisationConstant> Specialisation::constants() const {
    using Id = ConstantId;
    const UnrolledPrimitives told = unrolled.value_or(UnrolledPrimitives{});
    const bool passes_surfaces = effects.has(Effect::translucent) || effects.has(Effect::boundary);
    std::vector<SpecialisationConstant> result{
        constant(Id::workgroup, workgroup),
        constant(Id::effects_low, effects.bits() & 0xffffffffu),
        constant(Id::effects_high, effects.bits() >> 32),
        constant(Id::carries_radiance, path.radiance),
        constant(Id::few_primitives, few_primitives),
        constant(Id::unrolled, unrolled.has_value()),
        constant(Id::fixed_triangles, triangles),
        constant(Id::fixed_spheres, spheres),
        constant(Id::fixed_cuboids, cuboids),
        constant(Id::triangle_tree, triangle_root.has_value()),
        constant(Id::sphere_tree, sphere_root.has_value()),
        constant(Id::cuboid_tree, cuboid_root.has_value()),
        constant(Id::triangle_root, triangle_root.value_or(0)),
        constant(Id::sphere_root, sphere_root.value_or(0)),
        constant(Id::cuboid_root, cuboid_root.value_or(0)),
        constant(Id::mesh_tree, mesh_root.has_value()),
        constant(Id::mesh_root, mesh_root.value_or(0)),
        constant(Id::first_mesh_slot, first_mesh_slot),
        constant(Id::place_count, place_count),
        constant(Id::ray_min, ray_min),
        constant(Id::ray_max, ray_max),
        constant(Id::triangle_kernel, intersection.triangles),
        constant(Id::convex_kernel, intersection.convex),
        constant(Id::guard, intersection.guard),
        constant(Id::guard_epsilon, static_cast<float>(intersection.epsilon)),
        constant(Id::hands_on_floats, hands_on_floats),
        constant(Id::aligned_cuboids, told.aligned_cuboids),
        constant(Id::unturned, unturned),
        constant(Id::has_far_corners, far_corner.has_value()),
        constant(Id::far_corner, far_corner.value_or(0.0F)),
        constant(Id::has_crossing, faces_coincide && passes_surfaces),
        constant(Id::shared_materials, shared_materials),
        constant(Id::picks_candidates, picks_candidates),
        constant(Id::clamps, clamp.has_value()),
        constant(Id::clamp_at, clamp.value_or(0.0F)),
        constant(Id::generator, generator),
        constant(Id::pixel_filter, filter),
        constant(Id::has_mis, mis),
        constant(Id::light_tree_leaves, light_tree.leaves),
        constant(Id::light_tree_first, light_tree.first),
        constant(Id::plain_sums, plain_sums),
        constant(Id::lists_pixels, lists_pixels),
    };
    for (std::uint32_t i = 0; i < told.corners.size(); ++i) result.push_back(corners_constant(i, told.corners[i]));
    if (shaders_hold_planted_bugs()) {
        result.push_back(constant(Id::planted_amount, static_cast<float>(planted_bug.amount)));
        result.push_back(constant(Id::planted_bug, planted_bug.bug));
    }
    result.insert(result.end(), parameters.begin(), parameters.end());
    return result;
}

KernelForm::KernelForm(
    const VulkanPatterns& patterns, KernelShape chosen_shape, GeometryPrecision chosen, bool in_double, bool in_half)
    : shape(chosen_shape),
      parameters(patterns.parameters),
      descriptors(patterns.descriptors),
      precision(chosen),
      sums_in_double(in_double),
      half_state(in_half) {
    // What differs in the host's doing alone.
    if (descriptors == DescriptorPattern::rewritten || descriptors == DescriptorPattern::templates)
        descriptors = DescriptorPattern::per_combination;
}

ShaderVariant KernelForm::variant() const {
    if (precision == GeometryPrecision::mixed) return ShaderVariant::mixed;
    if (precision == GeometryPrecision::double_precision) return ShaderVariant::in_double;
    if (half_state) return ShaderVariant::half_state;
    if (shape == KernelShape::image_stages) return ShaderVariant::in_place;
    if (has_device_triangles(shape)) return ShaderVariant::device_triangles;
    if (shape == KernelShape::thesis) return told_by_buffer() ? ShaderVariant::thesis_uniform : ShaderVariant::thesis;
    if (descriptors == DescriptorPattern::arrays) return ShaderVariant::arrays;
    if (descriptors == DescriptorPattern::arrays_nonuniform) return ShaderVariant::arrays_nonuniform;
    switch (parameters) {
        case ParameterPattern::push_constants:
            break;
        case ParameterPattern::uniform:
        case ParameterPattern::dynamic_uniform:
            return ShaderVariant::uniform;
        case ParameterPattern::storage:
            return ShaderVariant::storage;
        case ParameterPattern::device_address:
            return ShaderVariant::address;
        case ParameterPattern::specialisation:
            return ShaderVariant::specialised;
    }
    return ShaderVariant::plain;
}

ShaderVariant KernelForm::summing_variant() const {
    if (shape == KernelShape::thesis)
        return told_by_buffer() ? ShaderVariant::thesis_uniform_double_sums : ShaderVariant::thesis_double_sums;
    if (has_device_triangles(shape)) return ShaderVariant::device_triangles_double_sums;
    switch (parameters) {
        case ParameterPattern::push_constants:
            break;
        case ParameterPattern::uniform:
        case ParameterPattern::dynamic_uniform:
            return ShaderVariant::uniform_double_sums;
        case ParameterPattern::storage:
            return ShaderVariant::storage_double_sums;
        case ParameterPattern::device_address:
            return ShaderVariant::address_double_sums;
        case ParameterPattern::specialisation:
            return ShaderVariant::specialised_double_sums;
    }
    return ShaderVariant::double_sums;
}

std::vector<SetBindings> separate_bindings(const KernelForm& form) {
    using Type = vk::DescriptorType;
    SetBindings scene(world_bindings_end, Type::eStorageBuffer);
    scene[0] = Type::eUniformBuffer;
    scene.insert(scene.end(), uniform_views, Type::eUniformBuffer);
    scene.insert(scene.end(), 4, Type::eStorageBuffer);  // nodes of trees, textures, tables, media
    SetBindings rays(storage_buffers_in_ray_set, Type::eStorageBuffer);
    if (form.has_arrays())
        for (const auto& [read, written] : ping_ponged_bindings) {
            rays[read].count = 2;
            rays[written].count = 0;
        }
    std::vector<SetBindings> sets{
        scene, {Type::eUniformBuffer}, rays, SetBindings(storage_buffers_in_image_set, Type::eStorageBuffer)};
    if (form.parameters == ParameterPattern::uniform) sets.push_back({Type::eUniformBuffer});
    if (form.parameters == ParameterPattern::dynamic_uniform) sets.push_back({Type::eUniformBufferDynamic});
    if (form.parameters == ParameterPattern::storage) sets.push_back({Type::eStorageBuffer});
    if (brings_trees(form.shape)) sets.push_back({Type::eAccelerationStructureKHR});
    if (form.shape == KernelShape::thesis) sets.push_back({Type::eStorageImage});
    return sets;
}

namespace {

std::uint32_t most_push_descriptors(const Device& device) {
    const auto chain =
        device.physical()
            .getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDevicePushDescriptorPropertiesKHR>();
    return chain.get<vk::PhysicalDevicePushDescriptorPropertiesKHR>().maxPushDescriptors;
}

void check(const Device& device, const KernelForm& form, const std::vector<SetBindings>& sets) {
    const std::string& name = device.description().name;
    const DeviceFeatures& has = device.features();
    if (has_ray_pipeline(form.shape) && !has.ray_tracing)
        throw UnsupportedError(name + " has no VK_KHR_ray_tracing_pipeline");
    if (brings_trees(form.shape) && !has_ray_pipeline(form.shape) && !has.ray_queries)
        throw UnsupportedError(name + " has no VK_KHR_ray_query");
    if (form.parameters == ParameterPattern::device_address && !has.buffer_addresses)
        throw UnsupportedError(name + " has no buffer addresses (bufferDeviceAddress)");
    if (form.descriptors == DescriptorPattern::push && !has.push_descriptors)
        throw UnsupportedError(name + " has no VK_KHR_push_descriptor");
    if (form.descriptors == DescriptorPattern::push &&
        most_push_descriptors(device) < sets[static_cast<std::size_t>(SetIndex::rays)].size())
        throw UnsupportedError(name + " pushes too few descriptors at a time");
    if (form.has_arrays() && !has.storage_arrays)
        throw UnsupportedError(
            name + " does not index arrays of storage buffers (shaderStorageBufferArrayDynamicIndexing)");
    if (form.descriptors == DescriptorPattern::arrays_nonuniform && !has.storage_arrays_nonuniform)
        throw UnsupportedError(name +
                               " does not index arrays of storage buffers by what differs between invocations "
                               "(shaderStorageBufferArrayNonUniformIndexing)");
    if (sets.size() > device.limits().maxBoundDescriptorSets)
        throw UnsupportedError(name + " binds no more than " + std::to_string(device.limits().maxBoundDescriptorSets) +
                               " descriptor sets");
    if (storage_buffers(sets) > device.limits().maxPerStageDescriptorStorageBuffers)
        throw UnsupportedError(name + " lets a stage see " +
                               std::to_string(device.limits().maxPerStageDescriptorStorageBuffers) +
                               " storage buffers, this takes " + std::to_string(storage_buffers(sets)));
    if (form.precision != GeometryPrecision::single_precision && form.shape != KernelShape::megakernel)
        throw UnsupportedError(
            "paths in mixed and double precision are traced by the megakernel alone: the stages hand rays on in float; "
            "leave --kernel out");
    if (form.half_state && form.shape != KernelShape::stages)
        throw UnsupportedError(
            "the kernels of --kernel stages alone keep path state between them in half; leave --kernel out");
    if (form.sums_in_double && !has.doubles)
        throw UnsupportedError(name + " has no doubles in shaders (shaderFloat64); use --accumulation compensated");
    const bool default_parameters = form.parameters == ParameterPattern::push_constants ||
                                    (form.shape == KernelShape::thesis && form.told_by_buffer());
    const bool default_form = default_parameters && form.descriptors == DescriptorPattern::per_combination;
    if (form.shape != KernelShape::stages && !default_form)
        throw UnsupportedError(
            "patterns of parameters and descriptors are made for the wavefront of six stages alone, those of uniform "
            "buffers for the thesis's frame too");
    if (form.shape == KernelShape::thesis && !has.stores_any_format)
        throw UnsupportedError(name + " does not write to images of any format (shaderStorageImageWriteWithoutFormat)");
    const bool varied_parameters = form.parameters != ParameterPattern::push_constants,
               varied_descriptors = form.descriptors != DescriptorPattern::per_combination;
    if (form.half_state && !default_form)
        throw UnsupportedError("patterns of parameters and descriptors are varied with path state in single alone");
    if (form.variant() != ShaderVariant::plain && varied_parameters && varied_descriptors)
        throw UnsupportedError("patterns of parameters and of descriptors are varied one at a time");
}

std::vector<std::uint32_t> key_of(const std::vector<SpecialisationConstant>& constants) {
    std::vector<std::uint32_t> key;
    for (const SpecialisationConstant& constant : constants) key.push_back(constant.value);
    return key;
}

}  // namespace

Stages::Stages(const Device& device, bool contracted)
    : device_(device),
      merged_(merges_storage_buffers(device.description().abilities)),
      layout_(device, bindings_of({}), settings_bytes),
      contracted_(contracted),
      trims_(device.description().type == DeviceType::cpu) {}

// Arrays of storage buffers stay arrays.
std::vector<SetBindings> Stages::bindings_of(const KernelForm& form) const {
    std::vector<SetBindings> sets = separate_bindings(form);
    if (merged_ && !form.has_arrays())
        for (SetBindings& set : sets) set = merged(set);
    return sets;
}

const PipelineLayout& Stages::layout(const KernelForm& form) {
    const std::vector<SetBindings> sets = bindings_of(form);
    check(device_, form, sets);
    const bool pushed = form.descriptors == DescriptorPattern::push;
    using Bit = vk::ShaderStageFlagBits;
    vk::ShaderStageFlags visible = Bit::eCompute;
    if (form.shape == KernelShape::fragment) visible |= Bit::eFragment;
    if (has_ray_pipeline(form.shape)) visible |= Bit::eRaygenKHR | Bit::eIntersectionKHR | Bit::eAnyHitKHR;
    if (visible == Bit::eCompute && !pushed && !form.has_arrays() && sets.size() == separate_bindings({}).size())
        return layout_;
    const std::lock_guard lock(mutex_);
    return layouts_
        .try_emplace(form, device_, sets, settings_bytes,
            pushed ? static_cast<std::size_t>(SetIndex::rays) : PipelineLayout::no_set, visible)
        .first->second;
}

std::vector<std::uint32_t> Stages::prepared(std::span<const std::uint32_t> code) const {
    std::vector<std::uint32_t> words(code.begin(), code.end());
    if (contracted_) words = without_no_contraction(words);
    if (merged_) words = with_merged_buffers(words, separate_bindings({}));
    return words;
}

std::vector<std::uint32_t> Stages::handed_over(
    std::span<const std::uint32_t> code, const std::vector<SpecialisationConstant>& constants) const {
    // Words: trimming a smaller kernel takes longer than it saves (bench's family pipelines).
    constexpr std::size_t large = 1u << 14;
    const std::vector<std::uint32_t> words = prepared(code);
    return trims_ && words.size() > large ? trimmed_spirv(words, constants) : words;
}

vk::raii::Pipeline Stages::make(const PipelineLayout& layout, std::span<const std::uint32_t> code,
    const std::vector<SpecialisationConstant>& constants) const {
    return make_compute_pipeline(device_, nullptr, layout.handle(), handed_over(code, constants), constants);
}

const FullscreenPass& Stages::fullscreen_pass() {
    const std::lock_guard lock(mutex_);
    if (!pass_) pass_.emplace(device_);
    return *pass_;
}

vk::raii::Pipeline Stages::make_fragment(const PipelineLayout& layout, std::span<const std::uint32_t> code,
    const std::vector<SpecialisationConstant>& constants) {
    return fullscreen_pass().make_pipeline(
        layout.handle(), shader_code(Stage::fullscreen), handed_over(code, constants), constants);
}

RayPipeline Stages::make_rays(
    const KernelForm& form, const PipelineLayout& layout, const std::vector<SpecialisationConstant>& constants) const {
    const std::vector<std::uint32_t> paths = prepared(kernel_code(Stage::rt_paths, form).words),
                                     triangle = prepared(shader_code(Stage::rt_triangle)),
                                     sphere = prepared(shader_code(Stage::rt_sphere)),
                                     cuboid = prepared(shader_code(Stage::rt_cuboid)),
                                     nearest = prepared(shader_code(Stage::rt_nearest)),
                                     asked = prepared(shader_code(Stage::rt_asked));
    RayPipeline::Code code{paths, shader_code(Stage::rt_nothing), {triangle, sphere, cuboid}, nearest};
    if (has_device_triangles(form.shape)) {
        code.triangle_any_hit = asked;
        code.triangle_closest_hit = shader_code(Stage::rt_closest);
    }
    return RayPipeline(device_, layout.handle(), code, constants);
}

vk::raii::Pipeline Stages::make(
    Stage stage, const std::vector<SpecialisationConstant>& constants, ShaderVariant variant) const {
    if (variant == ShaderVariant::plain) return make(layout_, shader_code(stage), constants);
    const std::span<const std::uint32_t> code = shader_variant(stage, variant);
    if (code.empty()) throw UnsupportedError("this build has no such variant of the kernel");
    return make(layout_, code, constants);
}

std::shared_ptr<const Stages::RayPipelines> Stages::ray_pipelines(const Specialisation& specialisation) {
    const std::vector<SpecialisationConstant> constants = specialisation.constants();
    std::shared_ptr<const RayPipelines>& kept = ray_pipelines_[key_of(constants)];
    if (!kept)
        kept = std::make_shared<const RayPipelines>(
            RayPipelines{make(Stage::vertex, constants), make(Stage::ray_batch, constants)});
    return kept;
}

std::shared_ptr<const Stages::RayPipelines> Stages::double_ray_pipelines(const Specialisation& specialisation) {
    const std::vector<SpecialisationConstant> constants = specialisation.constants();
    std::shared_ptr<const RayPipelines>& kept = double_ray_pipelines_[key_of(constants)];
    if (!kept)
        kept = std::make_shared<const RayPipelines>(RayPipelines{nullptr, make(Stage::ray_batch_double, constants)});
    return kept;
}

std::shared_ptr<const Stages::PathPipelines> Stages::path_pipelines(
    const Specialisation& specialisation, ShaderVariant variant, bool places) {
    const std::vector<SpecialisationConstant> constants = specialisation.constants();
    std::shared_ptr<const PathPipelines>& kept = path_pipelines_[{variant, places, key_of(constants)}];
    if (!kept)
        kept = std::make_shared<const PathPipelines>(
            PathPipelines{places ? make(Stage::vertex, constants) : nullptr, make(Stage::trace, constants, variant)});
    return kept;
}

std::vector<Stage> kernels_of(KernelShape shape, EffectSet effects) {
    const bool primitives =
        effects.has(Effect::triangles) || effects.has(Effect::spheres) || effects.has(Effect::cuboids);
    std::vector<Stage> kernels;
    if (shape == KernelShape::megakernel)
        kernels = {Stage::vertex, Stage::megakernel};
    else if (shape == KernelShape::fragment)
        kernels = {Stage::vertex, Stage::fragment};
    else if (has_ray_pipeline(shape))
        kernels = {
            Stage::vertex, Stage::rt_paths, Stage::rt_triangle, Stage::rt_sphere, Stage::rt_cuboid, Stage::rt_nearest};
    else if (brings_trees(shape))
        kernels = {Stage::vertex, Stage::rq_paths};
    else
        kernels = {
            Stage::pre_process, Stage::vertex, Stage::ray_gen, Stage::intersect, Stage::scatter, Stage::post_process};
    if (shape == KernelShape::ray_tracing_triangles) kernels.push_back(Stage::rt_asked);
    if (!primitives) std::erase(kernels, Stage::vertex);
    // The stage also tells what has become of shadow rays, and which places of an image are still taken.
    if (!primitives && !effects.has(Effect::light_sampling) && shape == KernelShape::stages)
        std::erase(kernels, Stage::intersect);
    return kernels;
}

KernelCode kernel_code(Stage stage, const KernelForm& form) {
    constexpr std::array adding_up{
        Stage::post_process, Stage::megakernel, Stage::fragment, Stage::rq_paths, Stage::rt_paths};
    const bool adds_up = std::ranges::find(adding_up, stage) != adding_up.end() ||
                         (form.shape == KernelShape::thesis && stage == Stage::scatter);
    if (form.sums_in_double && adds_up) {
        const std::span<const std::uint32_t> code = shader_variant(stage, form.summing_variant());
        if (code.empty()) throw UnsupportedError("this build has no such kernels with sums in double");
        return {code, form.summing_variant() == ShaderVariant::double_sums};
    }
    const std::span<const std::uint32_t> code = shader_variant(stage, form.variant());
    const bool plain = code.empty();
    return {plain ? shader_code(stage) : code, plain};
}

// Who asks first makes them; others wait for it. What could not be made is tried anew.
std::shared_ptr<const Stages::Pipelines> Stages::pipelines(
    const Specialisation& specialisation, const KernelForm& form) {
    const std::pair key{form, key_of(specialisation.constants())};
    std::promise<std::shared_ptr<const Pipelines>> making;
    std::unique_lock lock(mutex_);
    const auto [place, first] = pipelines_.try_emplace(key);
    if (first) place->second = making.get_future().share();
    const std::shared_future<std::shared_ptr<const Pipelines>> kept = place->second;
    lock.unlock();
    if (!first) return kept.get();
    try {
        making.set_value(make_pipelines(specialisation, form));
    } catch (...) {
        making.set_exception(std::current_exception());
        lock.lock();
        pipelines_.erase(key);
    }
    return kept.get();
}

std::shared_ptr<const Stages::Pipelines> Stages::make_pipelines(
    const Specialisation& specialisation, const KernelForm& form) {
    const std::vector<SpecialisationConstant> constants = specialisation.constants();
    const PipelineLayout& form_layout = layout(form);
    const Stopwatch watch;
    Pipelines made;
    made.plain.resize(stage_count);
    for (std::size_t stage = 0; stage < stage_count; ++stage) made.stages.emplace_back(nullptr);
    bool any_variant = false;
    for (const Stage stage : kernels_of(form.shape, specialisation.effects)) {
        if (is_called(stage)) continue;
        if (stage == Stage::rt_paths) {
            made.rays.emplace(make_rays(form, form_layout, constants));
            any_variant = any_variant || !kernel_code(stage, form).plain;
            continue;
        }
        const auto i = static_cast<std::size_t>(stage);
        // What is held in double the host places.
        if (stage == Stage::vertex && form.precision != GeometryPrecision::single_precision) continue;
        const KernelCode code = kernel_code(stage, form);
        any_variant = any_variant || !code.plain;
        made.plain[i] = code.plain;
        made.stages[i] = stage == Stage::fragment ? make_fragment(form_layout, code.words, constants)
                                                  : make(form_layout, code.words, constants);
    }
    if (form.variant() != ShaderVariant::plain && !any_variant)
        throw UnsupportedError("this build has no kernels for the pattern or the precision");
    made.seconds = watch.seconds();
    return std::make_shared<const Pipelines>(std::move(made));
}

}  // namespace tandem
