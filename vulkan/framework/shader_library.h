// The SPIR-V of the kernels, embedded when Tandem is built (shaders/CMakeLists.txt writes the definitions).
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace tandem {

// First come the thesis's stages, in the order in which a frame runs them. Then come the kernels of other shapes, the
// last of which are stages of one ray-tracing pipeline. The rest no frame runs by itself: single paths, written down,
// rays of the caller, and the triangle whose fragments are kernels. The last are for rays that meet nothing or a
// device's triangle.
enum class Stage : std::uint32_t {
    pre_process,
    vertex,
    ray_gen,
    intersect,
    scatter,
    post_process,
    megakernel,
    fragment,
    rq_paths,
    rt_paths,
    rt_triangle,
    rt_sphere,
    rt_cuboid,
    rt_nearest,
    rt_asked,
    trace,
    ray_batch,
    ray_batch_double,
    fullscreen,
    rt_closest,
    rt_nothing
};
inline constexpr std::size_t stage_count = 15;  // of frames
inline constexpr std::array<const char*, stage_count> stage_names{"pre-process", "vertex", "ray-gen", "intersect",
    "scatter", "post-process", "megakernel", "fragment", "rq-paths", "rt-paths", "rt-triangle", "rt-sphere",
    "rt-cuboid", "rt-nearest", "rt-asked"};

[[nodiscard]] std::span<const std::uint32_t> shader_code(Stage stage);

// Stages compiled otherwise, as patterns want them (vulkan/patterns.h). Parameters come from elsewhere than push
// constants, or ray state is in arrays of descriptors. Or rays stay at their pixels' places, alone or as the thesis's
// frame has them. With path state in half. With triangles that the device tests. Or for another precision
// (shaders/arithmetic/real.glsl), or with sums in double.
enum class ShaderVariant : std::uint32_t {
    plain,
    uniform,
    storage,
    address,
    specialised,
    arrays,
    arrays_nonuniform,
    in_place,
    half_state,
    thesis,
    thesis_double_sums,
    thesis_uniform,
    thesis_uniform_double_sums,
    mixed,
    in_double,
    double_sums,
    uniform_double_sums,
    storage_double_sums,
    address_double_sums,
    specialised_double_sums,
    device_triangles,
    device_triangles_double_sums
};
inline constexpr auto last_variant = ShaderVariant::device_triangles_double_sums;

// Empty where the stage has no such variant, or this build none at all (those with planted bugs).
[[nodiscard]] std::span<const std::uint32_t> shader_variant(Stage stage, ShaderVariant variant);

// Whether these shaders know planted bugs; the ones that users get do not.
[[nodiscard]] bool shaders_hold_planted_bugs();

}  // namespace tandem
