#include "vulkan/renderer/scene/scene_data.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <utility>

#include "common/error.h"
#include "common/stopwatch.h"
#include "vulkan/renderer/scene/light_table.h"
#include "vulkan/renderer/scene/mesh_places.h"
#include "vulkan/renderer/scene/world_boxes.h"

namespace tandem {

namespace {

template <class Real>
gpu::Vec4Of<Real> rounded_four(const glm::dvec3& v, double w) {
    return {static_cast<Real>(v.x), static_cast<Real>(v.y), static_cast<Real>(v.z), static_cast<Real>(w)};
}

gpu::Material flatten(const Material& material, EffectSet needed) {
    gpu::Material result;
    result.colour = gpu::rounded<float>(material.colour);
    result.alpha = static_cast<float>(material.alpha);
    result.radiance = gpu::rounded<float>(material.radiance);
    result.fuzz = static_cast<float>(material.fuzz);
    result.refractive_index = static_cast<float>(material.refractive_index);
    result.roughness = static_cast<float>(material.roughness);
    result.eta = gpu::rounded<float>(material.eta);
    result.k = gpu::rounded<float>(material.k);
    result.colour_texture = material.colour_texture;
    if (needed.has(Effect::medium_absorption)) result.interior = material.interior;
    result.priority = material.priority.value_or(0);
    const bool tracked = material.interior != no_index || material.priority;
    result.kind = static_cast<std::uint32_t>(material.kind);
    result.flags = (material.translucent ? gpu::flag_translucent : 0) |
                   (material.fresnel == Fresnel::schlick ? gpu::flag_schlick : 0) |
                   (material.sides == EmittingSides::front ? gpu::flag_front_only : 0) |
                   (tracked ? gpu::flag_tracked : 0);
    return result;
}

bool has_passing_emission(const Scene& scene) {
    return std::ranges::any_of(scene.entities, [&](const Entity& entity) {
        const Material& material = scene.materials[entity.material];
        const bool ends_path = material.kind == MaterialKind::emissive && !material.translucent;
        return material.radiance != glm::dvec3(0.0) && !ends_path;
    });
}

// The diagonal of the box around everything.
double extent_of(const Scene& scene, const PlacedMeshes& placed, const std::vector<MeshPlace>& places) {
    Box all{glm::dvec3(INFINITY), glm::dvec3(-INFINITY)};
    for (std::uint32_t e = 0; e < scene.entities.size(); ++e) {
        const Entity& entity = scene.entities[e];
        for (std::uint32_t i = 0; i < (placed.places(e) ? 0 : entity.primitive_count); ++i) {
            const Box box = world_box(scene, {e, entity.first_primitive + i});
            all = {glm::min(all.low, box.low), glm::max(all.high, box.high)};
        }
    }
    for (const MeshPlace& place : places) all = {glm::min(all.low, place.box.low), glm::max(all.high, place.box.high)};
    return all.low.x <= all.high.x ? glm::length(all.high - all.low) : 0.0;
}

void add_body(SceneData& data, std::uint32_t material, bool triangles) {
    std::uint32_t& bodies = data.materials[material].bodies;
    if (triangles) bodies = gpu::no_index;
    if (bodies != gpu::no_index) ++bodies;
}

// Slots: triangles, spheres, cuboids, in id order within a kind.
void place_primitives(const Scene& scene, const PlacedMeshes& placed, SceneData& data) {
    const PlacedPrimitives all = placed_primitives(scene);
    if (all.size() >= (1u << 27) - 8)
        throw UnsupportedError("the Vulkan renderer numbers primitives with 27 bits; use fewer than 134 million");
    for (const PrimitiveKind kind : {PrimitiveKind::triangle, PrimitiveKind::sphere, PrimitiveKind::cuboid}) {
        const std::size_t before = data.sources.size();
        for (std::uint32_t e = 0; e < scene.entities.size(); ++e) {
            const Entity& entity = scene.entities[e];
            for (std::uint32_t i = 0; i < (placed.places(e) ? 0 : entity.primitive_count); ++i) {
                const Primitive& primitive = scene.primitives[entity.first_primitive + i];
                if (primitive.kind != kind) continue;
                data.sources.push_back({static_cast<std::uint32_t>(kind), primitive.index[0], primitive.index[1],
                    primitive.index[2], e, static_cast<float>(primitive.radius)});
                add_body(data, entity.material, kind == PrimitiveKind::triangle);
                data.placed.push_back({all.first_of(e) + i, entity.material, e, gpu::no_light});
            }
        }
        const auto count = static_cast<std::uint32_t>(data.sources.size() - before);
        (kind == PrimitiveKind::triangle    ? data.triangle_count
            : kind == PrimitiveKind::sphere ? data.sphere_count
                                            : data.cuboid_count) = count;
    }
}

// Sources and Placed of places, then the sources of the meshes' triangles; roots are set when trees have grown.
void place_meshes(
    const Scene& scene, const PlacedMeshes& placed, const std::vector<MeshPlace>& places, SceneData& data) {
    const PlacedPrimitives all = placed_primitives(scene);
    SceneMeshes& meshes = data.meshes;
    meshes.first_slot = data.primitives();
    meshes.places = static_cast<std::uint32_t>(places.size());
    std::vector<std::uint32_t> first_sources;
    std::uint32_t next = meshes.first_slot + meshes.places, slot = meshes.first_slot;
    for (const PlacedMeshes::Mesh& mesh : placed.meshes)
        first_sources.push_back(std::exchange(next, next + mesh.count));
    meshes.triangles = next - meshes.first_slot - meshes.places;
    for (const MeshPlace& place : places) {
        const Entity& entity = scene.entities[place.entity];
        data.sources.push_back({0, first_sources[place.mesh], slot, 0, place.entity, place.reach});
        data.placed.push_back({all.first_of(place.entity), entity.material, place.entity, gpu::no_light});
        add_body(data, entity.material, true);
        slot += entity.primitive_count;
        for (const glm::dvec3& corner : {place.box.low, place.box.high})
            meshes.reach = std::max({meshes.reach, std::abs(corner.x), std::abs(corner.y), std::abs(corner.z)});
    }
    meshes.placed_triangles = slot - meshes.first_slot;
    for (const PlacedMeshes::Mesh& mesh : placed.meshes)
        for (std::uint32_t i = 0; i < mesh.count; ++i) {
            const auto& index = scene.primitives[mesh.first + i].index;
            data.sources.push_back({0, index[0], index[1], index[2], 0, 0.0F});
        }
}

// A tree for each mesh, in object space, then one over their places.
void grow_mesh_trees(const Scene& scene, const PlacedMeshes& placed, const std::vector<MeshPlace>& places,
    HierarchyQuality quality, SceneData& data) {
    std::vector<std::uint32_t> roots;
    std::vector<Box> boxes;
    for (const PlacedMeshes::Mesh& mesh : placed.meshes) {
        boxes.clear();
        for (std::uint32_t i = 0; i < mesh.count; ++i)
            boxes.push_back(object_box(scene, scene.primitives[mesh.first + i]));
        roots.push_back(build_bvh(boxes, data.trees.nodes, quality));
    }
    boxes.clear();
    for (std::size_t i = 0; i < places.size(); ++i) {
        boxes.push_back(places[i].box);
        data.sources[data.meshes.first_slot + i].kind = roots[places[i].mesh];
    }
    data.trees.meshes = build_bvh(boxes, data.trees.nodes, quality);
}

// From so many primitives of a kind on, a tree is used. Lavapipe renders a mesh of 98 triangles in 22 ms a sample by
// the tree, in 37 ms by the loop. The crossover below that has not been measured.
constexpr std::uint32_t fewest_in_tree = 64;

SceneTrees grow_trees(const Scene& scene, const SceneData& data, Acceleration acceleration, HierarchyQuality quality) {
    SceneTrees trees;
    if (acceleration == Acceleration::loops) return trees;
    const std::uint32_t fewest = acceleration == Acceleration::trees ? 1 : fewest_in_tree;
    const PlacedPrimitives all = placed_primitives(scene);
    std::uint32_t first = 0;
    const auto grow = [&](std::uint32_t count) -> std::optional<std::uint32_t> {
        const std::uint32_t begin = std::exchange(first, first + count);
        if (count < fewest) return std::nullopt;
        std::vector<Box> boxes;
        for (std::uint32_t slot = begin; slot < first; ++slot)
            boxes.push_back(world_box(scene, all[data.placed[slot].id]));
        return build_bvh(boxes, trees.nodes, quality);
    };
    trees.triangles = grow(data.triangle_count);
    trees.spheres = grow(data.sphere_count);
    trees.cuboids = grow(data.cuboid_count);
    return trees;
}

}  // namespace

template <class Real>
gpu::CameraOf<Real> flatten_camera(const Camera& camera, const RenderSettings& settings) {
    const glm::dvec3 view = camera.target - camera.position, moved = camera.target_motion - camera.position_motion;
    const glm::dvec3 f = glm::normalize(view), r = glm::normalize(glm::cross(view, camera.up)), v = glm::cross(r, f);
    const double h = std::tan(glm::radians(camera.vertical_field_degrees) / 2.0);
    gpu::CameraOf<Real> result;
    result.position = gpu::rounded<Real>(camera.position);
    result.lens_radius = static_cast<Real>(camera.lens_radius);
    result.forward = gpu::rounded<Real>(f);
    result.focus_distance = static_cast<Real>(camera.focus_distance);
    result.film_width = static_cast<Real>(h * settings.width / settings.height);
    result.film_height = static_cast<Real>(h);
    result.film_right = gpu::rounded<Real>(h * settings.width / settings.height * r);
    result.film_up = gpu::rounded<Real>(h * v);
    result.right = gpu::rounded<Real>(r);
    result.up = gpu::rounded<Real>(v);
    result.moves = camera.position_motion != glm::dvec3(0.0) || camera.target_motion != glm::dvec3(0.0);
    result.view = gpu::rounded<Real>(view);
    result.scene_up = gpu::rounded<Real>(glm::normalize(camera.up));
    result.position_motion = gpu::rounded<Real>(camera.position_motion);
    result.view_motion = gpu::rounded<Real>(moved);
    return result;
}

template <class Real>
gpu::EntityTransformOf<Real> flatten_transform(const Entity& entity) {
    const glm::dmat4& m = entity.object_to_world;
    const glm::dmat3 linear(m);
    const glm::dmat3 inverse = glm::inverse(linear);
    const auto row = [&](int i) { return rounded_four<Real>(glm::dvec3(m[0][i], m[1][i], m[2][i]), m[3][i]); };
    const auto inverse_row = [&](int i) {
        return gpu::rounded<Real>(glm::dvec3(inverse[0][i], inverse[1][i], inverse[2][i]));
    };
    gpu::EntityTransformOf<Real> result;
    result.to_world0 = row(0);
    result.to_world1 = row(1);
    result.to_world2 = row(2);
    result.to_object0 = inverse_row(0);
    result.to_object1 = inverse_row(1);
    result.to_object2 = inverse_row(2);
    result.motion = gpu::rounded<Real>(entity.motion);
    result.determinant_sign = glm::determinant(linear) < 0.0 ? Real(-1) : Real(1);
    return result;
}

template gpu::Camera flatten_camera<float>(const Camera&, const RenderSettings&);
template gpu::DoubleCamera flatten_camera<double>(const Camera&, const RenderSettings&);
template gpu::EntityTransform flatten_transform<float>(const Entity&);
template gpu::DoubleEntityTransform flatten_transform<double>(const Entity&);

SceneData flatten(const Scene& scene, const RenderSettings& settings, Acceleration acceleration) {
    const EffectSet needed = needed_effects(scene, settings);
    if (needed.has(Effect::interiors) && scene.materials.size() >= 0xffff)
        throw UnsupportedError(
            "the Vulkan renderer tells bodies with an interior apart by 16 bits; use fewer materials");
    SceneData data;
    const PlacedMeshes placed = acceleration == Acceleration::loops ? PlacedMeshes{} : placed_meshes(scene, settings);
    const std::vector<MeshPlace> places = mesh_places(scene, placed);
    data.header.background_down = gpu::rounded<float>(scene.background.down);
    data.header.background_up = gpu::rounded<float>(scene.background.up);
    data.header.extent = static_cast<float>(extent_of(scene, placed, places));
    if (needed.has(Effect::medium_absorption)) data.header.medium = scene.medium;
    data.camera = flatten_camera<float>(scene.camera, settings);
    for (const glm::dvec3& vertex : scene.vertices) data.vertices.push_back(rounded_four<float>(vertex, 1.0));
    for (const Entity& entity : scene.entities) data.transforms.push_back(flatten_transform<float>(entity));
    for (const Material& material : scene.materials) data.materials.push_back(flatten(material, needed));
    place_primitives(scene, placed, data);
    const bool samples_background = needed.has(Effect::sampled_background);
    LightTable<float> lights;
    if (needed.has(Effect::light_sampling))
        lights = make_light_table<float>(scene, data.placed, samples_background, settings.light_sampling);
    data.lights = std::move(lights.lights);
    for (std::uint32_t i = 0; i < data.lights.size(); ++i)
        if (data.lights[i].slot != gpu::no_index) data.placed[data.lights[i].slot].light = i;
    if (samples_background) data.header.background_probability = data.lights.back().probability;
    if (placed.any()) place_meshes(scene, placed, places, data);
    const std::span<const gpu::PrimitiveSource> sources(data.sources);
    data.tables =
        make_scene_tables(scene, needed, {sources.first(data.triangle_count), sources.last(data.meshes.triangles)});
    if (lights.tree_leaves > 0)
        data.light_tree = {lights.tree_leaves, append_numbers(data.tables, "light-tree", lights.tree_nodes)};
    data.header.environment = data.tables.environment;
    data.header.texture_coordinates = data.tables.texture_coordinates;
    data.header.shading_normals = data.tables.shading_normals;
    const Stopwatch watch;
    data.trees = grow_trees(scene, data, acceleration, settings.hierarchy);
    if (placed.any()) grow_mesh_trees(scene, placed, places, settings.hierarchy, data);
    if (!data.trees.nodes.empty()) data.trees.seconds = watch.seconds();
    data.passing_emission = has_passing_emission(scene);
    return data;
}

}  // namespace tandem
