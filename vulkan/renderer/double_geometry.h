// The world primitives in double, for ray_batch_double.comp.
#pragma once

#include "common/scene.h"
#include "vulkan/renderer/scene_data.h"

namespace tandem {

// By slot, as `flattened` orders them. `from_floats`: of vertices and transforms rounded to float, as in single
// precision.
[[nodiscard]] DoubleGeometry place_in_double(const Scene& scene, const SceneData& flattened, bool from_floats);

}  // namespace tandem
