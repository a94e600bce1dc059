// Names of kernel shapes, and which is the fastest where.
#pragma once

#include <optional>
#include <string>

#include "vulkan/devices.h"
#include "vulkan/renderer/tracer_tuning.h"

namespace tandem {

// The shape of that name; none for an empty one. Throws InputError naming those there are.
[[nodiscard]] std::optional<KernelShape> kernel_shape(const std::string& name);

// Whether an invocation follows paths to their end, with nothing of them in buffers.
[[nodiscard]] constexpr bool traces_whole_paths(KernelShape shape) {
    return shape == KernelShape::megakernel || shape == KernelShape::fragment || shape == KernelShape::ray_tracing;
}

// Whether a pipeline finds hits by trees of its own: its kernels have neither loops over primitives nor trees.
[[nodiscard]] constexpr bool brings_trees(KernelShape shape) { return shape == KernelShape::ray_tracing; }

// The one that was measured to be the fastest on devices of this type (tests/records/patterns/GUIDELINES.md, family
// `kernels`).
[[nodiscard]] KernelShape fastest_shape(DeviceType device);

}  // namespace tandem
