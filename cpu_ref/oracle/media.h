// The oracle's participating media (MODEL.md section 10). A ray is cut at all planes of a grid at once, and the pieces
// are sorted. Stepping from cell to cell could lose one.
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "common/scene/scene.h"
#include "cpu_ref/oracle/geometry.h"

namespace tandem::oracle {

// T over the first `end` of the ray.
[[nodiscard]] glm::dvec3 transmittance(const Medium& medium, const Ray& ray, double end);

// What befalls a ray within a segment of length `end`: scattered at a distance, or not before the end.
struct Flight {
    std::optional<double> scattered_at;
    glm::dvec3 weight{1.0};
};
// By the numbers m1 and m2 of section 10.
[[nodiscard]] Flight fly(const Medium& medium, const Ray& ray, double end, double channel_number, double number);

// Henyey and Greenstein's phase function of the cosine between the old and the new direction, and a new direction by
// it.
[[nodiscard]] double phase_function(double anisotropy, double cosine);
[[nodiscard]] glm::dvec3 phase_direction(double anisotropy, const glm::dvec3& direction, double a, double b);

}  // namespace tandem::oracle
