// The pipelines of the tracer, specialised to the effects that are simulated.
#pragma once

#include <array>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <tuple>

#include "common/render/renderer.h"
#include "vulkan/core/device_selection.h"
#include "vulkan/framework/fullscreen.h"
#include "vulkan/framework/ray_pipeline.h"
#include "vulkan/framework/shader_library.h"
#include "vulkan/renderer/kernels/unrolled_primitives.h"
#include "vulkan/renderer/scene/scene_data.h"
#include "vulkan/renderer/tracer_tuning.h"

namespace tandem {

// What computes positions, and in double precision light as well (MODEL.md section 5.3). For given rays, mixed: given
// in float and answered in float.
enum class GeometryPrecision { single_precision, mixed, double_precision };

// What a path carries from vertex to vertex besides its ray and throughput.
struct PathState {
    bool next_events = false;  // a pending shadow ray and what it would bring
    bool radiance = false;     // it may gather light and go on
    bool interiors = false;    // the bodies that it is in
    bool in_half = false;      // throughput and light in half precision
    bool operator==(const PathState&) const = default;
};

// Everything that the pipelines are specialised to.
struct Specialisation {
    EffectSet effects;
    PathState path;
    bool few_primitives = false;  // each kind's world primitives fit a uniform block, from which they are read
    std::optional<UnrolledPrimitives> unrolled;  // the loops over primitives
    std::uint32_t triangles = 0, spheres = 0, cuboids = 0;
    std::optional<std::uint32_t> triangle_root, sphere_root, cuboid_root;  // of trees in place of loops
    std::optional<std::uint32_t> mesh_root;                                // of the tree over places of meshes
    std::uint32_t first_mesh_slot = 0, place_count = 0;                    // SceneMeshes
    float ray_min = 0, ray_max = 0;
    PlantedFault planted_bug;
    IntersectionSettings intersection;
    bool hands_on_floats = false;  // of geometry in double: mixed precision
    std::optional<float> clamp = std::nullopt;
    PixelFilter filter = PixelFilter::box;
    Generator generator = Generator::philox;
    bool mis = true;
    LightTreePlace light_tree = {};
    bool plain_sums = false;
    bool lists_pixels = false;                       // some dispatches are of lists of pixels
    bool unturned = false;                           // the maps of all spheres and cuboids are diagonal
    std::optional<float> far_corner = std::nullopt;  // triangles beyond have their points made from the ray
    bool faces_coincide = true;                      // passed_faces_coincide
    bool picks_candidates = false;                   // CandidatePattern::edges
    std::uint32_t shared_materials = 0;        // HitDataPattern::shared; 0: buffers, or there is no room for copies
    std::uint32_t workgroup = workgroup_size;  // invocations
    std::vector<SpecialisationConstant> parameters = {};  // ParameterPattern::specialisation's

    [[nodiscard]] std::vector<SpecialisationConstant> constants() const;
};

// The world primitives of each kind are also seen as a uniform block, of the size that every device allows.
inline constexpr std::size_t uniform_views = 3;
inline constexpr std::size_t world_bindings_end = 10;  // of the Scene set, after the world primitives' storage buffers

// Bindings of the Rays set whose buffers have two halves: of the one that is read, and of the one that is written. In
// arrays (DescriptorPattern) the former has both.
inline constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 6> ping_ponged_bindings{
    {{0, 5}, {1, 6}, {2, 7}, {3, 8}, {4, 9}, {14, 15}}};

// Descriptor sets by how often they change [Ferreira 2019]. Settings travel as push constants, or have the fifth set.
enum class SetIndex : std::uint32_t { scene, camera, rays, image, settings };

// What of the patterns and of the tuning is built into kernels and their layouts.
struct KernelForm {
    KernelShape shape = KernelShape::stages;
    ParameterPattern parameters = ParameterPattern::push_constants;
    DescriptorPattern descriptors = DescriptorPattern::per_combination;
    GeometryPrecision precision = GeometryPrecision::single_precision;
    bool sums_in_double = false;  // of a single-precision kernel
    bool half_state = false;      // PathState::in_half

    KernelForm() = default;
    explicit KernelForm(const VulkanPatterns& patterns, KernelShape shape = KernelShape::stages,
        GeometryPrecision precision = GeometryPrecision::single_precision, bool sums_in_double = false,
        bool half_state = false);
    auto operator<=>(const KernelForm&) const = default;
    [[nodiscard]] bool has_arrays() const {
        return descriptors == DescriptorPattern::arrays || descriptors == DescriptorPattern::arrays_nonuniform;
    }
    [[nodiscard]] bool told_by_buffer() const {
        return parameters == ParameterPattern::uniform || parameters == ParameterPattern::dynamic_uniform;
    }
    // The set of the image that the thesis's frame ends in: the last.
    [[nodiscard]] std::uint32_t image_target_set() const {
        return static_cast<std::uint32_t>(SetIndex::settings) + (told_by_buffer() ? 1 : 0);
    }
    // Variant of a stage that has it.
    [[nodiscard]] ShaderVariant variant() const;
    // Variant of a stage that adds samples up in double.
    [[nodiscard]] ShaderVariant summing_variant() const;
};
// The kernels that a shape dispatches for these effects, in the order in which a frame runs them. Without a primitive
// there is none to place, and nothing to meet.
[[nodiscard]] std::vector<Stage> kernels_of(KernelShape shape, EffectSet effects);
// Whether the kernel has no dispatch of its own: the ray-tracing pipeline calls it.
[[nodiscard]] constexpr bool is_called(Stage stage) { return stage > Stage::rt_paths && stage <= Stage::rt_asked; }

// Bindings of a form's sets as kernels declare them: a storage buffer each.
[[nodiscard]] std::vector<SetBindings> separate_bindings(const KernelForm& form);

// What a form's pipeline of a stage is made from, before specialisation. `plain`: the stage has not the form's variant.
// Throws UnsupportedError where this build has no such kernel.
struct KernelCode {
    std::span<const std::uint32_t> words;
    bool plain;
};
[[nodiscard]] KernelCode kernel_code(Stage stage, const KernelForm& form);

// Pipelines are kept per specialisation and form, so that many jobs of one kind build them once. Threads may ask at
// once for layouts, pipelines() and the fullscreen pass. Pipelines of different kinds are then made at once.
class Stages {
public:
    struct Pipelines {
        std::vector<vk::raii::Pipeline> stages;  // by Stage; null: not one of the shape's, or a part of
        std::optional<RayPipeline> rays;
        std::vector<bool> plain;  // by Stage: it has not the form's variant and is told by push constants
        double seconds = 0.0;     // that making them took
    };

    // `contracted`: drivers may fuse products and sums.
    explicit Stages(const Device& device, bool contracted = false);

    [[nodiscard]] const PipelineLayout& layout() const { return layout_; }
    // Throw UnsupportedError where the device lacks what the form needs.
    [[nodiscard]] const PipelineLayout& layout(const KernelForm& form);
    [[nodiscard]] std::shared_ptr<const Pipelines> pipelines(
        const Specialisation& specialisation, const KernelForm& form);
    [[nodiscard]] const FullscreenPass& fullscreen_pass();
    // A kernel's code as the device is handed it, before specialisation.
    [[nodiscard]] std::vector<std::uint32_t> prepared(std::span<const std::uint32_t> code) const;
    // Throws UnsupportedError where this build has no such variant of the stage.
    [[nodiscard]] vk::raii::Pipeline make(Stage stage, const std::vector<SpecialisationConstant>& constants,
        ShaderVariant variant = ShaderVariant::plain) const;

    struct RayPipelines {
        vk::raii::Pipeline vertex, ray_batch;
    };
    [[nodiscard]] std::shared_ptr<const RayPipelines> ray_pipelines(const Specialisation& specialisation);
    // Without a vertex stage: the host places what is held in double.
    [[nodiscard]] std::shared_ptr<const RayPipelines> double_ray_pipelines(const Specialisation& specialisation);

    // They trace single paths, vertex by vertex. `places`: with a vertex stage, where it has primitives to place.
    struct PathPipelines {
        vk::raii::Pipeline vertex, trace;
    };
    [[nodiscard]] std::shared_ptr<const PathPipelines> path_pipelines(
        const Specialisation& specialisation, ShaderVariant variant, bool places);

private:
    [[nodiscard]] std::vector<std::uint32_t> handed_over(
        std::span<const std::uint32_t> code, const std::vector<SpecialisationConstant>& constants) const;
    [[nodiscard]] vk::raii::Pipeline make(const PipelineLayout& layout, std::span<const std::uint32_t> code,
        const std::vector<SpecialisationConstant>& constants) const;

    [[nodiscard]] std::shared_ptr<const Pipelines> make_pipelines(
        const Specialisation& specialisation, const KernelForm& form);
    [[nodiscard]] vk::raii::Pipeline make_fragment(const PipelineLayout& layout, std::span<const std::uint32_t> code,
        const std::vector<SpecialisationConstant>& constants);
    [[nodiscard]] RayPipeline make_rays(const KernelForm& form, const PipelineLayout& layout,
        const std::vector<SpecialisationConstant>& constants) const;

    [[nodiscard]] std::vector<SetBindings> bindings_of(const KernelForm& form) const;

    const Device& device_;
    bool merged_;            // storage buffers of a set are parts of one
    PipelineLayout layout_;  // of forms that need no other
    bool contracted_;
    std::mutex mutex_;  // of what is kept
    bool trims_;  // kernels are trimmed for a driver that compiles on the CPU: bench's family pipelines has the gain
    std::map<KernelForm, PipelineLayout> layouts_;
    std::optional<FullscreenPass> pass_;  // made when a job renders by fragments
    std::map<std::pair<KernelForm, std::vector<std::uint32_t>>, std::shared_future<std::shared_ptr<const Pipelines>>>
        pipelines_;
    std::map<std::vector<std::uint32_t>, std::shared_ptr<const RayPipelines>> ray_pipelines_, double_ray_pipelines_;
    std::map<std::tuple<ShaderVariant, bool, std::vector<std::uint32_t>>, std::shared_ptr<const PathPipelines>>
        path_pipelines_;
};

}  // namespace tandem
