// Small scenes and rays for the generators of hard cases. Coordinates are rounded to float, so that every precision
// sees the same ones.
#pragma once

#include <array>
#include <glm/gtc/matrix_transform.hpp>

#include "common/stability/hard_case.h"

namespace tandem::stability {

// Each coordinate rounded to float.
[[nodiscard]] glm::dvec3 rounded(const glm::dvec3& v);

// From a point towards another, both rounded to float; `direction` rounded too.
[[nodiscard]] GivenRay ray_towards(const glm::dvec3& origin, const glm::dvec3& target);
[[nodiscard]] GivenRay ray_along(const glm::dvec3& origin, const glm::dvec3& direction);

struct Mesh {
    std::vector<glm::dvec3> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

// A scene of one diffuse material, entities added one by one.
[[nodiscard]] Scene empty_scene();
void add_mesh(Scene& scene, const Mesh& mesh, const glm::dmat4& placed = glm::dmat4(1.0));
void add_sphere(Scene& scene, const glm::dvec3& centre, double radius, const glm::dmat4& placed = glm::dmat4(1.0));
void add_cuboid(
    Scene& scene, const glm::dvec3& low, const glm::dvec3& high, const glm::dmat4& placed = glm::dmat4(1.0));

// An icosahedron, each triangle cut in four `cuts` times, corners on the sphere of that radius about `centre`; corners
// rounded to float after `turned`. Closed, front side out.
[[nodiscard]] Mesh ball_mesh(const glm::dmat3& turned, const glm::dvec3& centre, double radius, int cuts);

// A point of the mesh where triangles meet: a vertex, or a point of an edge (as often).
[[nodiscard]] glm::dvec3 seam_point(const Mesh& mesh, Dice& dice);

}  // namespace tandem::stability
