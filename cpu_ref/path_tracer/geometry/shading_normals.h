// The shading normals of meshes (MODEL.md section 5.4). Evaluated one point at a time, in double, as textures are.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "common/scene/scene.h"
#include "cpu_ref/path_tracer/geometry/mesh_table.h"

namespace tandem::cpu {

class ShadingNormalTable {
public:
    ShadingNormalTable() = default;
    ShadingNormalTable(const Scene& scene, std::shared_ptr<const MeshTable> meshes);

    // n_s at a point in world space (the motion of its entity taken out) of the primitive in that slot, whose normal
    // there is `normal`. Nothing where n_s is that.
    [[nodiscard]] std::optional<glm::dvec3> at(
        std::uint32_t primitive, const glm::dvec3& point, const glm::dvec3& normal) const;

private:
    // A triangle in world space; its corners' normals times one factor.
    struct Shape {
        glm::dvec3 corner, edge1, edge2;
        std::array<glm::dvec3, 3> normals;
    };
    [[nodiscard]] static std::optional<glm::dvec3> at(
        const Shape& shape, const glm::dvec3& point, const glm::dvec3& normal);
    [[nodiscard]] static Shape shape_of(
        const glm::dmat4& to_world, const std::array<glm::dvec3, 3>& corners, const std::array<glm::dvec3, 3>& normals);

    std::vector<Shape> shapes_;
    std::vector<std::uint32_t> shape_of_;  // by slot; no_index: flat
    std::shared_ptr<const MeshTable> meshes_;
    bool any_ = false;
};

}  // namespace tandem::cpu
