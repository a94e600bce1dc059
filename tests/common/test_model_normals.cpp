// Vertex normals that OBJ and glTF models bring (MODEL.md section 5.4), and unsound ones.
#include <doctest/doctest.h>

#include <cstring>
#include <glm/geometric.hpp>
#include <limits>

#include "common/render/effects.h"
#include "common/render/renderer.h"
#include "tests/common/scene_texts.h"

using namespace tandem;
using namespace tandem::test;

namespace {

Json model_scene(const std::string& kind, const Json& model) {
    Json scene = base();
    scene["entities"] = {{{"material", "m"}, {"primitives", {{{kind, model}}}}}};
    return scene;
}

glm::dvec3 normal_of(const Scene& scene, std::size_t triangle, std::size_t corner) {
    return scene.normals[scene.primitives[triangle].index[corner]];
}

bool near(const glm::dvec3& a, const glm::dvec3& b) { return glm::length(a - b) < 1e-6; }

bool calls_for_shading_normals(const Scene& scene) {
    return needed_effects(scene, default_settings(scene)).has(Effect::shading_normals);
}

constexpr const char* corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

// A triangle in a node stretched by (-2, 1, 1), whose normals are `normals`.
Scene load_gltf(const TemporaryFolder& folder, const std::array<glm::vec3, 3>& normals, std::size_t count = 3) {
    const float points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    std::string bytes(72, '\0');
    std::memcpy(bytes.data(), points, 36);
    std::memcpy(bytes.data() + 36, normals.data(), 36);
    put(folder / "m.bin", bytes);
    const Json accessor = {{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}};
    Json of_normals = accessor;
    of_normals["bufferView"] = 1;
    of_normals["count"] = count;
    const Json document = {{"asset", {{"version", "2.0"}}}, {"scenes", {{{"nodes", {0}}}}},
        {"nodes", {{{"mesh", 0}, {"scale", {-2, 1, 1}}}}},
        {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}}}}}}}}},
        {"buffers", {{{"byteLength", 72}, {"uri", "m.bin"}}}},
        {"bufferViews", {{{"buffer", 0}, {"byteLength", 36}}, {{"buffer", 0}, {"byteOffset", 36}, {"byteLength", 36}}}},
        {"accessors", {accessor, of_normals}}};
    put(folder / "m.gltf", document.dump());
    return load(folder, model_scene("gltf", {{"file", "m.gltf"}}));
}

}  // namespace

TEST_CASE("OBJ normals are made unit, and split vertices where they differ") {
    const TemporaryFolder folder;
    put(folder / "m.obj", std::string(corners) + "vn 0 0 3\nvn 0 1 1\nf 1//1 2//2 3//-2\nf 1//2 2//2 3//2\nf 1 3 2\n");
    const Scene scene = load(folder, model_scene("obj", {{"file", "m.obj"}}));
    REQUIRE(scene.normals.size() == scene.vertices.size());
    const double half = std::sqrt(0.5);
    CHECK(near(normal_of(scene, 0, 0), {0, 0, 1}));
    CHECK(near(normal_of(scene, 0, 1), {0, half, half}));
    CHECK(near(normal_of(scene, 0, 2), {0, 0, 1}));
    CHECK(scene.primitives[0].index[1] == scene.primitives[1].index[1]);
    CHECK(normal_of(scene, 2, 0) == glm::dvec3(0));  // flat
    CHECK(scene.vertices.size() == 8);
    CHECK(calls_for_shading_normals(scene));

    const Scene flat = load(folder, model_scene("obj", {{"file", "m.obj"}, {"normals", "flat"}}));
    CHECK(flat.normals.empty());
    CHECK(flat.vertices.size() == 3);
    CHECK_FALSE(calls_for_shading_normals(flat));

    Json both = model_scene("obj", {{"file", "m.obj"}});
    both["entities"][0]["primitives"].push_back({{"sphere", {{"centre", {0, 0, 0}}, {"radius", 1}}}});
    both["entities"][0]["primitives"].push_back({{"obj", {{"file", "m.obj"}, {"normals", "flat"}}}});
    const Scene mixed = load(folder, both);
    CHECK(mixed.normals.size() == mixed.vertices.size());
    CHECK(normal_of(mixed, 4, 0) == glm::dvec3(0));

    Json lamp = model_scene("obj", {{"file", "m.obj"}});
    lamp["materials"]["m"] = {{"kind", "emissive"}, {"radiance", {1, 1, 1}}};
    CHECK_FALSE(calls_for_shading_normals(load(folder, lamp)));  // it reflects nothing
}

TEST_CASE("triangles with a normal of length 0 are flat; normals that are no numbers are refused") {
    const TemporaryFolder folder;
    put(folder / "m.obj", std::string(corners) + "vn 0 0 0\nvn 0 0 1\nf 1//1 2//2 3//2\n");
    CHECK(load(folder, model_scene("obj", {{"file", "m.obj"}})).normals.empty());
    const auto refused = [&](const std::string& rest, const std::string& reason) {
        put(folder / "m.obj", corners + rest);
        const std::string line = refusal(folder, model_scene("obj", {{"file", "m.obj"}}));
        CAPTURE(line);
        CHECK(contains(line, "/entities/0/primitives/0/obj/file: m.obj: line "));
        CHECK(contains(line, reason));
    };
    refused("vn 0 nan 1\nf 1//1 2//1 3//1\n", "\"nan\" is no coordinate; a normal has three finite numbers");
    refused("vn 0 0 inf\nf 1//1 2//1 3//1\n", "a normal has three finite numbers");
    refused("vn 0 0\nf 1//1 2//1 3//1\n", "a normal has three finite numbers");
    refused("vn 0 0 1\nf 1//1 2//2 3//1\n", "normal 2 is not among the 1 before it");
    refused("vn 0 0 1\nf 1//1 2//0 3//1\n", "normal 0 is not among the 1 before it");
    refused("vn 0 0 1\nf 1//1 2//1 3\n", "some corners of a face have normals and others do not");
    Json wrong = model_scene("obj", {{"file", "m.obj"}, {"normals", "round"}});
    CHECK(contains(refusal(folder, wrong), "/entities/0/primitives/0/obj/normals"));
}

TEST_CASE("glTF normals go through their node's inverse transpose") {
    const TemporaryFolder folder;
    const glm::vec3 up(0, 0, 1), slanted(2, 0, 2);
    const Scene scene = load_gltf(folder, {up, slanted, up});
    REQUIRE(scene.normals.size() == scene.vertices.size());
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const bool is_slanted = scene.vertices[scene.primitives[0].index[corner]].x != 0.0;
        const glm::dvec3 expected = is_slanted ? glm::normalize(glm::dvec3(-0.5, 0, 1)) : glm::dvec3(0, 0, 1);
        CHECK(near(normal_of(scene, 0, corner), expected));
    }
    CHECK(load_gltf(folder, {up, glm::vec3(0), up}).normals.empty());
    const auto refused = [&](const glm::vec3& normal, std::size_t count, const std::string& reason) {
        std::string line = "accepted";
        try {
            (void)load_gltf(folder, {up, normal, up}, count);
        } catch (const InputError& error) {
            line = error.what();
        }
        CAPTURE(line);
        CHECK(contains(line, reason));
    };
    refused(glm::vec3(std::numeric_limits<float>::quiet_NaN()), 3, "a normal that is not finite");
    refused(glm::vec3(std::numeric_limits<float>::infinity()), 3, "a normal that is not finite");
    refused(up, 2, "not one normal a vertex");
    refused(up, 4, "beyond its buffer");
}
