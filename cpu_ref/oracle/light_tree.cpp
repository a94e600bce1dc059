#include "cpu_ref/oracle/light_tree.h"

#include <algorithm>
#include <cmath>

#include "common/rounding.h"

namespace tandem::oracle {
namespace {

using glm::dvec3;

double whole_strength(const std::vector<LightLeaf>& leaves) {
    double sum = 0.0;
    for (const LightLeaf& leaf : leaves) sum += leaf.strength;
    return sum;
}

// By angles, as rule 36 describes what its formulas compute.
double angle_between(const dvec3& a, const dvec3& unit) { return std::acos(std::clamp(glm::dot(a, unit), -1.0, 1.0)); }

double lifted_cosine(double angle) { return std::max(0.0, std::cos(std::max(0.0, angle)) + 1.0 / 64.0); }

// Rule 34: in two halves.
std::array<std::vector<LightLeaf>, 2> split(std::vector<LightLeaf> leaves) {
    const auto middle = [](const LightLeaf& leaf, int axis) { return 0.5 * (leaf.low[axis] + leaf.high[axis]); };
    dvec3 first(0.0), extent(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        const auto by_middle = [&](const LightLeaf& a, const LightLeaf& b) {
            return middle(a, axis) < middle(b, axis);
        };
        const auto [low, high] = std::minmax_element(leaves.begin(), leaves.end(), by_middle);
        first[axis] = middle(*low, axis);
        extent[axis] = middle(*high, axis) - first[axis];
    }
    const double enough = (1.0 - std::ldexp(1.0, -20)) * std::max({extent.x, extent.y, extent.z});
    int axis = 0;
    while (extent[axis] < enough) ++axis;
    const auto step = [&](const LightLeaf& leaf) {
        const double part = extent[axis] > 0.0 ? (middle(leaf, axis) - first[axis]) / extent[axis] : 0.0;
        return std::floor(std::ldexp(part, 20) + 0.5);
    };
    std::stable_sort(leaves.begin(), leaves.end(), [&](const LightLeaf& a, const LightLeaf& b) {
        return step(a) != step(b) ? step(a) < step(b) : a.light < b.light;
    });
    const auto half = leaves.begin() + static_cast<std::ptrdiff_t>(leaves.size() / 2);
    return {std::vector<LightLeaf>(leaves.begin(), half), std::vector<LightLeaf>(half, leaves.end())};
}

}  // namespace

LightTree::LightTree(std::vector<LightLeaf> leaves) : root_(node_over(leaves, whole_strength(leaves))) {}

std::unique_ptr<LightTree::Node> LightTree::node_over(const std::vector<LightLeaf>& leaves, double whole) {
    auto node = std::make_unique<Node>();
    dvec3 low = leaves[0].low, high = leaves[0].high, sum(0.0);
    for (const LightLeaf& leaf : leaves) {
        low = glm::min(low, leaf.low);
        high = glm::max(high, leaf.high);
        sum += leaf.axis;
    }
    node->centre = rounded_to_single(0.5 * (low + high));
    node->radius = rounded_to_single(0.5 * glm::length(high - low));
    node->strength = rounded_to_single(whole_strength(leaves) / whole);
    const bool all_have = std::ranges::all_of(leaves, [](const LightLeaf& leaf) { return leaf.axis != dvec3(0.0); });
    if (all_have && glm::length(sum) >= std::ldexp(static_cast<double>(leaves.size()), -10)) {
        const dvec3 axis = glm::normalize(sum);
        double cosine = 1.0;
        for (const LightLeaf& leaf : leaves) cosine = std::min(cosine, glm::dot(axis, leaf.axis));
        node->axis = rounded_to_single(axis);
        node->cone_cosine = rounded_to_single(cosine);
    }
    node->light = leaves[0].light;
    if (leaves.size() > 1) {
        const auto halves = split(leaves);
        for (std::size_t i = 0; i < 2; ++i) node->children[i] = node_over(halves[i], whole);
    }
    return node;
}

double LightTree::importance(const Node& node, const dvec3& point, const dvec3& normal) {
    const dvec3 way = node.centre - point;
    const double d = glm::length(way), square = std::pow(std::max(d, node.radius), 2.0);
    if (d <= node.radius) return node.strength * std::pow(lifted_cosine(0.0), 2.0) / square;
    const double ball = std::asin(node.radius / d);
    const double cone = std::acos(std::clamp(node.cone_cosine, -1.0, 1.0));
    const double sent = std::max(0.0, angle_between(-node.axis, way / d) - cone) - ball;
    const double received = normal == dvec3(0.0) ? 0.0 : angle_between(normal, way / d) - ball;
    return node.strength * lifted_cosine(sent) * lifted_cosine(received) / square;
}

LightTree::Choice LightTree::choose(const dvec3& point, const dvec3& normal, double number) const {
    const Node* node = root_.get();
    double probability = 1.0;
    while (node->children[0]) {
        const double a = importance(*node->children[0], point, normal);
        const double b = importance(*node->children[1], point, normal);
        double q = a + b > 0.0 ? a / (a + b) : 0.5;
        if (a > 0.0 && b > 0.0) q = std::clamp(q, std::ldexp(1.0, -10), 1.0 - std::ldexp(1.0, -10));
        const bool first = number < q;
        number = std::min(first ? number / q : (number - q) / (1.0 - q), 1.0 - std::ldexp(1.0, -24));
        probability *= first ? q : 1.0 - q;
        node = node->children[first ? 0 : 1].get();
    }
    return {node->light, probability};
}

}  // namespace tandem::oracle
