// Boxes (parallelepipeds) whose faces are triangles of the scene: kernels with unrolled loops find by one box which of
// its twelve triangles a ray may meet (shaders/geometry/triangle_boxes.glsl).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "vulkan/renderer/scene/scene_data.h"

namespace tandem {

inline constexpr std::size_t most_triangle_boxes = 2;
inline constexpr std::uint8_t no_triangle = 255;

struct TriangleBox {
    std::array<float, 3> centre = {};  // world
    std::array<float, 9> to_box = {};  // rows: world, less the centre, to the space in which the box is [-1, 1]^3
    float slope = 0, margin = 0;       // what rounding may amount to there: slope * (distance from the centre) + margin
    // Two triangles a face, -x +x -y +y -z +z; no_triangle: the face is open there.
    std::array<std::uint8_t, 12> slots = {};
    std::uint32_t rising = 0;  // bit i: face i is cut from (-1, -1) to (1, 1), its first triangle having (1, -1)
};

// Whether the margin is below a twentieth of every face, a choice of speed alone: hits are the same either way. It is
// not of plates thinner than a few hundredths of their size, nor far from the world's origin: there kernels go by the
// triangles' edges.
[[nodiscard]] bool is_selective(const TriangleBox& box);

// The boxes among at most 32 triangles, at most most_triangle_boxes: sets of triangles that share corners with each
// other and no others, have eight of them in all, lie in the faces and stand still. corners: as in UnrolledPrimitives.
[[nodiscard]] std::vector<TriangleBox> find_triangle_boxes(
    const SceneData& scene, std::span<const std::uint32_t> corners);

}  // namespace tandem
