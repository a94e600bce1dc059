// The sampled lights of a scene and how likely each is chosen (MODEL.md section 9.2).
#pragma once

#include <vector>

#include "common/render/renderer.h"
#include "common/scene/scene.h"
#include "vulkan/renderer/scene/gpu_layout.h"

namespace tandem {

// lights: in the order of that section, the background last if it is to be one. With a tree, near lights are in the
// order of its leaves, and the probability of each is the share of all near lights. The tree_nodes are those of
// light_tree.h. They are empty without a tree, which needs two near lights.
template <class Real>
struct LightTable {
    std::vector<gpu::LightOf<Real>> lights;
    std::vector<float> tree_nodes;
    std::uint32_t tree_leaves = 0;
};

// `placed` maps slots to ids.
template <class Real>
[[nodiscard]] LightTable<Real> make_light_table(
    const Scene& scene, const std::vector<gpu::Placed>& placed, bool background, LightSampling sampling);

extern template LightTable<float> make_light_table<float>(
    const Scene&, const std::vector<gpu::Placed>&, bool, LightSampling);
extern template LightTable<double> make_light_table<double>(
    const Scene&, const std::vector<gpu::Placed>&, bool, LightSampling);

}  // namespace tandem
