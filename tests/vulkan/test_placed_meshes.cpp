// Meshes kept once for all that place them, against the same scenes with every triangle in the world: the same bits.
#include <doctest/doctest.h>

#include "tests/placed_mesh.h"
#include "tests/vulkan/scenes.h"
#include "vulkan/renderer/scene/mesh_places.h"
#include "vulkan/renderer/scene/scene_data.h"

using namespace tandem;
using namespace tandem::test;
using namespace tandem::testing;

namespace {

RayHits hits_of(const Scene& scene, const std::vector<GivenRay>& rays, Instancing instancing) {
    return default_renderer(Acceleration::trees).intersector(scene, with_instancing({}, instancing))->intersect(rays);
}

void check_same_renders(const Scene& scene, const RenderSettings& settings, Renderer& renderer) {
    const auto image = [&](Instancing instancing) {
        return renderer.prepare(scene, with_instancing(settings, instancing))->render({0, 8}).estimate;
    };
    const Estimate kept = image(Instancing::always), placed = image(Instancing::never);
    CHECK(same_bits(kept, placed));
    CHECK(image_mean(kept) > 0.05);
}

Scene flat(Scene scene) {
    scene.normals.clear();
    return scene;
}

}  // namespace

TEST_CASE("rays find the same bits on meshes under turns, mirrors, shears and scales as on triangles in the world") {
    const Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    const std::vector<GivenRay> rays = rays_at_places(scene, 400);
    const std::vector<RayHit> kept = hits_of(scene, rays, Instancing::always).hits,
                              placed = hits_of(scene, rays, Instancing::never).hits;
    CHECK(count_different(kept, placed) == 0);
    CHECK(std::ranges::count(kept, no_index, &RayHit::primitive) < static_cast<std::ptrdiff_t>(rays.size()) / 2);
    const std::vector<GivenRay> next = leaving(kept);
    CHECK(count_different(
              hits_of(scene, next, Instancing::always).hits, hits_of(scene, next, Instancing::never).hits) == 0);
}

TEST_CASE("images of placed meshes have the bits of the same triangles in the world, by either shape of kernel") {
    Scene scene = flat(scene_of_places(diffuse(dvec3(0.5))));
    Texture& texture = scene.textures.emplace_back();
    texture.space = TextureSpace::coordinates;
    texture.frequency = dvec3(3.1, 4.3, 0.0);
    scene.materials[scene.entities[2].material].colour_texture = 0;
    for (const char* kernel : {"megakernel", "stages"})
        check_same_renders(scene, settings_of(24, 4, Integrator::next_event), renderer_with_kernel(kernel));
}

TEST_CASE("places stand still among entities that move") {
    Scene scene = flat(scene_of_places(mirror(dvec3(0.9))));
    scene.entities[1].motion = {0.5, 0.1, 0.0};
    scene.entities[3].motion = {0.0, 0.4, 0.0};  // one that would else place the mesh
    check_same_renders(scene, settings_of(24, 4), default_renderer());
}

TEST_CASE("vertex normals of placed meshes are those of the same triangles in the world, to their rounding") {
    const Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    const auto image = [&](Instancing instancing) {
        const RenderSettings settings = with_instancing(settings_of(24, 2, Integrator::next_event), instancing);
        return image_mean(default_renderer().prepare(scene, settings)->render({0, 64}).estimate);
    };
    CHECK(image(Instancing::always) == doctest::Approx(image(Instancing::never)).epsilon(1e-4));
}

TEST_CASE("a mesh's triangles and nodes are there once, and its places have sources and ids of their own") {
    const Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    const SceneData data =
        flatten(scene, with_instancing(settings_of(4, 1), Instancing::always), Acceleration::automatic);
    CHECK(data.meshes.places == 5);
    CHECK(data.meshes.triangles == 360);
    CHECK(data.meshes.placed_triangles == 5 * 360);
    CHECK(data.triangle_count == 2 + 360 + 1);  // of the mesh that emits, too
    CHECK(data.sources.size() == data.primitives() + 5 + 360);
    CHECK(data.trees.nodes.size() < 2 * (363 + 360 + 5));
    CHECK(data.placed[data.meshes.first_slot].id == 3);
    CHECK(data.placed[data.meshes.first_slot + 2].id == 3 + 3 * 360);  // the third place is the fourth of the mesh
    CHECK(
        flatten(scene, with_instancing(settings_of(4, 1), Instancing::always), Acceleration::loops).meshes.places == 0);
}

TEST_CASE("a place's box holds its corners, and its reach all their terms") {
    const Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    const PlacedMeshes placed = placed_meshes(scene, with_instancing({}, Instancing::always));
    for (const MeshPlace& place : mesh_places(scene, placed)) {
        const Entity& entity = scene.entities[place.entity];
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i)
            for (const std::uint32_t vertex : scene.primitives[entity.first_primitive + i].index) {
                const dvec3 p(entity.object_to_world * glm::dvec4(scene.vertices[vertex], 1.0));
                CHECK(glm::all(glm::lessThan(place.box.low, p)));
                CHECK(glm::all(glm::lessThan(p, place.box.high)));
                CHECK(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= double{place.reach});
            }
    }
}
