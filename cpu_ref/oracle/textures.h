// The oracle's textures (MODEL.md section 7.0).
#pragma once

#include <glm/glm.hpp>

#include "common/scene/scene.h"

namespace tandem::oracle {

// The colour at a hit: `object_point` in the object space of its entity, `coordinates` those of section 5.1.
[[nodiscard]] glm::dvec3 texture_colour(
    const Texture& texture, const glm::dvec3& object_point, const glm::dvec2& coordinates);

enum class Rows { repeated, held };  // beyond the first and the last

// Bilinear between texels, v upwards; columns repeat.
[[nodiscard]] glm::dvec3 bilinear(const Pixels& image, double u, double v, Rows rows);

}  // namespace tandem::oracle
