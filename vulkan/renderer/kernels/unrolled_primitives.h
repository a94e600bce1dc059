// The constants from which kernels with unrolled loops over primitives are built (shaders/kernels/settings.glsl).
#pragma once

#include <array>
#include <cstdint>

#include "vulkan/renderer/scene/scene_data.h"

namespace tandem {

inline constexpr std::uint32_t most_unrolled = 32;  // primitives: each further one lengthens the compilation

struct UnrolledPrimitives {
    std::uint32_t aligned_cuboids = 0;                      // bit i: cuboid i's faces are square to the world's axes
    std::array<std::uint32_t, most_unrolled> corners = {};  // three bytes a triangle: the first corner of that place
};

// Whether the maps between the world and the unit shape of every sphere and cuboid are diagonal. Kernels made for the
// scene then leave out what is zero.
[[nodiscard]] bool is_unturned(const SceneData& scene);

// At most most_unrolled primitives. Corners are the same that one entity places from equal vertices.
[[nodiscard]] UnrolledPrimitives describe_unrolled(const SceneData& scene);

}  // namespace tandem
