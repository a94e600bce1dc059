#include "vulkan/renderer/scene/light_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <utility>

namespace tandem {

namespace {

using Indices = std::span<std::uint32_t>;

struct LightBounds {
    glm::dvec3 low, high;
    void add(const glm::dvec3& a, const glm::dvec3& b) {
        low = glm::min(low, a);
        high = glm::max(high, b);
    }
};

glm::dvec3 middle_of(const LightLeaf& leaf) { return (leaf.low + leaf.high) * 0.5; }

// The directions in which lights face: within an angle of this cosine from the axis.
struct Cone {
    glm::dvec3 axis{0.0};
    double cosine = -1.0;
};

Cone cone_around(std::span<const LightLeaf> leaves, std::span<const std::uint32_t> own) {
    Cone cone;
    glm::dvec3 sum(0.0);
    for (const std::uint32_t i : own) {
        if (leaves[i].axis == glm::dvec3(0.0)) return cone;
        sum += leaves[i].axis;
    }
    const double length = glm::length(sum);
    if (length < static_cast<double>(own.size()) / 1024.0) return cone;
    cone = {sum / length, 1.0};
    for (const std::uint32_t i : own) cone.cosine = std::min(cone.cosine, glm::dot(cone.axis, leaves[i].axis));
    return cone;
}

// Along which axis, and in which order, lights lie (rule 34).
void order_by_place(std::span<const LightLeaf> leaves, Indices own) {
    constexpr double steps = 1048576.0;
    LightBounds middles{middle_of(leaves[own[0]]), middle_of(leaves[own[0]])};
    for (const std::uint32_t i : own) middles.add(middle_of(leaves[i]), middle_of(leaves[i]));
    const glm::dvec3 extent = middles.high - middles.low;
    const double longest = std::max(extent.x, std::max(extent.y, extent.z));
    int axis = 0;
    while (axis < 2 && extent[axis] < longest * (1.0 - 1.0 / steps)) ++axis;
    std::vector<std::pair<double, std::uint32_t>> keys;
    for (const std::uint32_t i : own) {
        const double place = middle_of(leaves[i])[axis] - middles.low[axis];
        keys.emplace_back(extent[axis] > 0.0 ? std::floor(steps * place / extent[axis] + 0.5) : 0.0, i);
    }
    std::ranges::sort(keys);
    std::ranges::transform(keys, own.begin(), [](const auto& key) { return key.second; });
}

void grow(std::span<const LightLeaf> leaves, Indices own, double whole_strength, std::size_t node, LightTree& tree) {
    LightBounds box{leaves[own[0]].low, leaves[own[0]].high};
    double strength = 0.0;
    for (const std::uint32_t i : own) {
        box.add(leaves[i].low, leaves[i].high);
        strength += leaves[i].strength;
    }
    const glm::dvec3 centre = (box.low + box.high) * 0.5;
    const Cone cone = cone_around(leaves, own);
    const std::array<double, floats_per_light_node> numbers{centre.x, centre.y, centre.z,
        0.5 * glm::length(box.high - box.low), cone.axis.x, cone.axis.y, cone.axis.z, cone.cosine,
        strength / whole_strength};
    std::ranges::transform(numbers, tree.nodes.begin() + static_cast<std::ptrdiff_t>(node * floats_per_light_node),
        [](double number) { return static_cast<float>(number); });
    if (own.size() == 1) return;
    order_by_place(leaves, own);
    const std::size_t half = own.size() / 2;
    grow(leaves, own.first(half), whole_strength, node + 1, tree);
    grow(leaves, own.subspan(half), whole_strength, node + 2 * half, tree);
}

}  // namespace

LightTree grow_light_tree(std::span<const LightLeaf> leaves) {
    LightTree tree;
    tree.nodes.resize((2 * leaves.size() - 1) * floats_per_light_node);
    tree.order.resize(leaves.size());
    std::iota(tree.order.begin(), tree.order.end(), 0u);
    double whole = 0.0;
    for (const LightLeaf& leaf : leaves) whole += leaf.strength;
    grow(leaves, tree.order, whole, 0, tree);
    return tree;
}

}  // namespace tandem
