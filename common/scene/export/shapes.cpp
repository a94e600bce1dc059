#include "common/scene/export/shapes.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace tandem::scene_export {

Mesh unit_sphere() {
    constexpr std::uint32_t columns = 128, rows = 64;
    constexpr double pi = std::numbers::pi;
    Mesh mesh;
    for (std::uint32_t row = 0; row <= rows; ++row)
        for (std::uint32_t column = 0; column <= columns; ++column) {
            const double u = double{1.0} * column / columns, v = double{1.0} * row / rows;
            const double angle = 2.0 * pi * (u - 0.5), ring = std::sin(pi * v);
            const glm::dvec3 point(ring * std::cos(angle), -std::cos(pi * v), -ring * std::sin(angle));
            mesh.points.push_back(point);
            mesh.normals.push_back(point);
            mesh.coordinates.emplace_back(u, v);
        }
    for (std::uint32_t row = 0; row < rows; ++row)
        for (std::uint32_t column = 0; column < columns; ++column) {
            const std::uint32_t a = row * (columns + 1) + column, b = a + 1, c = a + columns + 1, d = c + 1;
            if (row > 0) mesh.indices.insert(mesh.indices.end(), {a, b, d});
            if (row + 1 < rows) mesh.indices.insert(mesh.indices.end(), {a, d, c});
        }
    return mesh;
}

// MODEL.md sections 5 and 5.1: each face with coordinates along its remaining axes, in ascending order.
Mesh cuboid(const glm::dvec3& low, const glm::dvec3& high) {
    Mesh mesh;
    for (int axis = 0; axis < 3; ++axis) {
        const int first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
        if (low[first] == high[first] || low[second] == high[second]) continue;  // a flat one has two faces
        for (const bool upper : {false, true}) {
            const auto start = static_cast<std::uint32_t>(mesh.points.size());
            for (const auto& [u, v] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
                glm::dvec3 point = upper ? high : low;
                point[first] = u == 0 ? low[first] : high[first];
                point[second] = v == 0 ? low[second] : high[second];
                mesh.points.push_back(point);
                mesh.coordinates.emplace_back(u, v);
            }
            // first × second is +axis for x and z, −axis for y.
            const bool outward = upper == (axis != 1);
            const std::array<std::uint32_t, 6> corners = outward ? std::array<std::uint32_t, 6>{0, 1, 2, 0, 2, 3}
                                                                 : std::array<std::uint32_t, 6>{0, 2, 1, 0, 3, 2};
            for (const std::uint32_t corner : corners) mesh.indices.push_back(start + corner);
        }
    }
    return mesh;
}

Mesh triangles_of(const Scene& scene, const Entity& entity, bool smooth) {
    Mesh mesh;
    std::map<std::uint32_t, std::uint32_t> places;
    for (std::size_t p = 0; p < entity.primitive_count; ++p) {
        const Primitive& primitive = scene.primitives[entity.first_primitive + p];
        if (primitive.kind != PrimitiveKind::triangle) continue;
        bool has_normals = !scene.normals.empty();
        for (const std::uint32_t index : primitive.index)
            has_normals = has_normals && scene.normals[index] != glm::dvec3(0.0);
        if (has_normals != smooth) continue;
        for (const std::uint32_t index : primitive.index) {
            const auto [place, added] = places.emplace(index, static_cast<std::uint32_t>(mesh.points.size()));
            mesh.indices.push_back(place->second);
            if (!added) continue;
            mesh.points.push_back(scene.vertices[index]);
            if (smooth) mesh.normals.push_back(scene.normals[index]);
            if (!scene.texture_coordinates.empty()) mesh.coordinates.push_back(scene.texture_coordinates[index]);
        }
    }
    return mesh;
}

}  // namespace tandem::scene_export
