#include "vulkan/renderer/stages.h"

#include <bit>
#include <chrono>
#include <utility>

#include "vulkan/core/device_selection.h"
#include "vulkan/framework/spirv_decorations.h"

namespace tandem {

std::vector<SpecialisationConstant> Specialisation::constants() const {
    // Ids of shaders/settings.glsl; 0 is the workgroup's size.
    const std::array<std::uint32_t, 22> values{workgroup_size, static_cast<std::uint32_t>(effects.bits()),
        static_cast<std::uint32_t>(effects.bits() >> 32), path.radiance, few_primitives, unrolled, triangles, spheres,
        cuboids, triangle_root.has_value(), sphere_root.has_value(), cuboid_root.has_value(), triangle_root.value_or(0),
        sphere_root.value_or(0), cuboid_root.value_or(0), std::bit_cast<std::uint32_t>(ray_min),
        std::bit_cast<std::uint32_t>(ray_max), static_cast<std::uint32_t>(intersection.triangles),
        static_cast<std::uint32_t>(intersection.convex), static_cast<std::uint32_t>(intersection.guard),
        std::bit_cast<std::uint32_t>(static_cast<float>(intersection.epsilon)), hands_on_floats};
    std::vector<SpecialisationConstant> result;
    for (std::uint32_t id = 0; id < values.size(); ++id) result.push_back({id, values[id]});
    if (shaders_hold_planted_bugs()) {
        result.push_back({30, std::bit_cast<std::uint32_t>(static_cast<float>(planted_bug.amount))});
        result.push_back({31, static_cast<std::uint32_t>(planted_bug.bug)});
    }
    return result;
}

const std::array<SetBindings, 4>& set_bindings() {
    using Type = vk::DescriptorType;
    static const std::array<SetBindings, 4> sets = [] {
        SetBindings scene(world_bindings_end, Type::eStorageBuffer);
        scene[0] = Type::eUniformBuffer;
        scene.insert(scene.end(), uniform_views, Type::eUniformBuffer);
        scene.insert(scene.end(), 4, Type::eStorageBuffer);  // nodes of trees, textures, tables, media
        return std::array<SetBindings, 4>{scene, SetBindings{Type::eUniformBuffer},
            SetBindings(storage_buffers_in_ray_set, Type::eStorageBuffer),
            SetBindings(storage_buffers_in_image_set, Type::eStorageBuffer)};
    }();
    return sets;
}

Stages::Stages(const Device& device, bool contracted)
    : device_(device), layout_(device, set_bindings(), sizeof(gpu::Settings)), contracted_(contracted) {}

namespace {

std::vector<std::uint32_t> key_of(const std::vector<SpecialisationConstant>& constants) {
    std::vector<std::uint32_t> key;
    for (const SpecialisationConstant& constant : constants) key.push_back(constant.value);
    return key;
}

}  // namespace

vk::raii::Pipeline Stages::make(Stage stage, const std::vector<SpecialisationConstant>& constants) const {
    const auto build = [&](std::span<const std::uint32_t> code) {
        return make_compute_pipeline(device_, nullptr, layout_.handle(), code, constants);
    };
    return contracted_ ? build(without_no_contraction(shader_code(stage))) : build(shader_code(stage));
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

std::vector<Stage> kernels_of(KernelShape shape) {
    if (shape == KernelShape::megakernel) return {Stage::vertex, Stage::megakernel};
    return {Stage::pre_process, Stage::vertex, Stage::ray_gen, Stage::intersect, Stage::scatter, Stage::post_process};
}

std::shared_ptr<const Stages::Pipelines> Stages::pipelines(const Specialisation& specialisation, KernelShape shape) {
    const std::vector<SpecialisationConstant> constants = specialisation.constants();
    std::vector<std::uint32_t> key = key_of(constants);
    key.push_back(static_cast<std::uint32_t>(shape));
    std::shared_ptr<const Pipelines>& kept = pipelines_[key];
    if (!kept) {
        const auto start = std::chrono::steady_clock::now();
        std::vector<vk::raii::Pipeline> made;
        for (std::size_t stage = 0; stage < stage_count; ++stage) made.emplace_back(nullptr);
        for (const Stage stage : kernels_of(shape)) made[static_cast<std::size_t>(stage)] = make(stage, constants);
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
        kept = std::make_shared<const Pipelines>(Pipelines{std::move(made), taken.count()});
    }
    return kept;
}

}  // namespace tandem
