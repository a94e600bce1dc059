// The sampled lights of a scene and how likely each is chosen (MODEL.md section 9.2).
#pragma once

#include <vector>

#include "common/scene.h"
#include "vulkan/renderer/gpu_layout.h"

namespace tandem {

// In the order of that section, the background last if it is to be one; `placed` maps slots to ids.
[[nodiscard]] std::vector<gpu::Light> make_light_table(
    const Scene& scene, const std::vector<gpu::Placed>& placed, bool background);

}  // namespace tandem
