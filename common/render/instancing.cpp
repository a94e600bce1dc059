#include "common/render/instancing.h"

#include <algorithm>
#include <map>
#include <utility>

namespace tandem {

namespace {

constexpr std::uint32_t fewest_triangles = 16;                  // below, a place takes more than its triangles
constexpr std::uint64_t fewest_saved = std::uint64_t{1} << 20;  // of placed triangles

bool lets_rays_through(const Material& material) {
    return material.translucent || material.kind == MaterialKind::boundary;
}

bool all_triangles(const Scene& scene, std::uint32_t first, std::uint32_t count) {
    const auto begin = scene.primitives.begin() + first;
    return std::all_of(
        begin, begin + count, [](const Primitive& primitive) { return primitive.kind == PrimitiveKind::triangle; });
}

bool can_share(const Scene& scene, const Entity& entity) {
    return entity.primitive_count >= fewest_triangles && entity.motion == glm::dvec3(0.0) &&
           scene.materials[entity.material].radiance == glm::dvec3(0.0);
}

bool any_passed(const Scene& scene) {
    return std::ranges::any_of(
        scene.entities, [&](const Entity& entity) { return lets_rays_through(scene.materials[entity.material]); });
}

}  // namespace

PlacedMeshes placed_meshes(const Scene& scene, const RenderSettings& settings) {
    PlacedMeshes result;
    if (settings.instancing == Instancing::never || settings.integrator == Integrator::bidirectional ||
        settings.intersection.triangles != TriangleKernel::watertight)
        return result;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> users;
    for (const Entity& entity : scene.entities)
        if (can_share(scene, entity)) ++users[{entity.first_primitive, entity.primitive_count}];
    std::erase_if(users,
        [&](const auto& one) { return one.second < 2 || !all_triangles(scene, one.first.first, one.first.second); });
    std::uint64_t saved = 0;
    for (const auto& [range, count] : users) saved += std::uint64_t{range.second} * (count - 1);
    if (users.empty() || (settings.instancing == Instancing::automatic && saved < fewest_saved) || any_passed(scene))
        return result;
    for (auto& [range, mesh] : users) {
        mesh = static_cast<std::uint32_t>(result.meshes.size());
        result.meshes.push_back({range.first, range.second});
    }
    result.of_entity.assign(scene.entities.size(), no_index);
    for (std::size_t i = 0; i < scene.entities.size(); ++i) {
        const Entity& entity = scene.entities[i];
        const auto mesh = users.find({entity.first_primitive, entity.primitive_count});
        if (mesh != users.end() && can_share(scene, entity)) result.of_entity[i] = mesh->second;
    }
    return result;
}

}  // namespace tandem
