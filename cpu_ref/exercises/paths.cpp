#include "cpu_ref/exercises/paths.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "cpu_ref/oracle/sampling.h"

namespace tandem {

namespace {

constexpr std::uint32_t film_side = 65;  // odd: the pixel in the middle is the view's axis
constexpr double field_degrees = 90.0;   // as the marker's picture turns rays
constexpr double farthest = 1e4;         // beyond it a place is not drawn: the bodies have a size of about 1

ExercisePath seen_along(const glm::dvec3& origin, const glm::dvec3& direction, const std::string& body) {
    ExercisePath made;
    made.scene.film = {film_side, film_side};
    made.scene.camera = {.position = origin,
        .target = origin + direction,
        .up = std::abs(direction.y) < 0.9 ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(1.0, 0.0, 0.0),
        .vertical_field_degrees = field_degrees};
    made.scene.entities.push_back({.name = body});
    made.pixel = {film_side / 2, film_side / 2};
    return made;
}

TracedVertex hit(const glm::dvec3& origin, const glm::dvec3& direction, double t) {
    TracedVertex vertex;
    vertex.origin = origin, vertex.direction = direction;
    vertex.t = std::abs(t) > farthest ? std::numeric_limits<double>::infinity() : t;
    vertex.end = std::isfinite(vertex.t) ? PathEnd::absorbed : PathEnd::left_scene;
    if (!std::isfinite(vertex.t)) return vertex;
    vertex.position = origin + t * direction;
    vertex.primitive = 0;
    return vertex;
}

void add(Scene& scene, PrimitiveKind kind, std::initializer_list<glm::dvec3> points, double radius = 0.0) {
    Primitive& primitive = scene.primitives.emplace_back(Primitive{.kind = kind, .radius = radius});
    for (std::size_t k = 0; const glm::dvec3& point : points) {
        primitive.index[k++] = static_cast<std::uint32_t>(scene.vertices.size());
        scene.vertices.push_back(point);
    }
    ++scene.entities.front().primitive_count;
}

}  // namespace

ExercisePath path_that_meets(const glm::dvec3& origin, const glm::dvec3& direction, double t, const std::string& body) {
    ExercisePath made = seen_along(origin, direction, body);
    made.path.vertices = {hit(origin, direction, t == -1.0 ? std::numeric_limits<double>::infinity() : t)};
    return made;
}

ExercisePath path_that_goes_on(
    const glm::dvec3& d, const glm::dvec3& n, const glm::dvec3& next, const std::string& surface) {
    ExercisePath made = seen_along(-d, d, surface);
    TracedVertex at = hit(-d, d, 1.0);
    at.normal = n;
    if (next != glm::dvec3(0.0)) {
        at.end = PathEnd::goes_on;
        at.next_direction = next;
    }
    made.path.vertices = {at};
    if (at.end == PathEnd::goes_on)
        made.path.vertices.push_back(hit(at.position, next, std::numeric_limits<double>::infinity()));
    add_square(made.scene, at.position, n, 0.7);
    return made;
}

void add_triangle(Scene& scene, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    add(scene, PrimitiveKind::triangle, {a, b, c});
}
void add_sphere(Scene& scene, const glm::dvec3& centre, double radius) {
    add(scene, PrimitiveKind::sphere, {centre}, radius);
}
void add_cuboid(Scene& scene, const glm::dvec3& low, const glm::dvec3& high) {
    add(scene, PrimitiveKind::cuboid, {low, high});
}
void add_square(Scene& scene, const glm::dvec3& middle, const glm::dvec3& normal, double half_side) {
    const oracle::Frame frame(normal);
    const glm::dvec3 t = half_side * frame.tangent, b = half_side * frame.bitangent;
    add_triangle(scene, middle - t - b, middle + t - b, middle + t + b);
    add_triangle(scene, middle - t - b, middle + t + b, middle - t + b);
}

}  // namespace tandem
