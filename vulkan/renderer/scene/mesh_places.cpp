#include "vulkan/renderer/scene/mesh_places.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "vulkan/renderer/scene/world_boxes.h"

namespace tandem {

namespace {

// The vertices of each mesh, each once.
std::vector<std::vector<std::uint32_t>> vertices_of(const Scene& scene, const PlacedMeshes& placed) {
    std::vector<std::vector<std::uint32_t>> result;
    for (const PlacedMeshes::Mesh& mesh : placed.meshes) {
        std::vector<std::uint32_t>& used = result.emplace_back();
        for (std::uint32_t i = 0; i < mesh.count; ++i)
            for (const std::uint32_t vertex : scene.primitives[mesh.first + i].index) used.push_back(vertex);
        std::ranges::sort(used);
        used.erase(std::unique(used.begin(), used.end()), used.end());
    }
    return result;
}

}  // namespace

std::vector<MeshPlace> mesh_places(const Scene& scene, const PlacedMeshes& placed) {
    const std::vector<std::vector<std::uint32_t>> vertices = vertices_of(scene, placed);
    std::vector<MeshPlace> places;
    for (std::uint32_t e = 0; e < scene.entities.size(); ++e) {
        if (!placed.places(e)) continue;
        const std::uint32_t mesh = placed.of_entity[e];
        const PointsBox points = box_of_points(scene, vertices[mesh], scene.entities[e].object_to_world);
        const auto reach = static_cast<float>(points.greatest);
        places.push_back({e, mesh, points.box, reach < points.greatest ? std::nextafterf(reach, INFINITY) : reach});
    }
    return places;
}

Box object_box(const Scene& scene, const Primitive& triangle) {
    Box box{glm::dvec3(INFINITY), glm::dvec3(-INFINITY)};
    for (const std::uint32_t index : triangle.index) {
        box.low = glm::min(box.low, scene.vertices[index]);
        box.high = glm::max(box.high, scene.vertices[index]);
    }
    return box;
}

}  // namespace tandem
