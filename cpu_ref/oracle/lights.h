// The oracle's lights that are not surfaces: background, points, spots and suns (MODEL.md section 8).
#pragma once

#include <glm/glm.hpp>

#include "common/scene/scene.h"

namespace tandem::oracle {

// B(d).
[[nodiscard]] glm::dvec3 background_radiance(const Background& background, const glm::dvec3& direction);

// A punctual light as seen from a point: where it is, and the irradiance of a surface that faces it.
struct PunctualView {
    glm::dvec3 direction;  // unit, to the light
    double distance;       // infinite for suns
    glm::dvec3 irradiance;
};
[[nodiscard]] PunctualView punctual_view(const PunctualLight& light, const glm::dvec3& from);

}  // namespace tandem::oracle
