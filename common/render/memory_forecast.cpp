#include "common/render/memory_forecast.h"

#include <algorithm>

namespace tandem {

namespace {

std::uint64_t distinct_vertices(const Scene& scene, const PlacedMeshes::Mesh& mesh) {
    std::vector<bool> used(scene.vertices.size());
    for (std::uint32_t i = 0; i < mesh.count; ++i)
        for (const std::uint32_t vertex : scene.primitives[mesh.first + i].index) used[vertex] = true;
    return static_cast<std::uint64_t>(std::ranges::count(used, true));
}

}  // namespace

// An entity's primitives are counted once for all that share their range.
PlacedCounts placed_counts(const Scene& scene, const PlacedMeshes& meshes) {
    // Before each primitive: how many there are of a kind.
    std::vector<std::uint32_t> spheres(1, 0), cuboids(1, 0);
    spheres.reserve(scene.primitives.size() + 1);
    cuboids.reserve(scene.primitives.size() + 1);
    for (const Primitive& primitive : scene.primitives) {
        spheres.push_back(spheres.back() + (primitive.kind == PrimitiveKind::sphere ? 1 : 0));
        cuboids.push_back(cuboids.back() + (primitive.kind == PrimitiveKind::cuboid ? 1 : 0));
    }
    PlacedCounts counts;
    for (std::uint32_t e = 0; e < scene.entities.size(); ++e) {
        if (meshes.places(e)) {
            ++counts.places;
            continue;
        }
        const Entity& entity = scene.entities[e];
        const std::size_t begin = entity.first_primitive, end = begin + entity.primitive_count;
        const std::uint64_t round = spheres[end] - spheres[begin], boxes = cuboids[end] - cuboids[begin];
        counts.spheres += round;
        counts.cuboids += boxes;
        counts.triangles += entity.primitive_count - round - boxes;
    }
    for (const PlacedMeshes::Mesh& mesh : meshes.meshes) {
        counts.mesh_triangles += mesh.count;
        counts.mesh_vertices += distinct_vertices(scene, mesh);
    }
    return counts;
}

}  // namespace tandem
