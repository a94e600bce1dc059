// The sampled lights of a scene and how likely each is chosen (MODEL.md section 9.2).
#pragma once

#include <vector>

#include "common/scene/scene.h"
#include "vulkan/renderer/scene/gpu_layout.h"

namespace tandem {

// In the order of that section, the background last if it is to be one; `placed` maps slots to ids.
template <class Real>
[[nodiscard]] std::vector<gpu::LightOf<Real>> make_light_table(
    const Scene& scene, const std::vector<gpu::Placed>& placed, bool background);

extern template std::vector<gpu::Light> make_light_table<float>(const Scene&, const std::vector<gpu::Placed>&, bool);
extern template std::vector<gpu::DoubleLight> make_light_table<double>(
    const Scene&, const std::vector<gpu::Placed>&, bool);

}  // namespace tandem
