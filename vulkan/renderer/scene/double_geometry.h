// A scene's geometry in double, for kernels of DOUBLE_GEOMETRY (shaders/arithmetic/real.glsl).
#pragma once

#include "common/scene/scene.h"
#include "vulkan/renderer/scene/scene_data.h"

namespace tandem {

// In the order of what `flatten` made of the same scene and settings, without what shading alone reads. `from_floats`:
// primitives of vertices and transforms rounded to float, as in single precision.
[[nodiscard]] DoubleGeometry place_in_double(
    const Scene& scene, const RenderSettings& settings, const SceneData& flattened, bool from_floats);

[[nodiscard]] DoubleGeometry::Shading shading_in_double(
    const Scene& scene, const SceneData& flattened, const std::vector<gpu::DoubleLight>& lights);

}  // namespace tandem
