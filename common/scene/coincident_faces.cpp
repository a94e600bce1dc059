#include "common/scene/coincident_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <tuple>
#include <vector>

namespace tandem {

namespace {

using glm::dvec3;

struct Face {
    dvec3 normal;  // unit, of the two the one along `forwards`
    double offset, size;
    std::uint64_t body;
    bool passes;
};

bool lets_rays_through(const Material& material) {
    return material.translucent || material.kind == MaterialKind::boundary;
}

// normal: of any length. Two triangles of an entity are of one body unless they look in opposite directions.
void add_face(std::vector<Face>& faces, const dvec3& normal, const dvec3& point, double size, std::uint64_t body,
    bool passes, bool by_side) {
    const double length = glm::length(normal);
    if (!(length > 0.0) || !std::isfinite(length)) return;
    const dvec3 unit = normal / length, forwards(0.54, 0.62, 0.57);
    const double sense = glm::dot(unit, forwards);
    for (const double sign : {1.0, -1.0}) {
        if (sign * sense < -1e-3) continue;  // across `forwards`, both
        faces.push_back(
            {sign * unit, sign * glm::dot(unit, point), size, 2 * body + (by_side && sign < 0.0 ? 1 : 0), passes});
    }
}

dvec3 placed(const glm::dmat4& map, const dvec3& p) { return dvec3(map * glm::dvec4(p, 1.0)); }

std::vector<Face> faces_of(const Scene& scene) {
    std::vector<Face> faces;
    std::uint64_t body = scene.entities.size();
    for (const PlacedPrimitive place : placed_primitives(scene)) {
        const Entity& entity = scene.entities[place.entity];
        const Primitive& primitive = scene.primitives[place.primitive];
        const bool passes = lets_rays_through(scene.materials[entity.material]);
        const glm::dmat4& map = entity.object_to_world;
        if (primitive.kind == PrimitiveKind::sphere) continue;
        const dvec3 a = scene.vertices[primitive.index[0]], b = scene.vertices[primitive.index[1]];
        if (primitive.kind == PrimitiveKind::triangle) {
            const dvec3 p = placed(map, a), q = placed(map, b), r = placed(map, scene.vertices[primitive.index[2]]);
            add_face(faces, glm::cross(q - p, r - p), p,
                std::max({largest_coordinate(p), largest_coordinate(q), largest_coordinate(r)}), place.entity, passes,
                true);
            continue;
        }
        ++body;
        const glm::dmat3 normals = glm::transpose(glm::inverse(glm::dmat3(map)));
        const double size = std::max(largest_coordinate(placed(map, a)), largest_coordinate(placed(map, b))) +
                            largest_coordinate(placed(map, b) - placed(map, a));
        for (int axis = 0; axis < 3; ++axis)
            for (const dvec3& corner : {a, b})
                add_face(faces, normals[axis], placed(map, corner), size, body, passes, false);
    }
    return faces;
}

using Cell = std::array<std::int64_t, 3>;

// Whether several bodies, one of which lets rays through, have faces of one cell whose offsets follow each other
// closely.
bool has_meeting(const std::vector<Face>& faces, const std::vector<Cell>& cells) {
    std::vector<std::size_t> order(faces.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return std::tie(cells[a], faces[a].offset) < std::tie(cells[b], faces[b].offset);
    });
    bool passes = false, several = false;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const Face& face = faces[order[i]];
        const Face* before = i == 0 ? nullptr : &faces[order[i - 1]];
        const bool follows = before != nullptr && cells[order[i]] == cells[order[i - 1]] &&
                             face.offset - before->offset <= 0x1p-16 * std::max(face.size, before->size);
        passes = (follows && passes) || face.passes;
        several = follows && (several || face.body != before->body);
        if (passes && several) return true;
    }
    return false;
}

}  // namespace

bool passed_faces_coincide(const Scene& scene) {
    const auto is_passed = [&](const Entity& entity) { return lets_rays_through(scene.materials[entity.material]); };
    if (std::none_of(scene.entities.begin(), scene.entities.end(), is_passed)) return false;
    const std::vector<Face> faces = faces_of(scene);
    const auto passes = [](const Face& face) { return face.passes; };
    if (std::none_of(faces.begin(), faces.end(), passes)) return false;
    const auto moves = [](const Entity& entity) { return entity.motion != dvec3(0.0); };
    if (std::any_of(scene.entities.begin(), scene.entities.end(), moves)) return true;
    // Normals that are nearly the same are in one cell of some grid out of four, whichever borders three coordinates
    // lie on.
    for (const double shift : {0.0, 0.25, 0.5, 0.75}) {
        std::vector<Cell> cells;
        cells.reserve(faces.size());
        for (const Face& face : faces) {
            const dvec3 cell = glm::floor(1024.0 * face.normal + shift);
            cells.push_back({static_cast<std::int64_t>(cell.x), static_cast<std::int64_t>(cell.y),
                static_cast<std::int64_t>(cell.z)});
        }
        if (has_meeting(faces, cells)) return true;
    }
    return false;
}

}  // namespace tandem
