#include "cpu_ref/path_tracer/geometry/shading_normals.h"

#include <utility>

namespace tandem::cpu {

using glm::dmat3;
using glm::dvec3;

ShadingNormalTable::ShadingNormalTable(const Scene& scene, std::shared_ptr<const MeshTable> meshes)
    : meshes_(std::move(meshes)), any_(!scene.normals.empty()) {
    if (!any_) return;
    for (const PlacedPrimitive placed : placed_primitives(scene)) {
        if (meshes_ && meshes_->is_place(placed.entity)) continue;
        const Primitive& primitive = scene.primitives[placed.primitive];
        const bool smooth =
            primitive.kind == PrimitiveKind::triangle && scene.normals[primitive.index[0]] != dvec3(0.0);
        shape_of_.push_back(smooth ? static_cast<std::uint32_t>(shapes_.size()) : no_index);
        if (!smooth) continue;
        std::array<dvec3, 3> corners, normals;
        for (std::size_t i = 0; i < 3; ++i) {
            corners[i] = scene.vertices[primitive.index[i]];
            normals[i] = scene.normals[primitive.index[i]];
        }
        shapes_.push_back(shape_of(scene.entities[placed.entity].object_to_world, corners, normals));
    }
}

ShadingNormalTable::Shape ShadingNormalTable::shape_of(
    const glm::dmat4& to_world, const std::array<dvec3, 3>& corners, const std::array<dvec3, 3>& normals) {
    const dmat3 linear(to_world), normal_to_world = glm::transpose(glm::inverse(linear));
    Shape shape;
    shape.corner = dvec3(to_world * glm::dvec4(corners[0], 1.0));
    shape.edge1 = linear * (corners[1] - corners[0]);
    shape.edge2 = linear * (corners[2] - corners[0]);
    for (std::size_t i = 0; i < 3; ++i) shape.normals[i] = normal_to_world * normals[i];
    return shape;
}

std::optional<dvec3> ShadingNormalTable::at(std::uint32_t primitive, const dvec3& point, const dvec3& normal) const {
    if (!any_) return std::nullopt;
    if (meshes_ && meshes_->holds(primitive)) {
        const MeshTable::Place& place = meshes_->place_of(primitive);
        const std::array<std::uint32_t, 3>& indices = meshes_->indices_of(place, primitive);
        std::array<dvec3, 3> normals;
        for (std::size_t i = 0; i < 3; ++i) normals[i] = meshes_->normals[indices[i]];
        if (normals[0] == dvec3(0.0)) return std::nullopt;
        const glm::dmat4 to_world(glm::dvec4(place.map.linear[0], 0.0), glm::dvec4(place.map.linear[1], 0.0),
            glm::dvec4(place.map.linear[2], 0.0), glm::dvec4(place.map.shift, 1.0));
        return at(shape_of(to_world, meshes_->corners_of(indices), normals), point, normal);
    }
    if (shape_of_[primitive] == no_index) return std::nullopt;
    return at(shapes_[shape_of_[primitive]], point, normal);
}

std::optional<dvec3> ShadingNormalTable::at(const Shape& shape, const dvec3& point, const dvec3& normal) {
    // Weights of corners 1 and 2: areas against the whole, along its normal.
    const dvec3 offset = point - shape.corner, whole = glm::cross(shape.edge1, shape.edge2);
    const double scale = 1.0 / glm::dot(whole, whole);
    const double w1 = glm::dot(glm::cross(offset, shape.edge2), whole) * scale;
    const double w2 = glm::dot(glm::cross(shape.edge1, offset), whole) * scale;
    const dvec3 sum = (1.0 - w1 - w2) * shape.normals[0] + w1 * shape.normals[1] + w2 * shape.normals[2];
    const double along = glm::dot(sum, normal);
    if (!(along != 0.0)) return std::nullopt;
    return glm::normalize(along < 0.0 ? -sum : sum);
}

}  // namespace tandem::cpu
