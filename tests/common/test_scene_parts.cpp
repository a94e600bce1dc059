// What textures, media, lights, motion and groups of a scene file come to in memory, and unsound files beside it.
#include <doctest/doctest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "tests/common/scene_texts.h"

using namespace tandem;
using namespace tandem::test;

TEST_CASE("every field of a texture reaches the scene") {
    const Scene scene = load_patched(R"({"textures": {
        "a": {"kind": "checker", "colours": [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], "frequency": [1, 2, 0]},
        "b": {"kind": "noise", "colours": [[0, 0, 0], [1, 1, 1]], "frequency": 3, "space": "coordinates",
            "style": "marble", "octaves": 5, "amount": 2.5, "seed": 4294967295}},
        "materials": {"m": {"colour": {"texture": "b"}}}})");
    REQUIRE(scene.textures.size() == 2);
    const Texture &checker = scene.textures[0], &noise = scene.textures[1];
    CHECK(checker.name == "a");
    CHECK(checker.kind == TextureKind::checker);
    CHECK(checker.space == TextureSpace::object);
    CHECK(checker.first == glm::dvec3(0.1, 0.2, 0.3));
    CHECK(checker.second == glm::dvec3(0.4, 0.5, 0.6));
    CHECK(checker.frequency == glm::dvec3(1, 2, 0));
    CHECK(noise.kind == TextureKind::noise);
    CHECK(noise.space == TextureSpace::coordinates);
    CHECK(noise.frequency == glm::dvec3(3, 3, 0));
    CHECK(noise.style == NoiseStyle::marble);
    CHECK(noise.octaves == 5);
    CHECK(noise.amount == 2.5);
    CHECK(noise.seed == 4294967295u);
    CHECK(scene.materials[0].colour_texture == 1);
}

TEST_CASE("image textures in sRGB are made linear by IEC 61966-2-1, linear ones are kept") {
    const TemporaryFolder folder;
    put_pfm(folder / "t.pfm", 2, 1, {0.0F, 0.04F, 0.5F, 1.0F, 0.25F, 0.04045F});
    const Scene linear = load(folder, image_scene("t.pfm", "linear"));
    REQUIRE(linear.textures.at(0).image);
    CHECK(linear.textures[0].space == TextureSpace::coordinates);
    CHECK(linear.textures[0].image->width == 2);
    CHECK(linear.textures[0].image->height == 1);
    CHECK(linear.textures[0].image->rgb == std::vector<float>{0.0F, 0.04F, 0.5F, 1.0F, 0.25F, 0.04045F});
    const std::vector<float> decoded = load(folder, image_scene("t.pfm", "srgb")).textures.at(0).image->rgb;
    CHECK(decoded[0] == 0.0F);
    CHECK(decoded[1] == doctest::Approx(0.04 / 12.92).epsilon(1e-7));
    CHECK(decoded[2] == doctest::Approx(0.21404114048).epsilon(1e-7));  // of the standard
    CHECK(decoded[3] == 1.0F);
    CHECK(decoded[4] == doctest::Approx(0.05087609).epsilon(1e-6));
}

TEST_CASE("image textures out of range, without colours or unsound are refused") {
    const TemporaryFolder folder;
    const auto refused = [&](const std::vector<float>& values, const std::string& space, const std::string& reason) {
        put_pfm(folder / "t.pfm", 1, 2, values);
        const std::string line = refusal(folder, image_scene("t.pfm", space));
        CAPTURE(line);
        CHECK(contains(line, "/textures/t/file: t.pfm: "));
        CHECK(contains(line, reason));
        CHECK(contains(line, "; "));
    };
    refused({0, 0, 0, 0, 1.5F, 0}, "linear", "1.5 at column 0, row 1 is out of range");
    refused({0, 0, -1, 0, 0, 0}, "srgb", "-1 at column 0, row 0");
    refused({0, std::nanf(""), 0, 0, 0, 0}, "linear", "nan at");
    refused({0, INFINITY, 0, 0, 0, 0}, "linear", "inf at");
    put(folder / "t.pfm", "PF\n3 3\n-1.0\n");
    CHECK(
        contains(refusal(folder, image_scene("t.pfm", "linear")), "/textures/t/file: t.pfm: is not a sound PFM image"));
    put(folder / "t.pfm", "PF\n60000 60000\n-1.0\n");
    CHECK(contains(refusal(folder, image_scene("t.pfm", "linear")), "larger than"));
}

TEST_CASE("backgrounds are an image, a mix or one colour, and images are sampled unless told otherwise") {
    const TemporaryFolder folder;
    put_pfm(folder / "sky.pfm", 2, 1, {0, 1, 2, 3, 4, 500});
    Json scene = base();
    scene["background"] = {{"image", "sky.pfm"}, {"colour_space", "linear"}, {"scale", 2}, {"rotation_degrees", -30}};
    const Background image = load(folder, scene).background;
    REQUIRE(image.image);
    CHECK(image.image->rgb == std::vector<float>{0, 1, 2, 3, 4, 500});
    CHECK(image.image_scale == 2.0);
    CHECK(image.rotation_degrees == -30.0);
    CHECK(image.sampled);
    scene["background"]["sampled"] = false;
    CHECK_FALSE(load(folder, scene).background.sampled);
    CHECK_FALSE(load_patched(R"({"background": {"down": [0, 0, 0], "up": [1, 1, 1]}})").background.sampled);
    const Background even = load_patched(R"({"background": {"radiance": [1, 2, 3], "sampled": true}})").background;
    CHECK(even.down == glm::dvec3(1, 2, 3));
    CHECK(even.up == glm::dvec3(1, 2, 3));
    CHECK(even.sampled);
}

TEST_CASE("every field of a conductor, of an interior and of a light reaches the scene") {
    const Scene scene = load_patched(R"({
        "media": {"air": {"scattering": 1}, "wine": {"absorption": [1, 2, 3], "scattering": 0.5, "anisotropy": -0.5}},
        "medium": "air",
        "materials": {"glass": {"kind": "specular", "colour": [1, 1, 1], "translucent": true, "roughness": 0.25,
                "interior": "wine", "priority": -7},
            "gold": {"kind": "conductor", "eta": [0.1, 0.2, 0.3], "k": [4, 5, 6], "roughness": 0.5},
            "skin": {"kind": "boundary", "interior": "wine"}},
        "lights": [{"name": "p", "point": {"position": [1, 2, 3], "intensity": [4, 5, 6]}},
            {"spot": {"position": [0, 5, 0], "target": [0, 1, 0], "intensity": [1, 1, 1], "inner_degrees": 10,
                "outer_degrees": 20}},
            {"sun": {"direction": [0, 0, -2], "irradiance": [3, 2, 1]}}]})");
    CHECK(scene.medium == 0);
    CHECK(scene.media.at(1).absorption == glm::dvec3(1, 2, 3));
    CHECK(scene.media[1].scattering == glm::dvec3(0.5));
    CHECK(scene.media[1].anisotropy == -0.5);
    const Material &glass = scene.materials.at(0), &gold = scene.materials.at(1), &skin = scene.materials.at(3);
    CHECK(glass.roughness == 0.25);
    CHECK(glass.interior == 1);
    REQUIRE(glass.priority.has_value());
    CHECK(*glass.priority == -7);
    CHECK(gold.kind == MaterialKind::conductor);
    CHECK(gold.eta == glm::dvec3(0.1, 0.2, 0.3));
    CHECK(gold.k == glm::dvec3(4, 5, 6));
    CHECK(gold.roughness == 0.5);
    CHECK(skin.kind == MaterialKind::boundary);
    CHECK_FALSE(skin.priority.has_value());
    REQUIRE(scene.lights.size() == 3);
    CHECK(scene.lights[0].kind == PunctualKind::point);
    CHECK(scene.lights[0].name == "p");
    CHECK(scene.lights[0].position == glm::dvec3(1, 2, 3));
    CHECK(scene.lights[0].intensity == glm::dvec3(4, 5, 6));
    CHECK(scene.lights[1].kind == PunctualKind::spot);
    CHECK(scene.lights[1].direction == glm::dvec3(0, -1, 0));
    CHECK(scene.lights[1].inner_degrees == 10.0);
    CHECK(scene.lights[1].outer_degrees == 20.0);
    CHECK(scene.lights[2].kind == PunctualKind::sun);
    CHECK(scene.lights[2].direction == glm::dvec3(0, 0, -1));
    CHECK(scene.lights[2].intensity == glm::dvec3(3, 2, 1));
}

TEST_CASE("volume files give cells, box and scaled values") {
    const TemporaryFolder folder;
    put(folder / "smoke.vol", volume(1, {2, 1, 3}, 1, {0, 1, 2, 3, 4, 5}));
    const Scene scene = load(folder, volume_scene());
    REQUIRE(scene.media.at(0).grid);
    const DensityGrid& grid = *scene.media[0].grid;
    CHECK(grid.cells == std::array<std::uint32_t, 3>{2, 1, 3});
    CHECK(grid.low == glm::dvec3(-1, -2, -3));
    CHECK(grid.high == glm::dvec3(1, 2, 3));
    CHECK(grid.density == std::vector<float>{0, 3, 6, 9, 12, 15});
}

TEST_CASE("unsound volume files are refused") {
    const TemporaryFolder folder;
    const auto refused = [&](const std::string& bytes, const std::string& reason) {
        put(folder / "smoke.vol", bytes);
        const std::string line = refusal(folder, volume_scene());
        CAPTURE(line);
        CHECK(contains(line, "/media/smoke/grid/file: smoke.vol: "));
        CHECK(contains(line, reason));
    };
    refused("", "no volume file of version 3");
    refused(std::string(48, '\0'), "no volume file of version 3");
    refused(volume(3, {1, 1, 1}, 1, {0}), "does not hold float32");
    refused(volume(1, {1, 1, 1}, 3, {0, 0, 0}), "more channels than one");
    refused(volume(1, {0, 1, 1}, 1, {}), "has 0 cells along x");
    refused(volume(1, {1, -1, 1}, 1, {}), "has -1 cells along y");
    refused(volume(1, {4096, 4096, 4096}, 1, {0}), "should hold 68719476736 values");
    refused(volume(1, {2, 1, 1}, 1, {0}), "should hold 2 values");
    refused(volume(1, {1, 1, 1}, 1, {0, 0}), "should hold 1 values");
    refused(volume(1, {1, 1, 1}, 1, {-1}), "gives the density -3");
    refused(volume(1, {1, 1, 1}, 1, {NAN}), "gives the density nan");
}

TEST_CASE("camera and entities may move") {
    const Scene scene = load_patched(R"({"camera": {"motion": {"position": [1, 2, 3]}},
        "entities": [{"material": "m", "motion": [4, 5, 6], "transform": [{"scale": 2}],
            "primitives": [{"sphere": {"centre": [0, 0, 0], "radius": 1}}]}]})");
    CHECK(scene.camera.position_motion == glm::dvec3(1, 2, 3));
    CHECK(scene.camera.target_motion == glm::dvec3(0));
    CHECK(scene.entities.at(0).motion == glm::dvec3(4, 5, 6));  // in the world, not scaled by its own transform
}

TEST_CASE("groups share primitives, and transforms and motions compose from the inside out") {
    const Scene scene = load_patched(R"({
        "groups": {
            "pair": [
                {"name": "ball", "material": "m", "transform": [{"translate": [1, 0, 0]}], "motion": [0, 0, 1],
                    "primitives": [{"sphere": {"centre": [0, 0, 0], "radius": 1}}]},
                {"material": "m", "primitives": [{"cuboid": {"minimum": [0, 0, 0], "maximum": [1, 1, 1]}},
                    {"sphere": {"centre": [5, 0, 0], "radius": 1}}]}],
            "both": [{"name": "left", "group": "pair", "transform": [{"scale": 2}], "motion": [1, 0, 0]},
                {"name": "right", "group": "pair", "transform": [{"translate": [0, 7, 0]}]}]},
        "entities": [
            {"material": "m", "primitives": [{"sphere": {"centre": [9, 9, 9], "radius": 1}}]},
            {"group": "both", "transform": [{"rotate": {"axis": [0, 0, 1], "degrees": 90}}, {"translate": [0, 0, 4]}],
                "motion": [0, 0, 10]}]})");
    REQUIRE(scene.entities.size() == 5);
    CHECK(scene.primitives.size() == 4);
    CHECK(placed_primitives(scene).size() == 7);
    CHECK(scene.entities[1].first_primitive == scene.entities[3].first_primitive);
    CHECK(scene.entities[2].first_primitive == scene.entities[4].first_primitive);
    CHECK(scene.entities[2].primitive_count == 2);
    CHECK(scene.entities[1].name == "ball");
    const auto origin = [&](std::size_t entity) { return glm::dvec3(scene.entities[entity].object_to_world[3]); };
    CHECK(glm::distance(origin(1), glm::dvec3(0, 2, 4)) < 1e-15);   // (1, 0, 0) scaled, turned, moved
    CHECK(glm::distance(origin(3), glm::dvec3(-7, 1, 4)) < 1e-15);  // (1, 7, 0) turned, moved
    // (0, 0, 1) scaled by 2, plus (1, 0, 0) turned, plus (0, 0, 10).
    CHECK(glm::distance(scene.entities[1].motion, glm::dvec3(0, 1, 12)) < 1e-15);
    CHECK(glm::distance(scene.entities[2].motion, glm::dvec3(0, 1, 10)) < 1e-15);
    CHECK(glm::distance(scene.entities[3].motion, glm::dvec3(0, 0, 11)) < 1e-15);
}

TEST_CASE("a group that stands nowhere leaves no primitive behind") {
    const Scene scene = load_patched(R"({"groups": {"spare": [{"material": "m",
        "primitives": [{"sphere": {"centre": [0, 0, 0], "radius": 1}}]}]}})");
    CHECK(scene.primitives.empty());
    CHECK(scene.vertices.empty());
}

TEST_CASE("vertices have texture coordinates when a material asks for them, and none otherwise") {
    const TemporaryFolder folder;
    Json scene = base();
    scene["entities"] = Json::parse(R"([{"material": "m", "primitives": [
        {"quad": {"corner": [0, 0, 0], "edges": [[1, 0, 0], [0, 1, 0]]}},
        {"triangle": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}, {"sphere": {"centre": [0, 0, 0], "radius": 1}}]}])");
    CHECK(load(folder, scene).texture_coordinates.empty());
    scene["textures"] =
        Json::parse(R"({"t": {"kind": "checker", "colours": [[0, 0, 0], [1, 1, 1]], "space": "coordinates"}})");
    CHECK(load(folder, scene).texture_coordinates.empty());  // defined, but of no material
    scene["materials"]["spare"] = {{"kind", "diffuse"}, {"colour", {{"texture", "t"}}}};
    CHECK(load(folder, scene).texture_coordinates.empty());  // of a material, but of no entity
    scene["materials"]["m"]["colour"] = {{"texture", "t"}};
    const Scene textured = load(folder, scene);
    REQUIRE(textured.texture_coordinates.size() == textured.vertices.size());
    const glm::dvec2 quad[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, triangle[] = {{0, 0}, {1, 0}, {0, 1}};
    for (std::size_t i = 0; i < 4; ++i) CHECK(textured.texture_coordinates[i] == quad[i]);
    for (std::size_t i = 0; i < 3; ++i) CHECK(textured.texture_coordinates[4 + i] == triangle[i]);
}
