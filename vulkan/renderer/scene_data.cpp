#include "vulkan/renderer/scene_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <utility>

#include "common/error.h"
#include "vulkan/renderer/light_table.h"
#include "vulkan/renderer/world_boxes.h"

namespace tandem {

namespace {

gpu::Vec3 to_float(const glm::dvec3& v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

gpu::Vec4 to_float(const glm::dvec3& v, double w) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), static_cast<float>(w)};
}

// MODEL.md section 4.
gpu::Camera flatten(const Camera& camera, const RenderSettings& settings) {
    const glm::dvec3 view = camera.target - camera.position;
    const glm::dvec3 side = glm::cross(view, camera.up);
    // Below this the frame's axes are rounding noise.
    if (!(glm::length(side) > 1e-12 * glm::length(view) * glm::length(camera.up)))
        throw InputError(
            "the camera has no frame: its target is its position or its up vector is along its view; move one");
    const glm::dvec3 f = glm::normalize(view), r = glm::normalize(side), v = glm::cross(r, f);
    const double h = std::tan(glm::radians(camera.vertical_field_degrees) / 2.0);
    gpu::Camera result;
    result.position = to_float(camera.position);
    result.lens_radius = static_cast<float>(camera.lens_radius);
    result.forward = to_float(f);
    result.focus_distance = static_cast<float>(camera.focus_distance);
    result.film_right = to_float(h * settings.width / settings.height * r);
    result.film_up = to_float(h * v);
    result.right = to_float(r);
    result.up = to_float(v);
    return result;
}

gpu::Material flatten(const Material& material) {
    gpu::Material result;
    result.colour = to_float(material.colour);
    result.alpha = static_cast<float>(material.alpha);
    result.radiance = to_float(material.radiance);
    result.fuzz = static_cast<float>(material.fuzz);
    result.refractive_index = static_cast<float>(material.refractive_index);
    result.kind = static_cast<std::uint32_t>(material.kind);
    result.flags = (material.translucent ? gpu::flag_translucent : 0) |
                   (material.fresnel == Fresnel::schlick ? gpu::flag_schlick : 0) |
                   (material.sides == EmittingSides::front ? gpu::flag_front_only : 0);
    // Squares of samples are summed in float pairs, whose exponent ends at 1.8e19 squared.
    constexpr double brightest = 1e15;
    for (int channel = 0; channel < 3; ++channel)
        if (material.radiance[channel] > brightest)
            throw UnsupportedError(
                fmt::format("material '{}': the Vulkan renderer sums squares in float pairs and takes "
                            "radiance up to {:g}; scale the scene's radiances down",
                    material.name, brightest));
    return result;
}

gpu::EntityTransform flatten(const glm::dmat4& m) {
    const glm::dmat3 linear(m);
    const glm::dmat3 inverse = glm::inverse(linear);
    const auto row = [&](int i) { return to_float(glm::dvec3(m[0][i], m[1][i], m[2][i]), m[3][i]); };
    const auto inverse_row = [&](int i) { return to_float(glm::dvec3(inverse[0][i], inverse[1][i], inverse[2][i])); };
    gpu::EntityTransform result;
    result.to_world0 = row(0);
    result.to_world1 = row(1);
    result.to_world2 = row(2);
    result.to_object0 = inverse_row(0);
    result.to_object1 = inverse_row(1);
    result.to_object2 = inverse_row(2);
    result.determinant_sign = glm::determinant(linear) < 0.0 ? -1.0f : 1.0f;
    return result;
}

bool has_passing_emission(const Scene& scene) {
    return std::ranges::any_of(scene.entities, [&](const Entity& entity) {
        const Material& material = scene.materials[entity.material];
        const bool ends_path = material.kind == MaterialKind::emissive && !material.translucent;
        return material.radiance != glm::dvec3(0.0) && !ends_path;
    });
}

double extent_of(const Scene& scene) {
    glm::dvec3 low(0.0), high(0.0);
    bool first = true;
    for (const PlacedPrimitive& placed : placed_primitives(scene)) {
        const Primitive& primitive = scene.primitives[placed.primitive];
        for (const std::uint32_t index : primitive.index) {
            const glm::dvec3 p(scene.entities[placed.entity].object_to_world * glm::dvec4(scene.vertices[index], 1.0));
            low = first ? p : glm::min(low, p);
            high = first ? p : glm::max(high, p);
            first = false;
            if (primitive.kind == PrimitiveKind::sphere) break;
        }
    }
    return std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

// Slots: triangles, spheres, cuboids, in id order within a kind.
void place_primitives(const Scene& scene, SceneData& data) {
    const std::vector<PlacedPrimitive> all = placed_primitives(scene);
    if (all.size() >= (1u << 27) - 8)
        throw UnsupportedError("the Vulkan renderer numbers primitives with 27 bits; use fewer than 134 million");
    for (const PrimitiveKind kind : {PrimitiveKind::triangle, PrimitiveKind::sphere, PrimitiveKind::cuboid}) {
        const std::size_t before = data.sources.size();
        for (std::uint32_t id = 0; id < all.size(); ++id) {
            const Primitive& primitive = scene.primitives[all[id].primitive];
            if (primitive.kind != kind) continue;
            data.sources.push_back({static_cast<std::uint32_t>(kind), primitive.index[0], primitive.index[1],
                primitive.index[2], all[id].entity, static_cast<float>(primitive.radius)});
            data.placed.push_back({id, scene.entities[all[id].entity].material, all[id].entity, gpu::no_light});
        }
        const auto count = static_cast<std::uint32_t>(data.sources.size() - before);
        (kind == PrimitiveKind::triangle    ? data.triangle_count
            : kind == PrimitiveKind::sphere ? data.sphere_count
                                            : data.cuboid_count) = count;
    }
}

// From so many primitives of a kind on, a tree is used. Lavapipe renders a mesh of 98 triangles in 22 ms a sample by
// the tree, in 37 ms by the loop; the crossover below that has not been measured.
constexpr std::uint32_t fewest_in_tree = 64;

SceneTrees grow_trees(const Scene& scene, const SceneData& data, Acceleration acceleration) {
    SceneTrees trees;
    if (acceleration == Acceleration::loops) return trees;
    const std::uint32_t fewest = acceleration == Acceleration::trees ? 1 : fewest_in_tree;
    const std::vector<PlacedPrimitive> all = placed_primitives(scene);
    std::uint32_t first = 0;
    const auto grow = [&](std::uint32_t count) -> std::optional<std::uint32_t> {
        const std::uint32_t begin = std::exchange(first, first + count);
        if (count < fewest) return std::nullopt;
        std::vector<Box> boxes;
        for (std::uint32_t slot = begin; slot < first; ++slot)
            boxes.push_back(world_box(scene, all[data.placed[slot].id]));
        return build_bvh(boxes, trees.nodes);
    };
    trees.triangles = grow(data.triangle_count);
    trees.spheres = grow(data.sphere_count);
    trees.cuboids = grow(data.cuboid_count);
    return trees;
}

}  // namespace

SceneData flatten(const Scene& scene, const RenderSettings& settings, Acceleration acceleration) {
    SceneData data;
    data.header.background_down = to_float(scene.background.down);
    data.header.background_up = to_float(scene.background.up);
    data.header.extent = static_cast<float>(extent_of(scene));
    data.camera = flatten(scene.camera, settings);
    for (const glm::dvec3& vertex : scene.vertices) data.vertices.push_back(to_float(vertex, 1.0));
    for (const Entity& entity : scene.entities) data.transforms.push_back(flatten(entity.object_to_world));
    for (const Material& material : scene.materials) data.materials.push_back(flatten(material));
    place_primitives(scene, data);
    if (needed_effects(scene, settings).has(Effect::light_sampling)) data.lights = make_light_table(scene, data.placed);
    for (std::uint32_t i = 0; i < data.lights.size(); ++i) data.placed[data.lights[i].slot].light = i;
    data.trees = grow_trees(scene, data, acceleration);
    data.passing_emission = has_passing_emission(scene);
    return data;
}

}  // namespace tandem
