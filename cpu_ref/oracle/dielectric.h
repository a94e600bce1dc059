// The oracle's dielectric interfaces (MODEL.md section 7.4).
#pragma once

#include <cmath>
#include <glm/glm.hpp>

#include "common/scene/scene.h"

namespace tandem::oracle {

// The reflectance, and the refracted direction unless all is reflected. `cosine` is that of the direction
// and the normal that it is refracted at, the surface's own or a facet's.
struct Interface {
    double reflectance;
    glm::dvec3 refracted;
};

inline Interface interface_of(
    Fresnel fresnel, double eta, const glm::dvec3& direction, const glm::dvec3& normal, double cosine) {
    const double c = cosine, cosine_squared = (1.0 - eta) * (1.0 + eta) + eta * eta * c * c;
    if (cosine_squared < 0.0) return {1.0, glm::dvec3(0.0)};  // total internal reflection: u3 < 1 always
    const double ct = std::sqrt(cosine_squared);
    const glm::dvec3 refracted = eta * direction + (eta * c - ct) * normal;
    if (fresnel == Fresnel::schlick) {
        const double root = (1.0 - eta) / (1.0 + eta), r0 = root * root;
        return {r0 + (1.0 - r0) * std::pow(1.0 - (eta <= 1.0 ? c : ct), 5.0), refracted};
    }
    const double senkrecht = (eta * c - ct) / (eta * c + ct), parallel = (c - eta * ct) / (c + eta * ct);
    return {0.5 * (senkrecht * senkrecht + parallel * parallel), refracted};
}

}  // namespace tandem::oracle
