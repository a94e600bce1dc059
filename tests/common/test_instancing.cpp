// Which entities place meshes, and primitives by their ids without a list.
#include <doctest/doctest.h>

#include <stdexcept>

#include "common/render/instancing.h"
#include "common/render/memory_forecast.h"
#include "tests/placed_mesh.h"

using namespace tandem;
using namespace tandem::test;

namespace {

std::size_t place_count(const Scene& scene, const RenderSettings& settings) {
    return placed_counts(scene, placed_meshes(scene, settings)).places;
}
const RenderSettings always = with_instancing({}, Instancing::always);

}  // namespace

TEST_CASE("entities place a mesh that shares its triangles, stands still and emits nothing") {
    Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    CHECK(place_count(scene, always) == 5);  // of the six that share it one emits
    scene.entities[2].motion = {0.0, 1.0, 0.0};
    CHECK(place_count(scene, always) == 4);
    for (std::size_t e = 3; e < 8; ++e) scene.entities[e].motion = {0.0, 1.0, 0.0};
    CHECK(place_count(scene, always) == 0);
}

TEST_CASE("a mesh placed once is none, nor one of fewer than 16 triangles, nor one with a sphere") {
    Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    for (Entity& entity : scene.entities)
        if (entity.primitive_count > 15) entity.primitive_count = 15;
    CHECK(place_count(scene, always) == 0);
    for (Entity& entity : scene.entities)
        if (entity.primitive_count == 15) entity.primitive_count = 16;
    CHECK(place_count(scene, always) == 5);
    scene.primitives[scene.entities[2].first_primitive + 7].kind = PrimitiveKind::sphere;
    CHECK(place_count(scene, always) == 0);
}

TEST_CASE("there are no meshes where bodies may touch, with other tests and with paths from both ends") {
    CHECK(place_count(scene_of_places(glass(1.5)), always) == 0);
    const Scene scene = scene_of_places(diffuse(dvec3(0.5)));
    RenderSettings settings = always;
    settings.intersection.triangles = TriangleKernel::moller_trumbore;
    CHECK(place_count(scene, settings) == 0);
    settings = always;
    settings.integrator = Integrator::bidirectional;
    CHECK(place_count(scene, settings) == 0);
}

TEST_CASE("left to itself a scene keeps meshes once where that saves a million triangles") {
    Scene scene = scene_of_places(diffuse(dvec3(0.5)), 50);  // 9800 triangles
    CHECK(place_count(scene, {}) == 0);
    const Entity place = scene.entities[2];
    for (int i = 0; i < 107; ++i) scene.entities.push_back(place);
    CHECK(place_count(scene, {}) == 112);
    scene.entities.resize(scene.entities.size() - 6);
    CHECK(place_count(scene, {}) == 0);
}

TEST_CASE("primitives have the ids of entities in order, those of entities without any left out") {
    Scene scene = scene_of_places(diffuse(dvec3(0.5)), 4);
    scene.entities.insert(scene.entities.begin() + 1, Entity{});
    scene.entities.push_back(Entity{});
    const PlacedPrimitives all = placed_primitives(scene);
    std::uint32_t id = 0;
    for (const PlacedPrimitive placed : all) {
        CHECK(all[id].entity == placed.entity);
        CHECK(all[id].primitive == placed.primitive);
        CHECK(all.first_of(placed.entity) + placed.primitive - scene.entities[placed.entity].first_primitive == id);
        ++id;
    }
    CHECK(id == all.size());
    CHECK(id == 2 + 1 + 6 * 48 + 1);
    CHECK_THROWS_AS(static_cast<void>(all[id]), std::out_of_range);
    CHECK(placed_primitives(Scene{}).size() == 0);
}
