#include "cpu_ref/path_tracer/geometry/mesh_table.h"

#include <algorithm>
#include <limits>

namespace tandem::cpu {

MeshTable::MeshTable(const Scene& scene, const PlacedMeshes& placed) {
    for (const PlacedMeshes::Mesh& mesh : placed.meshes) add_mesh(scene, mesh);
    std::uint32_t id = 0;
    for (std::uint32_t e = 0; e < scene.entities.size(); ++e) {
        first_ids.push_back(id);
        first_slots.push_back(first_slot);
        id += scene.entities[e].primitive_count;
        place_entities.push_back(placed.places(e));
        if (!placed.places(e)) first_slot += scene.entities[e].primitive_count;
    }
    for (std::uint32_t e = 0; e < scene.entities.size(); ++e)
        if (placed.places(e)) add_place(scene.entities[e], e, placed.of_entity[e]);
}

void MeshTable::add_mesh(const Scene& scene, const PlacedMeshes::Mesh& mesh) {
    Mesh& added = meshes.emplace_back();
    added.first = static_cast<std::uint32_t>(triangles.size());
    added.count = mesh.count;
    added.first_vertex = static_cast<std::uint32_t>(vertices.size());
    std::vector<std::uint32_t> used;
    used.reserve(std::size_t{3} * mesh.count);
    for (std::uint32_t i = 0; i < mesh.count; ++i) {
        const auto& index = scene.primitives[mesh.first + i].index;
        used.insert(used.end(), index.begin(), index.end());
    }
    std::ranges::sort(used);
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (const std::uint32_t vertex : used) {
        vertices.push_back(scene.vertices[vertex]);
        if (!scene.normals.empty()) normals.push_back(scene.normals[vertex]);
        if (!scene.texture_coordinates.empty()) coordinates.push_back(scene.texture_coordinates[vertex]);
    }
    added.vertex_count = static_cast<std::uint32_t>(used.size());
    for (std::uint32_t i = 0; i < mesh.count; ++i) {
        std::array<std::uint32_t, 3>& triangle = triangles.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            const auto at = std::ranges::lower_bound(used, scene.primitives[mesh.first + i].index[k]);
            triangle[k] = added.first_vertex + static_cast<std::uint32_t>(at - used.begin());
        }
    }
}

void MeshTable::add_place(const Entity& entity, std::uint32_t index, std::uint32_t mesh) {
    first_slots[index] = first_slot + count;
    Place place{mesh, index, entity.material, first_slot + count, entity_map(entity.object_to_world)};
    count += entity.primitive_count;
    place.low = glm::dvec3(std::numeric_limits<double>::infinity());
    place.high = -place.low;
    const Mesh& of = meshes[mesh];
    for (std::uint32_t i = 0; i < of.vertex_count; ++i) {
        const glm::dvec3 corner = place.map.to_world(vertices[of.first_vertex + i]);
        place.low = glm::min(place.low, corner);
        place.high = glm::max(place.high, corner);
    }
    places.push_back(place);
}

const MeshTable::Place& MeshTable::place_of(std::uint32_t slot) const {
    return *(std::ranges::upper_bound(places, slot, {}, &Place::first_slot) - 1);
}

std::uint32_t MeshTable::slot_of(std::uint32_t id) const {
    if (id >= first_slot + count) return no_primitive;
    // An entity without primitives shares its first id with the next one, which is the last of those that do.
    const auto entity = static_cast<std::size_t>(std::ranges::upper_bound(first_ids, id) - first_ids.begin()) - 1;
    return first_slots[entity] + (id - first_ids[entity]);
}

}  // namespace tandem::cpu
