// Colours that vary over surfaces (MODEL.md sections 5.1 and 7.0). Evaluated one point at a time, in double: textures
// are rare, and their cells and hashes gain nothing from lanes.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "common/scene/scene.h"
#include "cpu_ref/path_tracer/geometry/mesh_table.h"

namespace tandem::cpu {

// The hash of Jarzynski and Olano, "Hash functions for GPU rendering", JCGT 9(3), 2020.
[[nodiscard]] std::array<std::uint32_t, 3> pcg3d(std::array<std::uint32_t, 3> v);

// Gradient noise N of section 7.0, in about [-1, 1].
[[nodiscard]] double gradient_noise(const glm::dvec3& q, std::uint32_t seed);

// Bilinear value at (u, v), v upwards; columns repeat, rows repeat or are held at the first and last.
enum class Rows { repeated, held };
[[nodiscard]] glm::dvec3 bilinear(const Pixels& image, double u, double v, Rows rows);

// The colour of `texture` at a point in object space with texture coordinates.
[[nodiscard]] glm::dvec3 texture_colour(
    const Texture& texture, const glm::dvec3& object_point, const glm::dvec2& coordinates);

// The textures of a scene with the geometry that they lie on; owns what it needs of the scene.
class TextureTable {
public:
    TextureTable() = default;
    TextureTable(const Scene& scene, std::shared_ptr<const MeshTable> meshes);

    // At a point in world space (the motion of its entity taken out) of the primitive in that slot. `face` counts
    // within the primitive: cuboids have six, -x +x -y +y -z +z.
    [[nodiscard]] glm::dvec3 colour(std::uint32_t primitive, unsigned face, const glm::dvec3& point) const;
    // Section 5.1.
    [[nodiscard]] glm::dvec2 coordinates(std::uint32_t primitive, unsigned face, const glm::dvec3& object_point) const;

private:
    // points: a triangle's corners, a sphere's centre, a cuboid's corners.
    struct Shape {
        PrimitiveKind kind = PrimitiveKind::triangle;
        std::uint32_t entity = 0;
        std::array<glm::dvec3, 3> points{};
        std::array<glm::dvec2, 3> coordinates{};
    };
    struct Placement {
        std::uint32_t texture = no_index;
        glm::dmat4 world_to_object{1.0};
    };
    [[nodiscard]] bool in_mesh(std::uint32_t slot) const { return meshes_ && meshes_->holds(slot); }
    [[nodiscard]] Shape shape_of_mesh(std::uint32_t slot) const;
    [[nodiscard]] static glm::dvec2 coordinates(const Shape& shape, unsigned face, const glm::dvec3& object_point);

    std::vector<Texture> textures_;
    std::vector<Shape> shapes_;        // by slot; those without a texture keep their defaults
    std::vector<Placement> entities_;  // by entity
    std::shared_ptr<const MeshTable> meshes_;
};

}  // namespace tandem::cpu
