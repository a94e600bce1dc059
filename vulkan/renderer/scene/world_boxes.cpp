#include "vulkan/renderer/scene/world_boxes.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace tandem {

namespace {

// gamma(16) = 16 u / (1 - 16 u), u = 2^-24 [Higham 2002, section 3.1]. A world point is a sum of products, each of
// which passes at most nine roundings. These are matrix and vertex (2), a cuboid's centre (3), product (1), sums (3).
// The rest is for the intersection tests, which subtract the origin and sum products of three
// (shaders/geometry/bvh.glsl).
constexpr double gamma16 = 9.5367523e-7;

glm::dmat3 absolute(const glm::dmat3& m) { return {glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])}; }

// The sum of the absolute terms of each coordinate of the point.
glm::dvec3 magnitude(const glm::dmat4& m, const glm::dvec3& p) {
    return absolute(glm::dmat3(m)) * glm::abs(p) + glm::abs(glm::dvec3(m[3]));
}

// `size`: half the extents of a cuboid, or the radius thrice.
Box convex_box(const glm::dmat4& m, PrimitiveKind kind, const glm::dvec3& centre, const glm::dvec3& size,
    const glm::dvec3& terms) {
    const glm::dmat3 linear(m), spread = absolute(linear);
    const glm::dvec3 c(m * glm::dvec4(centre, 1.0));
    glm::dvec3 half = spread * size;
    if (kind == PrimitiveKind::sphere)
        half = size.x * glm::dvec3(glm::length(glm::dvec3(linear[0].x, linear[1].x, linear[2].x)),
                            glm::length(glm::dvec3(linear[0].y, linear[1].y, linear[2].y)),
                            glm::length(glm::dvec3(linear[0].z, linear[1].z, linear[2].z)));
    // The test sees the body through the rounded inverse of the map. Relative errors of its elements move the body's
    // points by |M| |M^-1| times as much.
    const glm::dvec3 skewed = spread * (absolute(glm::inverse(linear)) * (half + glm::abs(c)));
    const double pad = 2.0 * gamma16 * std::max({terms.x, terms.y, terms.z, skewed.x, skewed.y, skewed.z});
    return {c - half - pad, c + half + pad};
}

Box box_at_rest(const Scene& scene, const PlacedPrimitive& placed) {
    const Primitive& primitive = scene.primitives[placed.primitive];
    const glm::dmat4& m = scene.entities[placed.entity].object_to_world;
    const glm::dvec3 a = scene.vertices[primitive.index[0]];
    if (primitive.kind == PrimitiveKind::triangle) return box_of_points(scene, primitive.index, m).box;
    if (primitive.kind == PrimitiveKind::sphere) {
        const glm::dvec3 size(primitive.radius);
        return convex_box(m, primitive.kind, a, size, magnitude(m, glm::abs(a) + size));
    }
    const glm::dvec3 b = scene.vertices[primitive.index[1]];
    return convex_box(
        m, primitive.kind, 0.5 * a + 0.5 * b, 0.5 * (b - a), magnitude(m, glm::max(glm::abs(a), glm::abs(b))));
}

}  // namespace

PointsBox box_of_points(const Scene& scene, std::span<const std::uint32_t> indices, const glm::dmat4& object_to_world) {
    PointsBox result{{glm::dvec3(INFINITY), glm::dvec3(-INFINITY)}, 0.0};
    for (const std::uint32_t index : indices) {
        const glm::dvec3 p = scene.vertices[index], world(object_to_world * glm::dvec4(p, 1.0)),
                         terms = magnitude(object_to_world, p);
        result.box.low = glm::min(result.box.low, world);
        result.box.high = glm::max(result.box.high, world);
        result.greatest = std::max({result.greatest, terms.x, terms.y, terms.z});
    }
    const glm::dvec3 pad(2.0 * gamma16 * result.greatest);  // of the corners, and of the test
    result.box = {result.box.low - pad, result.box.high + pad};
    return result;
}

Box world_box(const Scene& scene, const PlacedPrimitive& placed) {
    Box box = box_at_rest(scene, placed);
    const glm::dvec3& motion = scene.entities[placed.entity].motion;
    if (motion == glm::dvec3(0.0)) return box;
    // All of the way, and what rounding moves the ray's origin by on its way to the entity at rest.
    const glm::dvec3 pad(gamma16 * glm::length(motion));
    return {glm::min(box.low, box.low + motion) - pad, glm::max(box.high, box.high + motion) + pad};
}

}  // namespace tandem
