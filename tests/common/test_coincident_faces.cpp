// Which scenes have faces in one plane that rays go through.
#include <doctest/doctest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "common/scene/coincident_faces.h"
#include "common/scene/loader/scene_loader.h"

using namespace tandem;

namespace {

Scene shipped(const char* name) { return load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / name); }

}  // namespace

TEST_CASE("faces that rays go through are seen to coincide in touching bodies alone") {
    for (const char* name :
        {"cornell-classic.json", "cornell-thesis.json", "glass.json", "one-weekend.json", "fog.json"}) {
        CAPTURE(name);
        CHECK_FALSE(passed_faces_coincide(shipped(name)));
    }
    for (const char* name :
        {"hard/media-touching-cuboids.json", "hard/media-touching-meshes.json", "hard/media-touching-glass.json",
            "hard/media-on-floor.json", "hard/media-floor-absorbing.json", "hard/glass-touching-cuboids.json"}) {
        CAPTURE(name);
        CHECK(passed_faces_coincide(shipped(name)));
    }
}

TEST_CASE("faces coincide however they are turned, in float as well, and do not a thousandth apart") {
    for (int turn = 0; turn < 200; ++turn) {
        Scene scene = shipped("hard/media-touching-meshes.json");
        const double angle = 0.0314 * turn;
        const glm::dmat4 map = glm::rotate(glm::dmat4(1.0), angle, glm::normalize(glm::dvec3(1.0, 0.02 * turn, -0.7)));
        for (Entity& entity : scene.entities) entity.object_to_world = map * entity.object_to_world;
        CHECK(passed_faces_coincide(scene));
        // Vertices as a float has them, in the world.
        Scene rounded = scene;
        for (glm::dvec3& vertex : rounded.vertices) {
            vertex = glm::dvec3(rounded.entities[0].object_to_world * glm::dvec4(vertex, 1.0));
            for (int axis = 0; axis < 3; ++axis) vertex[axis] = static_cast<double>(static_cast<float>(vertex[axis]));
        }
        for (Entity& entity : rounded.entities) entity.object_to_world = glm::dmat4(1.0);
        CHECK(passed_faces_coincide(rounded));
        scene.entities[1].object_to_world =
            scene.entities[1].object_to_world * glm::translate(glm::dmat4(1.0), glm::dvec3(1e-3, 1.3e-3, 0.7e-3));
        CHECK_FALSE(passed_faces_coincide(scene));
    }
}

TEST_CASE("faces of what moves may come to coincide") {
    Scene scene = shipped("glass.json");
    CHECK_FALSE(passed_faces_coincide(scene));
    scene.entities.front().motion = {0.1, 0.0, 0.0};
    CHECK(passed_faces_coincide(scene));
}
