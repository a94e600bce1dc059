// The oracle's tree of near lights (MODEL.md section 9.2, rules 31 to 39), in double except where rule 35 rounds.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

namespace tandem::oracle {

// Rule 32.
struct LightLeaf {
    glm::dvec3 low{0.0}, high{0.0};
    glm::dvec3 axis{0.0};  // zero: none
    double strength = 0.0;
    std::size_t light = 0;  // whose it is
};

class LightTree {
public:
    explicit LightTree(std::vector<LightLeaf> leaves);  // at least one

    struct Choice {
        std::size_t light;
        double probability;
    };
    // Rule 37 without N. `normal` is zero in a medium.
    [[nodiscard]] Choice choose(const glm::dvec3& point, const glm::dvec3& normal, double number) const;

private:
    struct Node {
        glm::dvec3 centre{0.0}, axis{0.0};
        double radius = 0.0, cone_cosine = -1.0, strength = 0.0;
        std::size_t light = 0;                            // of a leaf
        std::array<std::unique_ptr<Node>, 2> children{};  // none: a leaf
    };
    [[nodiscard]] static std::unique_ptr<Node> node_over(const std::vector<LightLeaf>& leaves, double whole);
    [[nodiscard]] static double importance(const Node& node, const glm::dvec3& point, const glm::dvec3& normal);

    std::unique_ptr<Node> root_;
};

}  // namespace tandem::oracle
