// Meshes that several entities place, each kept once in object space, and their places (common/render/instancing.h).
// Primitives are numbered by *slot*: those of all other entities in the order of their ids, then the places' triangles.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/render/instancing.h"
#include "cpu_ref/path_tracer/geometry/placed_triangle.h"

namespace tandem::cpu {

struct MeshTable {
    struct Mesh {
        std::uint32_t first = 0, count = 0;  // of `triangles`
        std::uint32_t first_vertex = 0, vertex_count = 0;
    };
    struct Place {
        std::uint32_t mesh = 0, entity = 0, material = 0, first_slot = 0;
        EntityMap map;
        glm::dvec3 low{0.0}, high{0.0};  // world
    };

    // At least one mesh. `placed` must be of the same scene.
    MeshTable(const Scene& scene, const PlacedMeshes& placed);

    [[nodiscard]] bool is_place(std::uint32_t entity) const { return place_entities[entity]; }
    [[nodiscard]] bool holds(std::uint32_t slot) const { return slot >= first_slot && slot - first_slot < count; }
    [[nodiscard]] const Place& place_of(std::uint32_t slot) const;
    [[nodiscard]] const std::array<std::uint32_t, 3>& indices_of(const Place& place, std::uint32_t slot) const {
        return triangles[meshes[place.mesh].first + slot - place.first_slot];
    }
    [[nodiscard]] Corners corners_of(const std::array<std::uint32_t, 3>& indices) const {
        return {vertices[indices[0]], vertices[indices[1]], vertices[indices[2]]};
    }
    // Primitive ids by slot, of the given entity, and back; no_primitive where there is none.
    [[nodiscard]] std::uint32_t id_of(std::uint32_t slot, std::uint32_t entity) const {
        return slot - first_slots[entity] + first_ids[entity];
    }
    [[nodiscard]] std::uint32_t slot_of(std::uint32_t id) const;

    std::vector<Mesh> meshes;
    std::vector<Place> places;                            // by ascending slot, which is by ascending id
    std::vector<std::array<std::uint32_t, 3>> triangles;  // by index into what follows
    std::vector<glm::dvec3> vertices, normals;            // normals: as many, or none
    std::vector<glm::dvec2> coordinates;                  // as many, or none
    std::uint32_t first_slot = 0, count = 0;              // of the places' triangles
    std::vector<std::uint32_t> first_slots, first_ids;    // by entity
    std::vector<bool> place_entities;                     // by entity: its triangles are a mesh's

private:
    void add_mesh(const Scene& scene, const PlacedMeshes::Mesh& mesh);
    void add_place(const Entity& entity, std::uint32_t index, std::uint32_t mesh);
};

}  // namespace tandem::cpu
