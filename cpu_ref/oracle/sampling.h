// Directions and points from numbers (MODEL.md sections 3 and 3.1), by the standard library's trigonometry.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "common/render/random.h"

namespace tandem::oracle {

inline constexpr double two_pi = 2.0 * std::numbers::pi;

// The four numbers of one dimension block.
struct Numbers {
    double first, second, third, fourth;
};

inline Numbers numbers_of(const RandomBlock& words) {
    return {to_unit<double>(words[0]), to_unit<double>(words[1]), to_unit<double>(words[2]), to_unit<double>(words[3])};
}

inline glm::dvec2 disc(double a, double b) {
    return std::sqrt(a) * glm::dvec2(std::cos(two_pi * b), std::sin(two_pi * b));
}

inline glm::dvec3 unit_sphere(double a, double b) {
    const double rho = 2.0 * std::sqrt(a * (1.0 - a));
    return {rho * std::cos(two_pi * b), rho * std::sin(two_pi * b), 1.0 - 2.0 * a};
}

// The frame of a unit vector.
struct Frame {
    glm::dvec3 tangent, bitangent, normal;

    explicit Frame(const glm::dvec3& n) : tangent(), bitangent(), normal(n) {
        const double sign = n.z >= 0.0 ? 1.0 : -1.0;
        const double p = -1.0 / (sign + n.z), q = n.x * n.y * p;
        tangent = {1.0 + sign * n.x * n.x * p, sign * q, -sign * n.x};
        bitangent = {q, sign + n.y * n.y * p, -n.y};
    }
    [[nodiscard]] glm::dvec3 to_world(const glm::dvec3& local) const {
        return local.x * tangent + local.y * bitangent + local.z * normal;
    }
    [[nodiscard]] glm::dvec3 to_local(const glm::dvec3& v) const {
        return {glm::dot(v, tangent), glm::dot(v, bitangent), glm::dot(v, normal)};
    }
};

inline glm::dvec3 cosine_hemisphere(const glm::dvec3& normal, double a, double b) {
    const glm::dvec2 foot = disc(a, b);
    return glm::normalize(Frame(normal).to_world({foot, std::sqrt(1.0 - a)}));
}

}  // namespace tandem::oracle
