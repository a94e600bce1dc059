// What scene files become in memory. Everything else is refused in one line that says where and why. scene_samples.json
// holds the samples that the JSON Schema is tested with too (check_scenes.py).
#include <doctest/doctest.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "common/error.h"
#include "common/scene/loader/json.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/common/draw.h"
#include "tests/refusal.h"
#include "tests/temporary_folder.h"

using namespace tandem;

namespace {

void put(const std::filesystem::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

Scene load_text(const std::string& text) {
    const TemporaryFolder folder;
    put(folder / "scene.json", text);
    return load_scene(folder / "scene.json");
}

// The line of the refusal without the folder, or "accepted".
std::string refusal_of_file(const std::filesystem::path& path) {
    try {
        (void)load_scene(path);
    } catch (const InputError& error) {
        const std::string line = error.what();
        CHECK(line.find('\n') == std::string::npos);
        CHECK(line.starts_with(path.string() + ": "));
        return line.substr(path.string().size() + 2);
    }
    return "accepted";
}

std::string refusal(const std::string& text) {
    const TemporaryFolder folder;
    put(folder / "scene.json", text);
    return refusal_of_file(folder / "scene.json");
}

nlohmann::json samples() {
    std::ifstream stream(TANDEM_SOURCE_DIR "/tests/common/scene_samples.json");
    return nlohmann::json::parse(stream);
}

std::string scene_with_entity(const std::string& entity) {
    return R"({"camera": {"position": [0, 0, 5], "target": [0, 0, 0], "vertical_field_degrees": 40},
        "materials": {"m": {"kind": "diffuse", "colour": [0.5, 0.25, 1]}}, "entities": [)" +
           entity + "]}";
}

std::string scene_with_transform(const std::string& steps) {
    return scene_with_entity(R"({"material": "m", "transform": )" + steps +
                             R"(, "primitives": [{"sphere": {"centre": [1, 2, 3], "radius": 1}}]})");
}

glm::dvec3 placed_centre(const std::string& steps) {
    const Scene scene = load_text(scene_with_transform(steps));
    return glm::dvec3(scene.entities.at(0).object_to_world * glm::dvec4(scene.vertices.at(0), 1.0));
}

// What loading makes of an OBJ model with this text.
std::string obj_refusal(const std::string& text) {
    const TemporaryFolder folder;
    put(folder / "model.obj", text);
    put(folder / "scene.json",
        scene_with_entity(R"({"material": "m", "primitives": [{"obj": {"file": "model.obj"}}]})"));
    return refusal_of_file(folder / "scene.json");
}

Scene obj_scene(const std::string& text) {
    const TemporaryFolder folder;
    put(folder / "model.obj", text);
    put(folder / "scene.json",
        scene_with_entity(R"({"material": "m", "primitives": [{"obj": {"file": "model.obj"}}]})"));
    return load_scene(folder / "scene.json");
}

}  // namespace

TEST_CASE("every sample is accepted or refused with pointer and reason") {
    const nlohmann::json data = samples();
    CHECK(data["samples"].size() >= 200);
    for (const nlohmann::json& sample : data["samples"]) {
        CAPTURE(sample["name"].get<std::string>());
        nlohmann::json scene = data["base"];
        scene.merge_patch(sample["change"]);
        const std::string line = refusal(scene.dump());
        if (!sample.contains("reason")) {
            CHECK(line == "accepted");
            continue;
        }
        const std::string pointer = sample["pointer"];
        CAPTURE(line);
        CHECK(line.starts_with(pointer.empty() ? "" : pointer + ": "));
        CHECK(contains(line, sample["reason"].get<std::string>()));
        CHECK(contains(line, "; "));  // the mend
    }
}

TEST_CASE("what is left out takes its documented default") {
    const Scene scene =
        load_text(R"({"camera": {"position": [0, 0, 5], "target": [0, 0, 0], "vertical_field_degrees": 40}})");
    CHECK(scene.name == "scene");
    CHECK(scene.film.width == 512);
    CHECK(scene.film.height == 512);
    CHECK(scene.camera.up == glm::dvec3(0, 1, 0));
    CHECK(scene.camera.lens_radius == 0.0);
    CHECK(scene.background.up == glm::dvec3(0.0));
    CHECK(scene.defaults.integrator == Integrator::path);
    CHECK(scene.defaults.bounces == 12);
    CHECK(scene.defaults.roulette_start == no_roulette);
    CHECK(scene.defaults.ray_min == 0.0);
    CHECK(std::isinf(scene.defaults.ray_max));
    CHECK(scene.entities.empty());
    CHECK_FALSE(scene.expect.has_value());
}

TEST_CASE("every field of a file reaches the scene") {
    const Scene scene = load_text(R"({
        "film": {"width": 3, "height": 4},
        "camera": {"position": [1, 2, 3], "target": [4, 5, 6], "up": [0, 0, 1], "vertical_field_degrees": 50,
            "lens_radius": 0.25, "focus_distance": 7},
        "background": {"down": [1, 2, 3], "up": [4, 5, 6]},
        "render": {"integrator": "next-event", "bounces": 5, "roulette_start": 3, "ray_min": 0.5, "ray_max": 100},
        "materials": {"glass": {"kind": "emissive", "colour": [0.1, 0.2, 0.3], "radiance": [7, 8, 9], "sides": "front",
            "translucent": true, "alpha": 0.4, "fuzz": 0.6, "refractive_index": 1.7, "fresnel": "schlick"}},
        "entities": [{"name": "e", "material": "glass", "primitives": [
            {"sphere": {"centre": [1, 2, 3], "radius": 4}}, {"cuboid": {"minimum": [0, 1, 2], "maximum": [3, 4, 5]}},
            {"triangle": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}]}],
        "expect": {"radiance": [1, 2, 3], "formula": "f"}})");
    CHECK(scene.film.width == 3);
    CHECK(scene.film.height == 4);
    CHECK(scene.camera.target == glm::dvec3(4, 5, 6));
    CHECK(scene.camera.up == glm::dvec3(0, 0, 1));
    CHECK(scene.camera.lens_radius == 0.25);
    CHECK(scene.camera.focus_distance == 7.0);
    CHECK(scene.background.down == glm::dvec3(1, 2, 3));
    CHECK(scene.background.up == glm::dvec3(4, 5, 6));
    CHECK(scene.defaults.integrator == Integrator::next_event);
    CHECK(scene.defaults.bounces == 5);
    CHECK(scene.defaults.roulette_start == 3);
    CHECK(scene.defaults.ray_min == 0.5);
    CHECK(scene.defaults.ray_max == 100.0);
    const Material& material = scene.materials.at(0);
    CHECK(material.name == "glass");
    CHECK(material.kind == MaterialKind::emissive);
    CHECK(material.colour == glm::dvec3(0.1, 0.2, 0.3));
    CHECK(material.radiance == glm::dvec3(7, 8, 9));
    CHECK(material.sides == EmittingSides::front);
    CHECK(material.translucent);
    CHECK(material.alpha == 0.4);
    CHECK(material.fuzz == 0.6);
    CHECK(material.refractive_index == 1.7);
    CHECK(material.fresnel == Fresnel::schlick);
    REQUIRE(scene.primitives.size() == 3);
    CHECK(scene.primitives[0].radius == 4.0);
    CHECK(scene.vertices[scene.primitives[1].index[1]] == glm::dvec3(3, 4, 5));
    CHECK(scene.vertices[scene.primitives[2].index[1]] == glm::dvec3(1, 0, 0));
    REQUIRE(scene.expect.has_value());
    CHECK(scene.expect->radiance == glm::dvec3(1, 2, 3));
}

TEST_CASE("steps of a transform act in the order written") {
    CHECK(placed_centre("[]") == glm::dvec3(1, 2, 3));
    CHECK(placed_centre(R"([{"scale": 2}, {"translate": [10, 0, 0]}])") == glm::dvec3(12, 4, 6));
    CHECK(placed_centre(R"([{"translate": [10, 0, 0]}, {"scale": [2, 1, -1]}])") == glm::dvec3(22, 2, -3));
    CHECK(placed_centre(R"([{"matrix": [1, 2, 3, 4, 0, 1, 0, 5, 0, 0, 1, 6, 0, 0, 0, 1]}])") == glm::dvec3(18, 7, 9));
}

TEST_CASE("rotations are counter-clockwise for an observer towards whom the axis points") {
    const glm::dvec3 about_z = placed_centre(R"([{"rotate": {"axis": [0, 0, 5], "degrees": 90}}])");
    CHECK(glm::distance(about_z, glm::dvec3(-2, 1, 3)) < 1e-15);
    const glm::dvec3 about_y = placed_centre(R"([{"rotate": {"axis": [0, 1, 0], "degrees": 90}}])");
    CHECK(glm::distance(about_y, glm::dvec3(3, 2, -1)) < 1e-15);
}

TEST_CASE("a quad is two triangles whose front is along the product of its edges") {
    const Scene scene = load_text(scene_with_entity(
        R"({"material": "m", "primitives": [{"quad": {"corner": [1, 1, 1], "edges": [[2, 0, 0], [0, 3, 0]]}}]})"));
    REQUIRE(scene.primitives.size() == 2);
    for (const Primitive& triangle : scene.primitives) {
        const glm::dvec3 a = scene.vertices[triangle.index[0]];
        CHECK(glm::cross(scene.vertices[triangle.index[1]] - a, scene.vertices[triangle.index[2]] - a) ==
              glm::dvec3(0, 0, 6));
    }
}

TEST_CASE("a file that is missing, a folder, a device or unreadable is refused") {
    const TemporaryFolder folder;
    CHECK(contains(refusal_of_file(folder / "none.json"), "no such file"));
    CHECK(contains(refusal_of_file(folder / "none/deeper.json"), "no such file"));
    std::filesystem::create_directory(folder / "d.json");
    CHECK(contains(refusal_of_file(folder / "d.json"), "is a folder"));
    CHECK(contains(refusal_of_file("/dev/zero"), "is not a regular file"));
}

TEST_CASE("text that is not JSON is refused with line and column") {
    CHECK(contains(refusal("{\n  \"camera\": nan}"), "line 2, column 14: not JSON"));
    CHECK(contains(refusal("{\"film\": {},}"), "line 1, column 13: not JSON"));
    CHECK(contains(refusal("{\"film\": Infinity}"), "not JSON"));
    CHECK(contains(refusal("// scene\n{}"), "line 1, column 1: not JSON"));
    CHECK(contains(refusal(""), "not JSON"));
    CHECK(contains(refusal("{} {}"), "not JSON"));
    CHECK(contains(refusal("{\"a\": \"\xff\"}"), "not JSON"));
    CHECK(contains(refusal(std::string("{\0}", 3)), "not JSON"));
    CHECK(contains(refusal("[1, 2]"), "is an array; write an object"));
    CHECK(contains(refusal("null"), "is null; write an object"));
}

TEST_CASE("a number beyond double precision is refused with its place") {
    CHECK(contains(refusal("{\n\"a\": 1e999}"), "line 2, column"));
    CHECK(contains(refusal("{\"a\": 1e999}"), "beyond double precision"));
    CHECK(contains(refusal("{\"a\": -1e999}"), "beyond double precision"));
}

TEST_CASE("a key that stands twice is refused with its pointer") {
    CHECK(refusal(R"({"film": {"width": 1, "height": 2, "width": 3}})") ==
          "/film/width: the key stands twice in this object; keep one of the two");
    CHECK(refusal(R"({"entities": [{}, {"a/b": 1, "a/b": 2}]})").starts_with("/entities/1/a~1b: "));
}

TEST_CASE("bombs of depth and size are refused in bounded time") {
    const std::clock_t start = std::clock();
    CHECK(contains(refusal(std::string(1'000'000, '[')), "nested deeper than 64 levels"));
    std::string objects;
    for (int i = 0; i < 100'000; ++i) objects += "{\"a\":";
    CHECK(contains(refusal(objects), "nested deeper than 64 levels"));
    CHECK(contains(refusal(std::string((std::size_t{16} << 20) + 1, ' ')), "is larger than 16 MiB"));
    std::string keys = "{";
    for (int i = 0; i < 200'000; ++i) keys += "\"k" + std::to_string(i) + "\":0,";
    CHECK(contains(refusal(keys + "\"z\":0}"), "unknown key"));
    CHECK(contains(refusal("{\"" + std::string(1'000'000, 'x') + "\":0}"), "unknown key"));
    CHECK(std::clock() - start < 60 * CLOCKS_PER_SEC);  // seconds, even under sanitizers
}

TEST_CASE("an odd key cannot break the line of the message") {
    const std::string line = refusal("{\"new\\nline\\u0007\": 0}");
    CHECK(contains(line, "/new\\x0aline\\x07: unknown key"));
}

TEST_CASE("an OBJ model gives its faces as triangles, front as in the file") {
    const Scene scene = obj_scene(
        "# a square and a triangle\r\nv 0 0 0\r\nv +1 0 0 1.0\r\nv 1 1 0\r\nv 0 1e0 0\r\n"
        "vn 0 0 1\nmtllib none.mtl\nusemtl none\ng group\n"
        "f 1//1 2//1 3//1 4//1\nf -4 -3 -2\n");
    REQUIRE(scene.primitives.size() == 3);
    CHECK(scene.entities.at(0).primitive_count == 3);
    for (const Primitive& triangle : scene.primitives) {
        const glm::dvec3 a = scene.vertices[triangle.index[0]];
        const glm::dvec3 normal =
            glm::cross(scene.vertices[triangle.index[1]] - a, scene.vertices[triangle.index[2]] - a);
        CHECK(normal == glm::dvec3(0, 0, 1));
    }
}

TEST_CASE("a concave polygon of an OBJ model keeps its area") {
    const Scene scene = obj_scene("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n");
    REQUIRE(scene.primitives.size() == 3);
    double area = 0.0;
    for (const Primitive& triangle : scene.primitives) {
        const glm::dvec3 a = scene.vertices[triangle.index[0]];
        area += 0.5 * glm::cross(scene.vertices[triangle.index[1]] - a, scene.vertices[triangle.index[2]] - a).z;
    }
    CHECK(area == doctest::Approx(10.0));  // 16 less the notch of 4 · 3 / 2
}

TEST_CASE("a polygon that tinyobjloader cuts wrongly is refused, not rendered inside out") {
    // A dart whose shorter diagonal lies outside it.
    CHECK(contains(obj_refusal("v 0 0 0\nv 4 1 0\nv 3 0 0\nv 4 -1 0\nf 1 4 3 2\n"),
        "line 5: a polygon cannot be cut into triangles"));
}

TEST_CASE("a model named twice shares its vertices") {
    const TemporaryFolder folder;
    put(folder / "m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::string entity = R"({"material": "m", "primitives": [{"obj": {"file": "m.obj"}}]})";
    put(folder / "scene.json", scene_with_entity(entity + "," + entity));
    const Scene scene = load_scene(folder / "scene.json");
    CHECK(scene.vertices.size() == 3);
    CHECK(scene.primitives.size() == 2);
    CHECK(scene.entities.at(1).first_primitive == 1);
}

TEST_CASE("an unsound OBJ model is refused with its line") {
    const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    const auto refused = [&](const std::string& text, const std::string& reason) {
        CAPTURE(text);
        const std::string line = obj_refusal(text);
        CAPTURE(line);
        CHECK(line.starts_with("/entities/0/primitives/0/obj/file: model.obj: "));
        CHECK(contains(line, reason));
    };
    refused("", "holds no face");
    refused(corners, "holds no face");
    refused("v nan 0 0\n" + corners + "f 1 2 3\n", "line 1: \"nan\" is no coordinate");
    refused("v 0 inf 0\n", "is no coordinate");
    refused("v 0 0 1e999\n", "is no coordinate");
    refused("v 0 0 1e30\n", "is no coordinate");
    refused("v 0 0\n", "is no coordinate");
    refused("v 0 0 0x1p3\n", "is no coordinate");
    refused(corners + "f 1 2 4\n", "line 4: vertex 4 is not among the 3 before it");
    refused(corners + "f 1 2 -4\n", "vertex -4 is not among the 3 before it");
    refused(corners + "f 0 1 2\n", "vertex 0 is not among");
    refused("f 1 2 3\n" + corners, "line 1: vertex 1 is not among the 0 before it");
    refused(corners + "f 1 2\n", "three corners at least");
    refused(corners + "f 1 2 x\n", "\"x\" is no vertex index");
    refused(corners + "f 1 2 99999999999999999999\n", "is no vertex index");
    refused(std::string("\x7f\x45\x4c\x46\0\0\n\xff\xfe", 9), "holds no face");
    std::string many = corners + "f";
    for (int i = 0; i < 100; ++i) many += " 1";
    refused(many + "\n", "more than 64 corners");
}

TEST_CASE("messages show no control character, of one byte or of two") {
    CHECK(printable("a\x1b[31m\x7f") == "a\\x1b[31m\\x7f");
    CHECK(printable("a\xc2\x9b\x33\x31m") == "a\\xc2\\x9b31m");  // U+009B begins a sequence as ESC [ does
    CHECK(printable("\xc2\xa0\xc3\xa4") == "\xc2\xa0\xc3\xa4");
}

TEST_CASE("mutilated scene files are loaded or refused, never anything else") {
    std::ifstream stream(TANDEM_SOURCE_DIR "/scenes/cornell-thesis.json");
    const std::string whole((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    const TemporaryFolder folder;
    test::Draw draw;
    constexpr std::string_view bytes = "\"[]{},:-+.0123456789eE\\ntruefalse\x01\xff";
    int refused = 0;
    constexpr int rounds = 1500;
    for (int round = 0; round < rounds; ++round) {
        std::string text = whole;
        for (std::size_t change = 0; change <= draw(3); ++change) {
            const std::size_t place = draw(text.size());
            switch (draw(3)) {
                case 0:
                    text[place] = bytes[draw(bytes.size())];
                    break;
                case 1:
                    text.erase(place, 1 + draw(40));
                    break;
                default:
                    text.insert(place, 1, bytes[draw(bytes.size())]);
            }
        }
        put(folder / "scene.json", text);
        try {
            (void)load_scene(folder / "scene.json");
        } catch (const InputError&) {
            ++refused;
        }
    }
    CHECK(refused > rounds / 2);  // and whatever else is thrown fails the test
}
