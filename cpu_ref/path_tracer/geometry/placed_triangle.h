// A triangle in the world, of its corners in object space and its entity's map (MODEL.md section 6): computed in
// double, then rounded. It fills the tables. It also makes the triangles of meshes that several entities place, where
// rays meet them. So both have the same bits.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "cpu_ref/path_tracer/geometry/kernels.h"

namespace tandem::cpu {

// World = linear object + shift.
struct EntityMap {
    glm::dmat3 linear{1.0}, inverse{1.0};
    glm::dvec3 shift{0.0};
    [[nodiscard]] glm::dvec3 to_world(const glm::dvec3& p) const { return linear * p + shift; }
    [[nodiscard]] glm::dvec3 normal_to_world(const glm::dvec3& n) const {
        return glm::normalize(glm::transpose(inverse) * n);
    }
};
[[nodiscard]] EntityMap entity_map(const glm::dmat4& object_to_world);

using Corners = std::array<glm::dvec3, 3>;

// Degenerate: of no area in either space. Then `normal` is that of an object's xy plane, and it is never hit.
struct PlacedTriangle {
    Corners corner;     // world
    glm::dvec3 normal;  // unit, front
    double area;
    bool degenerate;
};
[[nodiscard]] PlacedTriangle placed_triangle(const EntityMap& map, const Corners& object);

template <class Real>
[[nodiscard]] TriangleForm<Real> form_of(const PlacedTriangle& triangle);

// A triangle's row of FaceTable (tables.h), as far as it follows from its corners.
template <class Real>
struct TriangleFace {
    Vec3<Real> normal{}, terms{};
    Real offset = 0, extent = 0, terms_of_extent = 0;
    std::array<Vec3<Real>, 3> edge_normal{};
    std::array<Real, 3> edge_offset{Real(1e30), Real(1e30), Real(1e30)};
    Real least_height = Real(1e30);
};
template <class Real>
[[nodiscard]] TriangleFace<Real> face_of(const PlacedTriangle& triangle);

// `terms` of FaceTable: of two edges of a face in the world; 0 for spheres, which have no plane.
template <class Real>
[[nodiscard]] glm::dvec3 terms_of(const glm::dvec3& e, const glm::dvec3& f);

extern template TriangleForm<float> form_of<float>(const PlacedTriangle&);
extern template TriangleForm<double> form_of<double>(const PlacedTriangle&);
extern template TriangleFace<float> face_of<float>(const PlacedTriangle&);
extern template TriangleFace<double> face_of<double>(const PlacedTriangle&);
extern template glm::dvec3 terms_of<float>(const glm::dvec3&, const glm::dvec3&);
extern template glm::dvec3 terms_of<double>(const glm::dvec3&, const glm::dvec3&);

}  // namespace tandem::cpu
