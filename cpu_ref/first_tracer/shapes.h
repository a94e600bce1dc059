// Where a ray meets a triangle, a sphere, a cuboid and the whole scene (MODEL.md sections 5 and 6).
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "cpu_ref/first_tracer/camera.h"

namespace tandem::first {

// A primitive where its entity places it (section 6). A triangle's corners a, b, c are in the world. A sphere's centre
// a and a cuboid's least and greatest corners a, b are in the entity's own space.
struct Shape {
    PrimitiveKind kind;
    std::uint32_t material;
    dmat4 to_world, to_object;
    dmat3 normal_to_world;
    dvec3 a{0.0}, b{0.0}, c{0.0};
    double radius = 0.0;
    dvec3 normal{0.0};   // of a triangle, to its front
    double error = 0.0;  // how far rounding puts a point off this surface, as a neighbour in the same plane sees it
};

struct Hit {
    double t;
    dvec3 point, normal;  // the normal of unit length, to the front
    std::uint32_t primitive = no_index;
};

inline dvec3 point_by(const dmat4& m, const dvec3& p) { return dvec3(m * glm::dvec4(p, 1.0)); }
inline dvec3 vector_by(const dmat4& m, const dvec3& v) { return dvec3(m * glm::dvec4(v, 0.0)); }

// A ray that leaves a flat or convex shape outwards never meets it again. A ray that goes in meets the far side alone
// (section 5.2, rules 11 to 13). Others meet the nearer root that lies within [least, most].
inline std::optional<double> first_root(
    double nearer, double farther, bool leaves, bool inwards, double least, double most) {
    if (leaves && !inwards) return std::nullopt;
    if (leaves) nearer = farther = std::max(farther, 0.0);
    for (const double t : {nearer, farther})
        if (t >= least && t <= most) return t;
    return std::nullopt;
}

// Seen from the ray's origin, each edge spans a tetrahedron with the ray's direction. The ray passes between the edges
// where the three signed volumes have one sign. Swapping the ends of an edge changes nothing but the sign, so two
// triangles at an edge leave no gap.
inline std::optional<Hit> meet_triangle(const Shape& s, const Ray& ray, double least, double most) {
    const dvec3 a = s.a - ray.origin, b = s.b - ray.origin, c = s.c - ray.origin;
    const double volume_a = glm::dot(ray.direction, glm::cross(b, c));
    const double volume_b = glm::dot(ray.direction, glm::cross(c, a));
    const double volume_c = glm::dot(ray.direction, glm::cross(a, b));
    const double sum = volume_a + volume_b + volume_c;
    if (std::min({volume_a, volume_b, volume_c}) < 0.0 && std::max({volume_a, volume_b, volume_c}) > 0.0) return {};
    const double t = glm::dot(s.normal, a) / glm::dot(s.normal, ray.direction);
    if (sum == 0.0 || !(t >= least && t <= most)) return {};
    // The volumes are barycentric coordinates, which put the point back on the triangle however long the way was.
    return Hit{t, s.a + (volume_b / sum * (s.b - s.a) + volume_c / sum * (s.c - s.a)), s.normal};
}

// In the entity's space the direction is not of unit length, which keeps t a distance in the world. The roots lie
// symmetrically about the point nearest to the centre. The smaller one in size is a difference of nearly equal numbers,
// so it comes from their product instead.
inline std::optional<Hit> meet_sphere(const Shape& s, const Ray& ray, bool leaves, double least, double most) {
    const dvec3 o = point_by(s.to_object, ray.origin) - s.a, d = vector_by(s.to_object, ray.direction);
    const double dd = glm::dot(d, d), middle = -glm::dot(o, d) / dd;
    const dvec3 nearest = o + middle * d;
    const double rest = s.radius * s.radius - glm::dot(nearest, nearest);
    if (rest < 0.0 && !leaves) return {};
    const double half = std::sqrt(std::max(rest, 0.0) / dd);
    const double product = (glm::length(o) - s.radius) * (glm::length(o) + s.radius) / dd;
    const double nearer = middle > 0.0 ? product / (middle + half) : middle - half;
    const double farther = middle < 0.0 ? product / (middle - half) : middle + half;
    const auto t = first_root(nearer, farther, leaves, ray.inwards, least, most);
    if (!t) return {};
    const dvec3 outward = glm::normalize(o + *t * d);
    return Hit{*t, point_by(s.to_world, s.a + s.radius * outward), glm::normalize(s.normal_to_world * outward)};
}

// Between two parallel planes the ray is within one interval of t; in the cuboid it is within all three.
inline std::optional<Hit> meet_cuboid(const Shape& s, const Ray& ray, bool leaves, double least, double most) {
    const dvec3 o = point_by(s.to_object, ray.origin), d = vector_by(s.to_object, ray.direction);
    double nearer = -std::numeric_limits<double>::infinity(), farther = -nearer;
    int entered = 0, left = 0;  // axes of the faces
    for (int axis = 0; axis < 3; ++axis) {
        if (d[axis] == 0.0 && (o[axis] < s.a[axis] || o[axis] > s.b[axis])) return {};
        if (d[axis] == 0.0) continue;
        double in = (s.a[axis] - o[axis]) / d[axis], out = (s.b[axis] - o[axis]) / d[axis];
        if (in > out) std::swap(in, out);
        if (in > nearer) nearer = in, entered = axis;
        if (out < farther) farther = out, left = axis;
    }
    if (nearer > farther && !leaves) return {};
    const auto t = first_root(nearer, farther, leaves, ray.inwards, least, most);
    if (!t) return {};
    const bool enters = !leaves && *t == nearer;
    const int axis = enters ? entered : left;
    const bool upper = (d[axis] > 0.0) != enters;
    dvec3 point = glm::clamp(o + *t * d, s.a, s.b), outward(0.0);
    point[axis] = upper ? s.b[axis] : s.a[axis];
    outward[axis] = upper ? 1.0 : -1.0;
    return Hit{*t, point_by(s.to_world, point), glm::normalize(s.normal_to_world * outward)};
}

// Why 64: let u = 2⁻⁵³ be what one operation rounds by, and S the largest coordinate.
// - Triangles: an edge is off by 2u S an axis. Its product with a weight adds 2u S, the sums 3u S: 13u S along the
//   normal. A neighbour in the same plane asks on which side the point is, by a difference, a normal and a dot product.
//   That is 8u of a way of up to 2√3 S, or 28u S. Both together are below 64u S, unless the triangle is a needle.
// - Cuboids: a coordinate is a sum of four terms, off by 4u times the sum S of their sizes: 7u S along the normal. The
//   neighbour's inverse is off by 9u, its product by 4u, its corner by u, of a way of √3 S: 25u S.
// - Spheres touch in points alone, and need nothing.
inline double error_of(const Shape& s) {
    constexpr double factor = 64.0 * 0x1p-53;
    if (s.kind == PrimitiveKind::sphere) return 0.0;
    const dvec3 reach = glm::max(glm::abs(s.a), glm::max(glm::abs(s.b), glm::abs(s.c)));
    const auto size = [&](int column) { return glm::abs(dvec3(s.to_world[column])); };
    const dvec3 sizes =
        s.kind == PrimitiveKind::triangle ? reach : size(0) * reach.x + size(1) * reach.y + size(2) * reach.z + size(3);
    return factor * std::max({sizes.x, sizes.y, sizes.z});
}

// All primitives, by primitive id. Every ray tries every one: an acceleration structure only makes this faster.
class World {
public:
    World(const Scene& scene, const RenderSettings& settings) : least_(settings.ray_min), most_(settings.ray_max) {
        for (const PlacedPrimitive place : placed_primitives(scene)) {
            const Entity& entity = scene.entities[place.entity];
            const Primitive& primitive = scene.primitives[place.primitive];
            const dmat4& m = entity.object_to_world;
            Shape s{.kind = primitive.kind,
                .material = entity.material,
                .to_world = m,
                .to_object = glm::inverse(m),
                .normal_to_world = glm::transpose(glm::inverse(dmat3(m))),
                .a = scene.vertices[primitive.index[0]],
                .radius = primitive.radius};
            if (s.kind != PrimitiveKind::sphere) s.b = scene.vertices[primitive.index[1]];
            if (s.kind == PrimitiveKind::triangle) {
                s.c = scene.vertices[primitive.index[2]];
                s.normal = glm::normalize(s.normal_to_world * glm::cross(s.b - s.a, s.c - s.a));
                for (dvec3* corner : {&s.a, &s.b, &s.c}) *corner = point_by(m, *corner);
            }
            s.error = error_of(s);
            shapes.push_back(s);
        }
    }

    // Section 5.2: the smallest t, of equal ones the lower id.
    [[nodiscard]] std::optional<Hit> closest_hit(const Ray& ray) const {
        std::optional<Hit> closest;
        for (std::uint32_t id = 0; id < shapes.size(); ++id) {
            const std::optional<Hit> hit = meet(id, ray, most_);
            if (hit && (!closest || hit->t < closest->t)) closest = Hit{hit->t, hit->point, hit->normal, id};
        }
        return closest;
    }

    // Section 9.2, rules 17 and 18: nothing but the light itself lies before it.
    [[nodiscard]] bool reaches(const Ray& ray, std::uint32_t light, double distance) const {
        if (distance < least_ || distance > most_) return false;
        for (std::uint32_t id = 0; id < shapes.size(); ++id)
            if (id != light && meet(id, ray, distance)) return false;
        return true;
    }

    std::vector<Shape> shapes;

private:
    [[nodiscard]] std::optional<Hit> meet(std::uint32_t id, const Ray& ray, double most) const {
        const Shape& s = shapes[id];
        const bool leaves = id == ray.left;
        if (s.kind == PrimitiveKind::sphere) return meet_sphere(s, ray, leaves, least_, most);
        if (s.kind == PrimitiveKind::cuboid) return meet_cuboid(s, ray, leaves, least_, most);
        return leaves ? std::nullopt : meet_triangle(s, ray, least_, most);
    }

    double least_, most_;  // the scene's interval of ray lengths
};

// Section 5.2, rules 14 and 15: a ray that leaves a hit starts at its point, moved off the surface by the error bound.
// So it finds no neighbour in the same plane, and all else.
inline Ray spawned_ray(const World& world, const Hit& hit, const dvec3& direction, bool to_front) {
    const double offset = world.shapes[hit.primitive].error;
    return {hit.point + (to_front ? offset : -offset) * hit.normal, direction, hit.primitive, !to_front};
}

}  // namespace tandem::first
