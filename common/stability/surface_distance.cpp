#include "common/stability/surface_distance.h"

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

namespace tandem::stability {

namespace {

using glm::dmat3;
using glm::dmat4;
using glm::dvec3;
using glm::dvec4;

dvec3 nearest_on_segment(const dvec3& a, const dvec3& b, const dvec3& p) {
    const dvec3 e = b - a;
    const double length2 = glm::dot(e, e);
    return length2 > 0.0 ? a + glm::clamp(glm::dot(p - a, e) / length2, 0.0, 1.0) * e : a;
}

// By the signs of the edge planes; beyond an edge, the nearest point of the three edges.
dvec3 nearest_on_triangle(const std::array<dvec3, 3>& c, const dvec3& n, const dvec3& p) {
    bool within = glm::dot(n, n) > 0.0;
    for (std::size_t i = 0; within && i < 3; ++i)
        within = glm::dot(glm::cross(n, c[(i + 1) % 3] - c[i]), p - c[i]) >= 0.0;
    if (within) return p - n * (glm::dot(n, p - c[0]) / glm::dot(n, n));
    dvec3 best = nearest_on_segment(c[0], c[1], p);
    for (std::size_t i = 1; i < 3; ++i) {
        const dvec3 q = nearest_on_segment(c[i], c[(i + 1) % 3], p);
        if (glm::dot(q - p, q - p) < glm::dot(best - p, best - p)) best = q;
    }
    return best;
}

SurfaceOffset split(const dvec3& from, const dvec3& to, const dvec3& normal) {
    const dvec3 v = to - from;
    const double along = glm::dot(v, normal);
    return {std::abs(along), glm::length(v - along * normal), normal};
}

}  // namespace

Surfaces::Surfaces(const Scene& scene) {
    for (const PlacedPrimitive where : placed_primitives(scene)) {
        const Entity& entity = scene.entities[where.entity];
        const Primitive& primitive = scene.primitives[where.primitive];
        const dmat4& m = entity.object_to_world;
        Placed placed{
            .kind = primitive.kind, .corners = {}, .to_world = m, .to_unit = {}, .half = dvec3(1.0), .reach = 0.0};
        const dvec3 a = scene.vertices[primitive.index[0]];
        if (primitive.kind == PrimitiveKind::triangle) {
            for (std::size_t i = 0; i < 3; ++i) {
                placed.corners[i] = dvec3(m * dvec4(scene.vertices[primitive.index[i]], 1.0));
                placed.reach = std::max(placed.reach, largest_coordinate(placed.corners[i]));
            }
        } else {
            dvec3 centre = a, half(primitive.radius);
            if (primitive.kind == PrimitiveKind::cuboid) {
                const dvec3 b = scene.vertices[primitive.index[1]];
                centre = 0.5 * (a + b);
                half = 0.5 * (b - a);
                placed.half = dvec3(glm::greaterThan(half, dvec3(0.0)));
                half = glm::mix(dvec3(1.0), half, placed.half);
            }
            placed.to_world = m * glm::scale(glm::translate(dmat4(1.0), centre), half);
            placed.to_unit = glm::inverse(placed.to_world);
            const dmat3 linear(placed.to_world);
            const dvec3 middle(placed.to_world[3]);
            placed.reach =
                largest_coordinate(glm::abs(middle) + glm::abs(linear[0]) + glm::abs(linear[1]) + glm::abs(linear[2]));
        }
        reach_ = std::max(reach_, placed.reach);
        placed_.push_back(placed);
    }
}

SurfaceOffset Surfaces::offset(std::uint32_t id, const dvec3& point) const {
    const Placed& placed = placed_[id];
    if (placed.kind == PrimitiveKind::triangle) {
        const auto& c = placed.corners;
        const dvec3 n = glm::cross(c[1] - c[0], c[2] - c[0]);
        return split(nearest_on_triangle(c, n, point), point, glm::dot(n, n) > 0.0 ? glm::normalize(n) : dvec3(0.0));
    }
    const dvec3 q(placed.to_unit * dvec4(point, 1.0));
    dvec3 nearest = glm::clamp(q, -placed.half, placed.half), gradient(0.0);
    if (placed.kind == PrimitiveKind::sphere) {
        nearest = gradient = glm::normalize(q);
    } else {
        // The face that is nearest in the world, from within or beyond it.
        double least = std::numeric_limits<double>::infinity();
        int face = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double gap =
                std::abs(std::abs(q[axis]) - placed.half[axis]) * glm::length(dvec3(placed.to_world[axis]));
            if (gap < least) {
                least = gap;
                face = axis;
            }
        }
        gradient[face] = q[face] < 0.0 ? -1.0 : 1.0;
        nearest[face] = placed.half[face] * gradient[face];
    }
    const dvec3 normal = glm::normalize(glm::transpose(dmat3(placed.to_unit)) * gradient);
    return split(dvec3(placed.to_world * dvec4(nearest, 1.0)), point, normal);
}

}  // namespace tandem::stability
