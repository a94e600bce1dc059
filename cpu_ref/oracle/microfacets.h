// The oracle's microfacet distribution (MODEL.md section 7.6), in the frame of n_f.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "cpu_ref/oracle/sampling.h"

namespace tandem::oracle {

struct Microfacets {
    double alpha;

    [[nodiscard]] double density(const glm::dvec3& h) const {
        const double a2 = alpha * alpha, root = 1.0 + h.z * h.z * (a2 - 1.0);
        return a2 / (std::numbers::pi * root * root);
    }
    [[nodiscard]] double lambda(const glm::dvec3& w) const {
        return 0.5 * (std::sqrt(1.0 + alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z)) - 1.0);
    }
    [[nodiscard]] double masking(const glm::dvec3& i) const { return 1.0 / (1.0 + lambda(i)); }
    [[nodiscard]] double masking_shadowing(const glm::dvec3& i, const glm::dvec3& o) const {
        return 1.0 / (1.0 + lambda(i) + lambda(o));
    }
    // [Dupuy 2023]
    [[nodiscard]] glm::dvec3 visible_normal(const glm::dvec3& i, const Numbers& u) const {
        const glm::dvec3 v = glm::normalize(glm::dvec3(alpha * i.x, alpha * i.y, i.z));
        const double z = (1.0 - u.second) * (1.0 + v.z) - v.z, sigma = std::sqrt(std::max(0.0, 1.0 - z * z));
        const glm::dvec3 s = glm::dvec3(sigma * std::cos(two_pi * u.first), sigma * std::sin(two_pi * u.first), z) + v;
        return glm::normalize(glm::dvec3(alpha * s.x, alpha * s.y, s.z));
    }
};

}  // namespace tandem::oracle
