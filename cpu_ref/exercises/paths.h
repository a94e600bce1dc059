// Paths in which the function of an exercise is one step, and the bodies that they meet (Exercise::path).
#pragma once

#include <string>

#include "common/exercise/exercise.h"

namespace tandem {

// A ray that meets a body of that name after `t`: a negative one of -1 means nothing. The camera looks along it.
[[nodiscard]] ExercisePath path_that_meets(
    const glm::dvec3& origin, const glm::dvec3& direction, double t, const std::string& body);

// A ray along `d` that meets a surface with the unit normal `n` after 1, and goes on along `next`; 0 ends it.
[[nodiscard]] ExercisePath path_that_goes_on(
    const glm::dvec3& d, const glm::dvec3& n, const glm::dvec3& next, const std::string& surface);

// What the path meets.
void add_triangle(Scene& scene, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);
void add_sphere(Scene& scene, const glm::dvec3& centre, double radius);
void add_cuboid(Scene& scene, const glm::dvec3& low, const glm::dvec3& high);
// A square of that half side, for a plane.
void add_square(Scene& scene, const glm::dvec3& middle, const glm::dvec3& normal, double half_side);

}  // namespace tandem
