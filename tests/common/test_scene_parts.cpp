// What textures, media, lights, motion, groups and models of a scene file come to in memory, and unsound files beside
// it.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "common/error.h"
#include "common/image_io.h"
#include "common/scene_loader.h"
#include "tests/temporary_folder.h"

using namespace tandem;

namespace {

using Json = nlohmann::json;

void put(const std::filesystem::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

Json base() {
    return Json::parse(R"({"camera": {"position": [0, 0, 5], "target": [0, 0, 0], "vertical_field_degrees": 40},
        "materials": {"m": {"kind": "diffuse", "colour": [0.5, 0.25, 1]}}, "entities": []})");
}

Scene load(const TemporaryFolder& folder, const Json& scene) {
    put(folder / "scene.json", scene.dump());
    return load_scene(folder / "scene.json");
}

Scene load_patched(const std::string& patch) {
    const TemporaryFolder folder;
    Json scene = base();
    scene.merge_patch(Json::parse(patch));
    return load(folder, scene);
}

std::string refusal(const TemporaryFolder& folder, const Json& scene) {
    try {
        (void)load(folder, scene);
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

bool names(const std::string& line, const std::string& part) { return line.find(part) != std::string::npos; }

Json image_scene(const std::string& file, const std::string& space) {
    Json scene = base();
    scene["textures"]["t"] = {{"kind", "image"}, {"file", file}, {"colour_space", space}};
    scene["materials"]["m"]["colour"] = {{"texture", "t"}};
    return scene;
}

void put_pfm(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height, std::vector<float> values) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    image.pixels = std::move(values);
    write_image(path, image);
}

// A triangle (0,0,0), (1,0,0), (0,1,0) whose second corner has coordinates (1, 0.25) from the top, in a node mirrored
// along x and moved to x = 10.
Json gltf_triangle(const std::string& buffer_uri) {
    return {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", {0}}}}},
        {"nodes", {{{"children", {1}}, {"translation", {10, 0, 0}}}, {{"mesh", 0}, {"scale", {-1, 1, 1}}}}},
        {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}, {"indices", 2}}}}}}},
        {"buffers", {{{"byteLength", 66}, {"uri", buffer_uri}}}},
        {"bufferViews", {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", 36}},
                            {{"buffer", 0}, {"byteOffset", 36}, {"byteLength", 24}},
                            {{"buffer", 0}, {"byteOffset", 60}, {"byteLength", 6}}}},
        {"accessors", {{{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}, {"min", {0, 0, 0}},
                           {"max", {1, 1, 0}}},
                          {{"bufferView", 1}, {"componentType", 5126}, {"count", 3}, {"type", "VEC2"}},
                          {{"bufferView", 2}, {"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}}}}};
}

std::string gltf_buffer() {
    const float numbers[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25F, 0, 1};
    const std::uint16_t indices[] = {0, 1, 2};
    std::string bytes(66, '\0');
    std::memcpy(bytes.data(), numbers, 60);
    std::memcpy(bytes.data() + 60, indices, 6);
    return bytes;
}

// The same triangle in one file.
std::string gltf_binary() {
    Json document = gltf_triangle("");
    document["buffers"][0].erase("uri");
    std::string json = document.dump(), data = gltf_buffer();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    data.resize((data.size() + 3) / 4 * 4, '\0');
    const auto word = [](std::size_t value) {
        const auto bits = static_cast<std::uint32_t>(value);
        return std::string(reinterpret_cast<const char*>(&bits), 4);
    };
    return "glTF" + word(2) + word(28 + json.size() + data.size()) + word(json.size()) + "JSON" + json +
           word(data.size()) + std::string("BIN\0", 4) + data;
}

Json model_scene(const std::string& kind, const std::string& file, bool coordinates) {
    Json scene = base();
    scene["entities"] = {{{"material", "m"}, {"primitives", {{{kind, {{"file", file}}}}}}}};
    if (coordinates) {
        scene["textures"]["t"] = {{"kind", "checker"}, {"colours", {{0, 0, 0}, {1, 1, 1}}}, {"space", "coordinates"}};
        scene["materials"]["m"]["colour"] = {{"texture", "t"}};
    }
    return scene;
}

std::string volume(
    std::int32_t encoding, std::array<std::int32_t, 3> cells, std::int32_t channels, const std::vector<float>& values) {
    std::string bytes = "VOL\x03";
    const auto append = [&](const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); };
    append(&encoding, 4);
    append(cells.data(), 12);
    append(&channels, 4);
    const float box[] = {-1, -2, -3, 1, 2, 3};
    append(box, sizeof box);
    append(values.data(), values.size() * sizeof(float));
    return bytes;
}

Json volume_scene() {
    Json scene = base();
    scene["media"]["smoke"] = {{"scattering", 2}, {"grid", {{"file", "smoke.vol"}, {"scale", 3}}}};
    return scene;
}

}  // namespace

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
        CHECK(names(line, "/textures/t/file: t.pfm: "));
        CHECK(names(line, reason));
        CHECK(names(line, "; "));
    };
    refused({0, 0, 0, 0, 1.5F, 0}, "linear", "1.5 at column 0, row 1 is out of range");
    refused({0, 0, -1, 0, 0, 0}, "srgb", "-1 at column 0, row 0");
    refused({0, std::nanf(""), 0, 0, 0, 0}, "linear", "nan at");
    refused({0, INFINITY, 0, 0, 0, 0}, "linear", "inf at");
    put(folder / "t.pfm", "PF\n3 3\n-1.0\n");
    CHECK(names(refusal(folder, image_scene("t.pfm", "linear")), "/textures/t/file: t.pfm: is not a sound PFM image"));
    put(folder / "t.pfm", "PF\n60000 60000\n-1.0\n");
    CHECK(names(refusal(folder, image_scene("t.pfm", "linear")), "larger than"));
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
        CHECK(names(line, "/media/smoke/grid/file: smoke.vol: "));
        CHECK(names(line, reason));
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

TEST_CASE("OBJ vertices are split where their texture coordinates differ") {
    const TemporaryFolder folder;
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n",
                      coordinates = "vt 0 0\nvt 1 0 0\nvt 0.5 0.25\n";
    put(folder / "m.obj", vertices + coordinates + "f 1/1 2/2 3/3\nf 1/1/7 3/-2/7 4/1/7\nf 1 2 4\n");
    CHECK(load(folder, model_scene("obj", "m.obj", false)).vertices.size() == 4);
    const Scene scene = load(folder, model_scene("obj", "m.obj", true));
    REQUIRE(scene.primitives.size() == 3);
    REQUIRE(scene.texture_coordinates.size() == scene.vertices.size());
    const auto at = [&](std::size_t triangle, std::size_t corner) {
        return scene.texture_coordinates[scene.primitives[triangle].index[corner]];
    };
    const auto point = [&](std::size_t triangle, std::size_t corner) {
        return scene.vertices[scene.primitives[triangle].index[corner]];
    };
    CHECK(at(0, 2) == glm::dvec2(0.5, 0.25));
    CHECK(at(1, 1) == glm::dvec2(1, 0));
    CHECK(point(0, 2) == point(1, 1));
    CHECK(scene.primitives[0].index[0] == scene.primitives[1].index[0]);  // the same pair, shared
    CHECK(at(2, 0) == glm::dvec2(0, 0));
    CHECK(at(2, 1) == glm::dvec2(1, 0));
    CHECK(at(2, 2) == glm::dvec2(0, 1));
    CHECK(
        scene.vertices.size() == 6);  // of corners 1/1, 2/2, 3/3, 3/2, 4/1 and the last face's 4; the others are shared
    const auto refused = [&](const std::string& rest, const std::string& reason) {
        put(folder / "m.obj", vertices + rest);
        CHECK(names(refusal(folder, model_scene("obj", "m.obj", true)), reason));
    };
    refused(coordinates + "f 1/1 2/2 3\n", "line 8: some corners of a face have texture coordinates");
    refused(coordinates + "f 1/1 2/2 3/4\n", "coordinate 4 is not among the 3 before it");
    refused("vt nan 0\n", "line 5: \"nan\" is no coordinate");
    refused("vt 1\n", "is no coordinate");
}

TEST_CASE("glTF models give triangles under their nodes, mirrored ones with their fronts kept") {
    const TemporaryFolder folder;
    put(folder / "m.bin", gltf_buffer());
    put(folder / "m.gltf", gltf_triangle("m.bin").dump());
    for (const bool coordinates : {false, true}) {
        const Scene scene = load(folder, model_scene("gltf", "m.gltf", coordinates));
        REQUIRE(scene.primitives.size() == 1);
        const auto& index = scene.primitives[0].index;
        const glm::dvec3 a = scene.vertices[index[0]], b = scene.vertices[index[1]], c = scene.vertices[index[2]];
        CHECK(a == glm::dvec3(10, 0, 0));
        CHECK(glm::cross(b - a, c - a) == glm::dvec3(0, 0, 1));  // mirrored along x, it still faces z
        CHECK(scene.texture_coordinates.size() == (coordinates ? 3 : 0));
        if (!coordinates) continue;
        for (const std::uint32_t i : index)
            if (scene.vertices[i].x == 9.0) CHECK(scene.texture_coordinates[i] == glm::dvec2(1, 0.75));
    }
}

TEST_CASE("binary glTF models are read") {
    const TemporaryFolder folder;
    const std::string glb = gltf_binary();
    put(folder / "m.glb", glb);
    CHECK(load(folder, model_scene("gltf", "m.glb", true)).primitives.size() == 1);
    for (std::size_t cut = 0; cut < glb.size(); cut += 7) {
        put(folder / "m.glb", glb.substr(0, cut));
        CHECK(names(refusal(folder, model_scene("gltf", "m.glb", true)), "/entities/0/primitives/0/gltf/file"));
    }
}

TEST_CASE("unsound glTF models are refused") {
    const TemporaryFolder folder;
    put(folder / "m.bin", gltf_buffer());
    const auto refused = [&](const std::string& patch, const std::string& reason) {
        CAPTURE(patch);
        const Json document = gltf_triangle("m.bin").patch(Json::parse(patch));
        put(folder / "m.gltf", document.dump());
        const std::string line = refusal(folder, model_scene("gltf", "m.gltf", true));
        CAPTURE(line);
        CHECK(names(line, "/entities/0/primitives/0/gltf/file: m.gltf: "));
        CHECK(names(line, reason));
    };
    refused(R"([{"op": "replace", "path": "/buffers/0/uri", "value": "none.bin"}])", "no sound glTF");
    refused(R"([{"op": "replace", "path": "/buffers/0/byteLength", "value": 999}])", "no sound glTF");
    refused(R"([{"op": "replace", "path": "/accessors/0/count", "value": 4}])", "beyond its buffer");
    refused(R"([{"op": "add", "path": "/accessors/0/byteOffset", "value": 1099511627776}])", "beyond its buffer");
    refused(R"([{"op": "add", "path": "/accessors/0/byteOffset", "value": 4}])", "beyond its buffer");
    refused(R"([{"op": "replace", "path": "/bufferViews/2/byteOffset", "value": 64}])", "beyond its buffer");
    refused(R"([{"op": "replace", "path": "/accessors/0/componentType", "value": 5123}])", "another type");
    refused(R"([{"op": "replace", "path": "/accessors/2/bufferView", "value": 1},
        {"op": "add", "path": "/accessors/2/byteOffset", "value": 8}])",
        "vertex 16256 is not among 3");
    refused(R"([{"op": "replace", "path": "/accessors/0/bufferView", "value": 9}])", "names element 9 of 3");
    refused(R"([{"op": "replace", "path": "/accessors/1/count", "value": 2}])", "not one texture coordinate a vertex");
    refused(R"([{"op": "replace", "path": "/scenes/0/nodes/0", "value": 5}])", "names element 5 of 2");
    refused(R"([{"op": "add", "path": "/nodes/1/children", "value": [0]}])", "no tree");
    refused(R"([{"op": "add", "path": "/nodes/0/children/1", "value": 1}])", "no tree");
    refused(R"([{"op": "add", "path": "/meshes/0/primitives/0/mode", "value": 5}])", "a primitive of mode 5");
    refused(
        R"([{"op": "add", "path": "/extensionsRequired", "value": ["KHR_draco_mesh_compression"]}])", "requires the");
    refused(R"([{"op": "remove", "path": "/scenes"}])", "has no scene");
    refused(R"([{"op": "replace", "path": "/asset/version", "value": "1.0"}])", "is glTF of version \"1.0\"");
    refused(R"([{"op": "add", "path": "/accessors/0/byteOffset", "value": -4}])", "\"byteOffset\" is -4");
    refused(R"([{"op": "add", "path": "/bufferViews/0/byteStride", "value": -12}])", "\"byteStride\" is -12");
    refused(R"([{"op": "replace", "path": "/meshes/0/primitives/0/indices", "value": 1.5}])", "\"indices\" is 1.5");
    refused(R"([{"op": "add", "path": "/nodes/0/children/0", "value": "1"}])", "\"children\" is \"1\"");
    refused(R"([{"op": "add", "path": "/nodes/0/rotation", "value": [0, 0, 0, 0]}])", "no sound rotation");
    refused(R"([{"op": "add", "path": "/nodes/1/matrix", "value": [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}])",
        "not affine");
    put(folder / "m.gltf", "{\"asset\": " + std::string(100, '[') + "}");
    CHECK(names(refusal(folder, model_scene("gltf", "m.gltf", false)), "nested deeper than 64 levels"));
}

TEST_CASE("mutilated models, volumes and images are loaded or refused, never anything else") {
    const TemporaryFolder folder;
    put(folder / "m.bin", gltf_buffer());
    put_pfm(folder / "t.pfm", 2, 2, std::vector<float>(12, 0.5F));
    const auto read = [&](const std::string& name) {
        std::ifstream stream(folder / name, std::ios::binary);
        return std::string((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    };
    const struct {
        std::string name, bytes;
        Json scene;
    } files[] = {{"m.gltf", gltf_triangle("m.bin").dump(), model_scene("gltf", "m.gltf", true)},
        {"m.glb", gltf_binary(), model_scene("gltf", "m.glb", true)},
        {"smoke.vol", volume(1, {2, 1, 3}, 1, {0, 1, 2, 3, 4, 5}), volume_scene()},
        {"t.pfm", read("t.pfm"), image_scene("t.pfm", "linear")},
        {"m.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0.5\nf 1/1 2/2 3/1 4/2\n",
            model_scene("obj", "m.obj", true)}};
    std::uint64_t state = 1;
    const auto draw = [&](std::size_t below) {  // xorshift64 [Marsaglia 2003]
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        return static_cast<std::size_t>(state % below);
    };
    for (const auto& file : files) {
        CAPTURE(file.name);
        int refused = 0;
        for (int round = 0; round < 600; ++round) {
            std::string bytes = file.bytes;
            for (std::size_t change = 0; change <= draw(3); ++change) {
                const std::size_t place = draw(bytes.size());
                switch (draw(4)) {
                    case 0:
                        bytes[place] = static_cast<char>(draw(256));
                        break;
                    case 1:
                        bytes[place] = "0123456789[]{}\",:-"[draw(18)];
                        break;
                    case 2:
                        bytes.erase(place, 1 + draw(std::min<std::size_t>(20, bytes.size() - place)));
                        break;
                    default:
                        bytes.insert(place, 1, static_cast<char>(draw(256)));
                }
                if (bytes.empty()) bytes.push_back('x');
            }
            put(folder / file.name, bytes);
            refused += refusal(folder, file.scene) != "accepted" ? 1 : 0;
        }
        CHECK(refused > 100);  // and whatever else is thrown fails the test
    }
}
