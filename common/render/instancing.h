// Instancing: meshes that a backend stores once, in object space, for all entities that place them (MODEL.md section
// 6).
#pragma once

#include <vector>

#include "common/render/renderer.h"

namespace tandem {

// A mesh is a range of triangles that several entities place: Scene::primitives [first, first + count).
struct PlacedMeshes {
    struct Mesh {
        std::uint32_t first = 0, count = 0;
    };
    std::vector<Mesh> meshes;
    std::vector<std::uint32_t> of_entity;  // by entity: the mesh that it places, or no_index: its primitives are placed

    [[nodiscard]] bool any() const { return !meshes.empty(); }
    [[nodiscard]] bool places(std::uint32_t entity) const { return any() && of_entity[entity] != no_index; }
};

// A mesh has at least 16 triangles and no other primitives. The entities that place it do not move and do not emit. No
// mesh is kept once in scenes with translucent or boundary surfaces, as rules 16 to 33 look at every face. Neither is
// one with triangle tests other than the watertight one, or with bidirectional paths. Automatic `instancing` needs
// meshes that together save at least 2^20 placed triangles.
[[nodiscard]] PlacedMeshes placed_meshes(const Scene& scene, const RenderSettings& settings);

}  // namespace tandem
