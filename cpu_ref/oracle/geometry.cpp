// Brute-force intersection in double precision: Plücker coordinates for triangles, the perpendicular remainder for
// spheres, clipping by half-spaces for cuboids. Positions are put back on the primitive, so their error does not grow
// with t.
#include "cpu_ref/oracle/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tandem::oracle {
namespace {

glm::dvec3 point_by(const glm::dmat4& m, const glm::dvec3& p) { return glm::dvec3(m * glm::dvec4(p, 1.0)); }
glm::dvec3 vector_by(const glm::dmat4& m, const glm::dvec3& v) { return glm::dvec3(m * glm::dvec4(v, 0.0)); }

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// A ray leaving a convex primitive to the front cannot meet it again. To the inside it meets the exit alone, which
// rounding must not push behind the origin (MODEL.md section 5, "Leaving a surface").
std::optional<double> pick_convex_root(
    double entry, double exit, bool leaving, bool to_front, double t_min, double t_max) {
    if (leaving && to_front) return std::nullopt;
    const double first = leaving ? std::max(exit, 0.0) : entry;
    if (first >= t_min && first <= t_max) return first;
    if (!leaving && exit >= t_min && exit <= t_max) return exit;
    return std::nullopt;
}

// Section 5.1: fractions along the two axes of a cuboid's face, that has the third for its normal.
glm::dvec2 face_coordinates(const glm::dvec3& point, const glm::dvec3& least, const glm::dvec3& greatest, int normal) {
    const int axes[2] = {normal == 0 ? 1 : 0, normal == 2 ? 1 : 2};
    glm::dvec2 result(0.0);
    for (int i = 0; i < 2; ++i) {
        const double width = greatest[axes[i]] - least[axes[i]];
        if (width > 0.0) result[i] = (point[axes[i]] - least[axes[i]]) / width;
    }
    return result;
}

}  // namespace

World::World(const Scene& scene) {
    for (const PlacedPrimitive place : placed_primitives(scene)) {
        const Entity& entity = scene.entities[place.entity];
        const Primitive& primitive = scene.primitives[place.primitive];
        const glm::dmat4& m = entity.object_to_world;
        Placed placed{.kind = primitive.kind,
            .material = entity.material,
            .object_to_world = m,
            .world_to_object = glm::inverse(m),
            .normal_to_world = glm::transpose(glm::inverse(glm::dmat3(m))),
            .a = scene.vertices[primitive.index[0]],
            .b = {},
            .c = {},
            .object_normal = {},
            .radius = primitive.radius,
            .motion = entity.motion,
            .object_corners = {},
            .corner_coordinates = {{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}},
            .corner_normals = {}};
        if (primitive.kind != PrimitiveKind::sphere) placed.b = scene.vertices[primitive.index[1]];
        if (primitive.kind == PrimitiveKind::triangle) {
            placed.c = scene.vertices[primitive.index[2]];
            placed.object_normal = glm::cross(placed.b - placed.a, placed.c - placed.a);
            placed.object_corners = {placed.a, placed.b, placed.c};
            if (!scene.texture_coordinates.empty())
                for (std::size_t i = 0; i < 3; ++i)
                    placed.corner_coordinates[i] = scene.texture_coordinates[primitive.index[i]];
            if (!scene.normals.empty())
                for (std::size_t i = 0; i < 3; ++i) placed.corner_normals[i] = scene.normals[primitive.index[i]];
            for (glm::dvec3* corner : {&placed.a, &placed.b, &placed.c}) *corner = point_by(m, *corner);
        }
        primitives_.push_back(placed);
    }
}

std::optional<Hit> World::closest_hit(const Ray& ray, double t_min, double t_max) const {
    constexpr double farthest = 1e18;  // section 5.2
    if (!is_finite(ray.origin) || !is_finite(ray.direction) ||
        glm::any(glm::greaterThan(glm::abs(ray.origin), glm::dvec3(farthest))))
        return std::nullopt;
    std::optional<Hit> closest;
    for (std::uint32_t id = 0; id < primitives_.size(); ++id) {
        const Placed& primitive = primitives_[id];
        // A moving entity meets the ray as one at rest meets the ray moved back (MODEL.md section 6).
        const glm::dvec3 moved = ray.time * primitive.motion;
        Ray moved_back = ray;
        moved_back.origin -= moved;
        const auto found = hit_at_rest(primitive, moved_back, id == ray.left_primitive, t_min, t_max);
        if (found && (!closest || found->t < closest->t))
            closest = Hit{found->t, id, primitive.material, found->position + moved, found->normal, found->object_point,
                found->coordinates, found->rounding, found->vertex_normal};
    }
    return closest;
}

std::optional<World::Candidate> World::hit_at_rest(
    const Placed& primitive, const Ray& ray, bool leaving, double t_min, double t_max) {
    switch (primitive.kind) {
        case PrimitiveKind::triangle:
            return leaving ? std::nullopt : triangle_hit(primitive, ray, t_min, t_max);
        case PrimitiveKind::sphere:
            return sphere_hit(primitive, ray, leaving, t_min, t_max);
        case PrimitiveKind::cuboid:
            return cuboid_hit(primitive, ray, leaving, t_min, t_max);
    }
    return std::nullopt;
}

// A triangle's coplanar neighbours must not be met again. Here u = 2^-53 and S is the largest coordinate. A position is
// off by 6 u S an axis (quotients and their sum 3 u, products u, sums 2 u). That is 11 u S along the normal. A
// neighbour's plane is evaluated there with 9 u of a way of at most 2 sqrt(3) S. These are the difference (2 u), its
// normal's edges and cross product (4 u) and the dot product (3 u). In all that is below 43 u S.
double World::rounding_of_plane(const Placed& triangle) {
    double largest = 0.0;
    for (const glm::dvec3& corner : {triangle.a, triangle.b, triangle.c})
        for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, std::abs(corner[axis]));
    return 43.0 * 0x1p-53 * largest;
}

// The ray passes the triangle where it passes all three edges on the same side. The source is [Jones: Intersecting a
// ray and a triangle with Plücker coordinates, Ray Tracing News 13(1), 2000]. Swapping the ends of an edge changes no
// bit but the sign, so neighbours leave no gap.
std::optional<World::Candidate> World::triangle_hit(
    const Placed& triangle, const Ray& ray, double t_min, double t_max) {
    const glm::dvec3 a = triangle.a - ray.origin, b = triangle.b - ray.origin, c = triangle.c - ray.origin;
    const double weight_a = glm::dot(ray.direction, glm::cross(b, c));
    const double weight_b = glm::dot(ray.direction, glm::cross(c, a));
    const double weight_c = glm::dot(ray.direction, glm::cross(a, b));
    const bool all_left = weight_a >= 0.0 && weight_b >= 0.0 && weight_c >= 0.0;
    const bool all_right = weight_a <= 0.0 && weight_b <= 0.0 && weight_c <= 0.0;
    const double sum = weight_a + weight_b + weight_c;  // 0: zero area, or seen edge on
    if (!(all_left || all_right) || sum == 0.0) return std::nullopt;

    const glm::dvec3 plane = glm::cross(triangle.b - triangle.a, triangle.c - triangle.a);
    const double t = glm::dot(plane, a) / glm::dot(plane, ray.direction);
    if (!(t >= t_min && t <= t_max)) return std::nullopt;
    const auto mean = [&](const auto& at_a, const auto& at_b, const auto& at_c) {  // by barycentric coordinates
        return (weight_a / sum) * at_a + (weight_b / sum) * at_b + (weight_c / sum) * at_c;
    };
    const auto& corners = triangle.object_corners;
    const auto& coordinates = triangle.corner_coordinates;
    const auto& normals = triangle.corner_normals;
    return Candidate{t, mean(triangle.a, triangle.b, triangle.c),
        glm::normalize(triangle.normal_to_world * triangle.object_normal), mean(corners[0], corners[1], corners[2]),
        mean(coordinates[0], coordinates[1], coordinates[2]), rounding_of_plane(triangle),
        triangle.normal_to_world * mean(normals[0], normals[1], normals[2])};
}

// A cuboid's face may lie on that of another body, which must not be met before and after it by turns. A coordinate is
// map times corner, and shift. S is the largest sum of its absolute terms, among the coordinates along which the normal
// points at all. A position is off by 4 u S an axis, 7 u S along the normal. Another cuboid, whose map turns and scales
// alike, finds it in its own space. Its inverse is off by 9 u, its product by 4 u and its corner by u, of a way of at
// most sqrt(3) S. In all that is below 43 u S, as above. Along an axis of the world sums have one term, and a position
// is off by 2 u S. The other's inverse is off by 7 u, its shift by 8 u, product and sum by u each. The place and the
// shift are at most S together with the corner: below 18 u S. There both maps have zeros, or what the cosine of a right
// angle comes out as. That is 0.55 u for each of at most three turns: below 2 u of the way along the face.
double World::rounding_of_faces(const Placed& cuboid, const glm::dvec3& normal) {
    const glm::dvec3 reach = glm::max(glm::abs(cuboid.a), glm::abs(cuboid.b));
    double along = 0.0, aside = 0.0;
    int axes_along = 0;
    for (int axis = 0; axis < 3; ++axis) {
        double terms = std::abs(cuboid.object_to_world[3][axis]);
        for (int i = 0; i < 3; ++i) terms += std::abs(cuboid.object_to_world[i][axis]) * reach[i];
        const bool is_along = std::abs(normal[axis]) > 4.0 * 0x1p-53;
        axes_along += is_along ? 1 : 0;
        double& largest = is_along ? along : aside;
        largest = std::max(largest, terms);
    }
    return ((axes_along == 1 ? 18.0 : 43.0) * along + 2.0 * aside) * 0x1p-53;
}

// In object space, where the direction is not of unit length and t therefore stays the world distance. The ray comes
// nearest to the centre at t_near, with the remainder `perpendicular`; the roots lie symmetrically about it.
std::optional<World::Candidate> World::sphere_hit(
    const Placed& sphere, const Ray& ray, bool leaving, double t_min, double t_max) {
    if (!(sphere.radius > 0.0)) return std::nullopt;
    const glm::dvec3 to_origin = point_by(sphere.world_to_object, ray.origin) - sphere.a;
    const glm::dvec3 direction = vector_by(sphere.world_to_object, ray.direction);
    const double length_squared = glm::dot(direction, direction);
    const double t_near = -glm::dot(to_origin, direction) / length_squared;
    const glm::dvec3 perpendicular = to_origin + t_near * direction;
    const double rest = sphere.radius * sphere.radius - glm::dot(perpendicular, perpendicular);
    if (rest < 0.0) return std::nullopt;
    const double half_chord = std::sqrt(rest / length_squared);
    double entry = t_near - half_chord, exit = t_near + half_chord;
    // The ray's side of the surface is known from its distance to the centre, to within a rounding. The root there has
    // its sign, and where that is 0 it is 0. The two roots would be differences of nearly equal numbers.
    const double outside = (glm::length(to_origin) - sphere.radius) * (glm::length(to_origin) + sphere.radius);
    if (t_near > 0.0)
        entry = std::clamp(outside / length_squared / exit, -half_chord, exit);
    else if (t_near < 0.0)
        exit = std::clamp(outside / length_squared / entry, entry, half_chord);
    const auto t = pick_convex_root(entry, exit, leaving, ray.leaves_to_front, t_min, t_max);
    if (!t) return std::nullopt;
    const glm::dvec3 outward = glm::normalize(to_origin + *t * direction);
    const glm::dvec3 point = sphere.a + sphere.radius * outward;
    const glm::dvec2 coordinates(0.5 + std::atan2(-outward.z, outward.x) / (2.0 * std::numbers::pi),
        std::acos(std::clamp(-outward.y, -1.0, 1.0)) / std::numbers::pi);
    return Candidate{*t, point_by(sphere.object_to_world, point), glm::normalize(sphere.normal_to_world * outward),
        point, coordinates};
}

// Clips the line by the six half-spaces of the cuboid (Cyrus–Beck), remembering the face that cut last on each side.
std::optional<World::Candidate> World::cuboid_hit(
    const Placed& cuboid, const Ray& ray, bool leaving, double t_min, double t_max) {
    const glm::dvec3 origin = point_by(cuboid.world_to_object, ray.origin);
    const glm::dvec3 direction = vector_by(cuboid.world_to_object, ray.direction);
    double entry = -std::numeric_limits<double>::infinity(), exit = -entry;
    int entry_face = 0, exit_face = 0;  // in the order -x +x -y +y -z +z
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2;
        const bool upper = face % 2 == 1;
        const double outside = upper ? origin[axis] - cuboid.b[axis] : cuboid.a[axis] - origin[axis];
        const double recession = upper ? direction[axis] : -direction[axis];  // speed along the outward normal
        if (recession == 0.0) {
            if (outside > 0.0) return std::nullopt;
            continue;
        }
        const double t = -outside / recession;
        if (recession < 0.0 && t > entry) {
            entry = t;
            entry_face = face;
        }
        if (recession > 0.0 && t < exit) {
            exit = t;
            exit_face = face;
        }
    }
    // A ray that leaves inwards surely has an exit, even if rounding put its origin a little outside.
    if (entry > exit && !leaving) return std::nullopt;
    const auto t = pick_convex_root(entry, exit, leaving, ray.leaves_to_front, t_min, t_max);
    if (!t) return std::nullopt;
    const int face = !leaving && *t == entry ? entry_face : exit_face;
    const int axis = face / 2;
    glm::dvec3 position = glm::clamp(origin + *t * direction, cuboid.a, cuboid.b);
    position[axis] = face % 2 == 1 ? cuboid.b[axis] : cuboid.a[axis];
    glm::dvec3 outward(0.0);
    outward[axis] = face % 2 == 1 ? 1.0 : -1.0;
    const glm::dvec3 normal = glm::normalize(cuboid.normal_to_world * outward);
    return Candidate{*t, point_by(cuboid.object_to_world, position), normal, position,
        face_coordinates(position, cuboid.a, cuboid.b, axis), rounding_of_faces(cuboid, normal)};
}

}  // namespace tandem::oracle
