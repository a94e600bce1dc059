// Boxes in the world around primitives as the device places and intersects them.
#pragma once

#include "common/scene/scene.h"
#include "vulkan/renderer/scene/bvh.h"

namespace tandem {

// Holds every point at which the device's arithmetic can find the primitive from an origin at 0. The shader adds what
// is due to the origin (shaders/geometry/bvh.glsl).
[[nodiscard]] Box world_box(const Scene& scene, const PlacedPrimitive& placed);

}  // namespace tandem
