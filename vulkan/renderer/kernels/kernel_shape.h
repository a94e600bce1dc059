// Names of kernel shapes, and which is the fastest for a device and scene.
#pragma once

#include <optional>
#include <string>

#include "vulkan/devices.h"
#include "vulkan/renderer/tracer_tuning.h"

namespace tandem {

// The shape of that name; none for an empty one. Throws InputError naming those there are.
[[nodiscard]] std::optional<KernelShape> kernel_shape(const std::string& name);

// Whether the kernels are stages of a ray-tracing pipeline.
[[nodiscard]] constexpr bool has_ray_pipeline(KernelShape shape) {
    return shape == KernelShape::ray_tracing || shape == KernelShape::ray_tracing_triangles;
}

// Whether the device's own test decides which triangles are hit.
[[nodiscard]] constexpr bool has_device_triangles(KernelShape shape) {
    return shape == KernelShape::ray_tracing_triangles || shape == KernelShape::ray_query_triangles;
}

// Whether the device finds hits by an acceleration structure, in place of loops over primitives and trees.
[[nodiscard]] constexpr bool brings_trees(KernelShape shape) {
    return has_ray_pipeline(shape) || has_device_triangles(shape) || shape == KernelShape::ray_query;
}

// Whether an invocation follows paths to their end, with nothing of them in buffers.
[[nodiscard]] constexpr bool traces_whole_paths(KernelShape shape) {
    return shape == KernelShape::megakernel || shape == KernelShape::fragment || brings_trees(shape);
}

// The one that was measured to be the fastest on devices of this type (tests/records/patterns/GUIDELINES.md, family
// `kernels`).
[[nodiscard]] KernelShape fastest_shape(DeviceType device);

}  // namespace tandem
