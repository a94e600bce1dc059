// A scene flattened for the device: rounded to float, sorted by kind of primitive, with the table of sampled lights.
#pragma once

#include <optional>
#include <vector>

#include "common/render/renderer.h"
#include "vulkan/backend.h"
#include "vulkan/renderer/scene/gpu_layout.h"
#include "vulkan/renderer/scene/scene_tables.h"

namespace tandem {

// The roots of the trees over the primitives of one kind each; none where a loop serves. meshes: over their places.
struct SceneTrees {
    std::vector<gpu::BvhNode> nodes;
    std::optional<std::uint32_t> triangles, spheres, cuboids, meshes;
    double seconds = 0.0;  // that building took
};

// Meshes that several entities place (shaders/scene/meshes.glsl). Their places have a source and a Placed each, after
// those of primitives. Their triangles have sources after those of places, and slots from `first_slot` on.
struct SceneMeshes {
    std::uint32_t first_slot = 0, places = 0, triangles = 0;  // triangles: of meshes, each once
    std::uint32_t placed_triangles = 0;
    double reach = 0.0;  // the largest coordinate of them in the world
};

// What kernels with geometry in double read in place of its like in float. The host has placed the world primitives,
// where the vertex stage places those in float.
struct DoubleGeometry {
    std::vector<gpu::DoubleTriangle> triangles;
    std::vector<gpu::DoubleConvex> spheres, cuboids;
    gpu::DoubleCamera camera;
    std::vector<gpu::DoubleEntityTransform> transforms;
    std::vector<gpu::DoubleLight> lights;
    std::vector<gpu::DoubleMedium> media;
    // Tables for kernels that shade in double as well.
    struct Shading {
        gpu::DoubleSceneHeader header;
        std::vector<gpu::DoubleMaterial> materials;
        std::vector<gpu::DoubleTexture> textures;
    };
    std::optional<Shading> shading;
};

// Where the tree over the near lights begins in the tables' numbers, and how many lights are in it; 0: there is none.
struct LightTreePlace {
    std::uint32_t leaves = 0, first = 0;
};

struct SceneData {
    gpu::SceneHeader header;
    gpu::Camera camera;
    std::vector<gpu::Vec4> vertices;
    std::vector<gpu::PrimitiveSource> sources;  // by slot, and of meshes
    std::vector<gpu::EntityTransform> transforms;
    std::vector<gpu::Placed> placed;  // by slot, and of places
    std::vector<gpu::Material> materials;
    std::vector<gpu::Light> lights;
    LightTreePlace light_tree;
    SceneTables tables;
    std::uint32_t triangle_count = 0, sphere_count = 0, cuboid_count = 0;
    SceneMeshes meshes;
    SceneTrees trees;
    std::optional<DoubleGeometry> in_double;
    bool passing_emission = false;  // some surface emits and lets the path go on

    [[nodiscard]] std::uint32_t primitives() const { return triangle_count + sphere_count + cuboid_count; }
    // Whose world triangles stages do not fill.
    [[nodiscard]] bool has_meshes() const { return meshes.places > 0; }
};

// Throws UnsupportedError for what float cannot hold.
[[nodiscard]] SceneData flatten(const Scene& scene, const RenderSettings& settings, Acceleration acceleration);

// MODEL.md sections 4 and 6. The camera must have a frame (check_settings).
template <class Real>
[[nodiscard]] gpu::CameraOf<Real> flatten_camera(const Camera& camera, const RenderSettings& settings);
template <class Real>
[[nodiscard]] gpu::EntityTransformOf<Real> flatten_transform(const Entity& entity);

extern template gpu::Camera flatten_camera<float>(const Camera&, const RenderSettings&);
extern template gpu::DoubleCamera flatten_camera<double>(const Camera&, const RenderSettings&);
extern template gpu::EntityTransform flatten_transform<float>(const Entity&);
extern template gpu::DoubleEntityTransform flatten_transform<double>(const Entity&);

}  // namespace tandem
