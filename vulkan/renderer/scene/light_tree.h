// The tree by which next-event estimation chooses a near light (MODEL.md section 9.2, rules 32 to 35).
// shaders/light/light_tree.glsl reads it.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace tandem {

// Rule 32, in the world. axis: unit, or 0: it sends light to all sides.
struct LightLeaf {
    glm::dvec3 low{0.0}, high{0.0}, axis{0.0};
    double strength = 0.0;
};

inline constexpr std::size_t floats_per_light_node = 9;

// nodes: 2 n - 1 of them for n leaves, floats_per_light_node each. A node has a ball (centre, radius), a cone (axis,
// cosine of the half angle) and its share of the strength. The first child of a node with m leaves is the next node.
// The second is 2 (m / 2) nodes after its parent. `order` says which leaf is where in the tree.
struct LightTree {
    std::vector<float> nodes;
    std::vector<std::uint32_t> order;
};
[[nodiscard]] LightTree grow_light_tree(std::span<const LightLeaf> leaves);  // at least one

}  // namespace tandem
