#include "cpu_ref/path_tracer/geometry/shading_normals.h"

namespace tandem::cpu {

using glm::dmat3;
using glm::dvec3;

ShadingNormalTable::ShadingNormalTable(const Scene& scene) {
    if (scene.normals.empty()) return;
    for (const PlacedPrimitive& placed : placed_primitives(scene)) {
        const Primitive& primitive = scene.primitives[placed.primitive];
        const bool smooth =
            primitive.kind == PrimitiveKind::triangle && scene.normals[primitive.index[0]] != dvec3(0.0);
        shape_of_.push_back(smooth ? static_cast<std::uint32_t>(shapes_.size()) : no_index);
        if (!smooth) continue;
        const glm::dmat4& to_world = scene.entities[placed.entity].object_to_world;
        const dmat3 linear(to_world), normal_to_world = glm::transpose(glm::inverse(linear));
        const auto vertex = [&](std::size_t i) { return scene.vertices[primitive.index[i]]; };
        Shape& shape = shapes_.emplace_back();
        shape.corner = dvec3(to_world * glm::dvec4(vertex(0), 1.0));
        shape.edge1 = linear * (vertex(1) - vertex(0));
        shape.edge2 = linear * (vertex(2) - vertex(0));
        for (std::size_t i = 0; i < 3; ++i) shape.normals[i] = normal_to_world * scene.normals[primitive.index[i]];
    }
}

std::optional<dvec3> ShadingNormalTable::at(std::uint32_t primitive, const dvec3& point, const dvec3& normal) const {
    if (shape_of_.empty() || shape_of_[primitive] == no_index) return std::nullopt;
    const Shape& shape = shapes_[shape_of_[primitive]];
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
