// Where scenes are rendered that stand far from the origin of their coordinates.
#include <doctest/doctest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "common/render/floating_origin.h"
#include "common/render/path_trace.h"
#include "common/render/random.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::test;

namespace {

Scene room_at(const dvec3& place) {
    return SceneBuilder()
        .camera(place + dvec3(0.0, 0.0, 0.5), place, 40.0)
        .cuboid(diffuse(white), place - dvec3(1.0), place + dvec3(1.0))
        .sphere(diffuse(white), place, 0.25)
        .scene();
}

// First corner of an entity's first primitive, in the world.
dvec3 corner(const Scene& scene, std::size_t entity) {
    const Entity& e = scene.entities[entity];
    return dvec3(e.object_to_world * glm::dvec4(scene.vertices[scene.primitives[e.first_primitive].index[0]], 1.0));
}

// A job that leads one path from (1, 2, 3) to (4, 5, 6), and on out of the scene.
class OnePath final : public RenderJob {
public:
    bool goes_on_in_blocks() const override { return true; }
    RenderResult render(SampleRange, const RenderControl&) override { return {}; }
    std::vector<PathTrace> trace(std::uint32_t, std::uint32_t, SampleRange) override {
        TracedVertex hit, missed;
        hit.origin = {1.0, 2.0, 3.0};
        hit.position = missed.origin = {4.0, 5.0, 6.0};
        hit.end = PathEnd::goes_on;
        missed.end = PathEnd::left_scene;
        return {{{hit, missed}, dvec3(0.0)}};
    }
};

}  // namespace

TEST_CASE("scenes around the origin, or wider than they are far, stay where they are") {
    CHECK_FALSE(floating_origin(room_at({0.0, 0.0, 0.0})));
    CHECK_FALSE(floating_origin(room_at({3.0, -3.0, 2.0})));
    Scene wide = room_at({1e6, 0.0, 0.0});
    wide.camera.position = dvec3(0.0);
    CHECK_FALSE(floating_origin(wide));
    Scene in_motion = room_at({1e6, 0.0, 0.0});
    in_motion.entities.front().motion = {-1e6, 0.0, 0.0};
    CHECK_FALSE(floating_origin(in_motion));
}

TEST_CASE("scenes far along an axis are moved to it, by numbers of few bits") {
    const auto origin = floating_origin(room_at({1e6 + 1.0 / 3.0, 2.0, -1e7}));
    REQUIRE(origin);
    CHECK(*origin == dvec3(1e6, 0.0, -1e7));
}

TEST_CASE("what is far is told by where primitives are placed, not by their own coordinates") {
    Scene scene = room_at({1e6, 0.0, 0.0});
    for (Entity& entity : scene.entities) entity.object_to_world[3] -= glm::dvec4(1e6, 0.0, 0.0, 0.0);
    scene.camera.position.x = scene.camera.target.x = 0.0;
    CHECK_FALSE(floating_origin(scene));
}

TEST_CASE("all that stands in a moved scene is moved, and directions and displacements are not") {
    Scene scene = room_at({1e6, 0.0, 0.0});
    scene.camera.position_motion = {1.0, 0.0, 0.0};
    scene.entities.front().motion = {0.0, 1.0, 0.0};
    PunctualLight light;
    light.position = {1e6, 1.0, 0.0};
    scene.lights.push_back(light);
    Medium medium;
    medium.grid = std::make_shared<DensityGrid>(
        DensityGrid{{1, 1, 1}, dvec3(1e6 - 1.0, -1.0, -1.0), dvec3(1e6 + 1.0, 1.0, 1.0), {1.0F}});
    scene.media.push_back(medium);
    const Scene seen = seen_from(scene, {1e6, 0.0, 0.0}).value();
    CHECK(seen.camera.position == dvec3(0.0, 0.0, 0.5));
    CHECK(seen.camera.target == dvec3(0.0));
    CHECK(seen.camera.position_motion == scene.camera.position_motion);
    for (std::size_t i = 0; i < scene.entities.size(); ++i)
        CHECK(corner(seen, i) == corner(scene, i) - dvec3(1e6, 0.0, 0.0));
    CHECK(seen.entities.front().motion == scene.entities.front().motion);
    CHECK(seen.lights.front().position == dvec3(0.0, 1.0, 0.0));
    CHECK(seen.lights.front().direction == light.direction);
    CHECK(seen.media.front().grid->low == dvec3(-1.0));
    CHECK(seen.media.front().grid->high == dvec3(1.0));
}

TEST_CASE("an entity of large coordinates gets small ones, all of its place, whatever turns and scales it") {
    const glm::dmat4 turn = glm::rotate(glm::scale(glm::dmat4(1.0), dvec3(0.5, -2.0, 1.0)), 0.3, dvec3(1.0, 2.0, 3.0));
    const dvec3 far = dvec3(turn * glm::dvec4(1e8, -7e7, 3e7, 1.0));
    Scene scene = SceneBuilder()
                      .camera(far + dvec3(0.0, 0.0, 3.0), far, 40.0)
                      .triangle(diffuse(white), {1e8, -7e7, 3e7}, {1e8 + 1.0, -7e7, 3e7}, {1e8, -7e7 + 1.0, 3e7}, turn)
                      .scene();
    const auto origin = floating_origin(scene);
    REQUIRE(origin);
    const Scene seen = seen_from(scene, *origin).value();
    for (const dvec3& vertex : seen.vertices) CHECK(glm::length(vertex) < 32.0);
    CHECK(glm::length(dvec3(seen.entities[0].object_to_world[3])) < 32.0);
    CHECK(glm::length(corner(seen, 0) - (corner(scene, 0) - *origin)) < 1e-6);

    SUBCASE("not where a texture goes by them") {
        scene.textures.emplace_back();
        scene.materials[scene.entities[0].material].colour_texture = 0;
        CHECK_FALSE(seen_from(scene, *origin));
        scene.textures[0].space = TextureSpace::coordinates;
        CHECK(seen_from(scene, *origin));
    }
    SUBCASE("not where another entity has the same vertices elsewhere") {
        scene.entities.push_back(scene.entities[0]);
        CHECK(seen_from(scene, *origin));
        scene.entities[1].object_to_world[3] += glm::dvec4(16.0, 0.0, 0.0, 0.0);
        CHECK_FALSE(seen_from(scene, *origin));
    }
}

TEST_CASE("traced paths of a moved scene tell the points of the world") {
    const auto job = prepare_near_origin(room_at({1e6, 0.0, 0.0}), RenderSettings(), [](const Scene& scene) {
        CHECK(scene.camera.position.x == 0.0);
        return std::make_unique<OnePath>();
    });
    CHECK(job->goes_on_in_blocks());
    const std::vector<TracedVertex> vertices = job->trace(0, 0, {0, 1}).front().vertices;
    CHECK(vertices[0].origin == dvec3(1000001.0, 2.0, 3.0));
    CHECK(vertices[0].position == dvec3(1000004.0, 5.0, 6.0));
    CHECK(vertices[1].origin == dvec3(1000004.0, 5.0, 6.0));
    CHECK(vertices[1].position == dvec3(0.0));
    REQUIRE(job->first_vertices({1, 1}, {0, 1}, {}, [&](std::uint32_t pixel, std::span<const TracedVertex> first) {
        CHECK(pixel == 0);
        REQUIRE(first.size() == 1);
        CHECK(first[0] == vertices[0]);
    }));
}

namespace {

Scene room_in_motion(const dvec3& motion) {
    Scene scene = room_at(dvec3(0.0));
    scene.camera.position_motion = scene.camera.target_motion = motion;
    for (Entity& entity : scene.entities) entity.motion = motion;
    return scene;
}

}  // namespace

TEST_CASE("a large displacement that bodies share with the camera is taken out of all motions") {
    const dvec3 motion(1e8, -5e7, 0.0);
    Scene scene = room_in_motion(motion);
    scene.entities.back().motion = dvec3(0.0);
    scene.camera.target_motion += dvec3(0.0, 1.0, 0.0);
    REQUIRE(floating_motion(scene) == motion);
    const Scene along = moving_along(scene, motion);
    CHECK(along.camera.position_motion == dvec3(0.0));
    CHECK(along.camera.target_motion == dvec3(0.0, 1.0, 0.0));
    CHECK(along.entities.front().motion == dvec3(0.0));
    CHECK(along.entities.back().motion == -motion);
}

TEST_CASE("a displacement is left in where it is small, no body shares it, or something stands still") {
    CHECK_FALSE(floating_motion(room_at(dvec3(0.0))));
    CHECK_FALSE(floating_motion(room_in_motion({3.9, 0.0, 0.0})));
    CHECK(floating_motion(room_in_motion({4.1, 0.0, 0.0})));
    Scene alone = room_in_motion({0.0, 1e8, 0.0});
    for (Entity& entity : alone.entities) entity.motion = {0.0, 0.7e8, 0.0};
    CHECK_FALSE(floating_motion(alone));
    alone.entities.front().motion = {0.0, 0.8e8, 0.0};
    CHECK(floating_motion(alone));
    Scene lit = room_in_motion({0.0, 1e8, 0.0});
    lit.lights.push_back({"sun", PunctualKind::sun, {}, {0.0, -1.0, 0.0}, dvec3(1.0)});
    CHECK(floating_motion(lit));
    lit.lights.push_back({"point", PunctualKind::point, {}, {}, dvec3(1.0)});
    CHECK_FALSE(floating_motion(lit));
}

TEST_CASE("traced paths of a moved scene tell the points of the world at their own time") {
    const dvec3 motion(1024.0, 0.0, 0.0);
    RenderSettings settings;
    settings.seed = 7;
    const auto job = prepare_near_origin(room_in_motion(motion), settings, [](const Scene& scene) {
        CHECK(scene.camera.position_motion == dvec3(0.0));
        return std::make_unique<OnePath>();
    });
    const double time = to_unit<double>(random_block(Generator::philox, 7, 3, 64, 1)[0]);
    const std::vector<TracedVertex> vertices = job->trace(3, 0, {64, 65}).front().vertices;
    CHECK(vertices[0].position == dvec3(4.0, 5.0, 6.0) + time * motion);
    CHECK(vertices[1].position == dvec3(0.0));
    std::vector<TracedVertex> first;
    REQUIRE(job->first_vertices({4, 1}, {64, 65}, {},
        [&](std::uint32_t, std::span<const TracedVertex> of_pixel) { first.push_back(of_pixel.front()); }));
    REQUIRE(first.size() == 4);
    CHECK(first[3] == vertices[0]);
    CHECK(first[2].position != vertices[0].position);
}
