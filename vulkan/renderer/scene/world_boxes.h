// Boxes in world space around primitives, widened by the rounding of the device's placing and intersection.
#pragma once

#include <span>

#include "common/scene/scene.h"
#include "vulkan/renderer/scene/bvh.h"

namespace tandem {

// Holds every point at which the device's arithmetic can find the primitive from an origin at 0. The shader adds what
// is due to the origin (shaders/geometry/bvh.glsl).
[[nodiscard]] Box world_box(const Scene& scene, const PlacedPrimitive& placed);

// The same around vertices of triangles at rest. greatest: sum of the absolute terms of a coordinate in the world.
struct PointsBox {
    Box box;
    double greatest = 0.0;
};
[[nodiscard]] PointsBox box_of_points(
    const Scene& scene, std::span<const std::uint32_t> indices, const glm::dmat4& object_to_world);

}  // namespace tandem
