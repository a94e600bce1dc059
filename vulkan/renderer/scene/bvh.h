// A bounding volume hierarchy over the primitives of one kind, built on the host and traversed by
// shaders/geometry/bvh.glsl.
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "common/render/renderer.h"
#include "vulkan/renderer/scene/gpu_layout.h"

namespace tandem {

struct Box {
    glm::dvec3 low{0.0}, high{0.0};
};

// No path from a root to a leaf passes more inner nodes: the size of the shader's stack. At least log2 of the number of
// primitives there can be.
inline constexpr std::uint32_t most_bvh_levels = 32;

inline constexpr std::uint32_t bvh_leaf = 0x80000000u;  // a reference to a primitive, in place of a node

// Adds the nodes of a tree over `boxes` (at least one) to `nodes` and returns the reference to its root. That is a
// node's index, or bvh_leaf and the position of the only box. Boxes are rounded outwards. Nodes are parted by the
// surface area heuristic along the best of three axes (high) or along the longest (medium), else in halves (low).
std::uint32_t build_bvh(
    std::span<const Box> boxes, std::vector<gpu::BvhNode>& nodes, HierarchyQuality quality = HierarchyQuality::high);

}  // namespace tandem
