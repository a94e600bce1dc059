// The shapes of a scene as triangle meshes, for targets that have nothing else.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "common/scene/scene.h"

namespace tandem::scene_export {

// Triangles with what their corners have; without normals they are flat.
struct Mesh {
    std::vector<glm::dvec3> points, normals;
    std::vector<glm::dvec2> coordinates;  // v upwards
    std::vector<std::uint32_t> indices;
};

// The sphere of radius 1 around the origin, with normals and the coordinates of MODEL.md section 5.1; up to 3·10⁻⁴
// within.
[[nodiscard]] Mesh unit_sphere();

[[nodiscard]] Mesh cuboid(const glm::dvec3& low, const glm::dvec3& high);

// The smooth or the flat triangles of an entity, in object space.
[[nodiscard]] Mesh triangles_of(const Scene& scene, const Entity& entity, bool smooth);

}  // namespace tandem::scene_export
