#include <doctest/doctest.h>
#include <fmt/format.h>

#include "common/error.h"
#include "common/files/read_file.h"
#include "common/files/write_file.h"
#include "common/scene/export/export.h"
#include "common/scene/import/import.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/common/scene_texts.h"

namespace tandem::test {
namespace {

using namespace scene_export;

const std::filesystem::path scenes = std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes";

Scene shipped(const std::string& name) { return load_scene(scenes / (name + ".json")); }

// One table for what is said alike or nearly, with the reasons below it.
std::string table() {
    std::string text = "| | gltf | pbrt | mitsuba | blender |\n|---|---|---|---|---|\n";
    constexpr const char* words[] = {"exact", "near", "kept", "**refused**"};
    for (const Feature& feature : features()) {
        text += fmt::format("| {} ", feature.name);
        for (const Saying& saying : feature.says)
            text += fmt::format("| {}{} ", words[static_cast<std::size_t>(saying.can)],
                saying.reason.empty() ? "" : fmt::format(": {}.", saying.reason));
        text += "|\n";
    }
    return text;
}

std::string line_of(const Scene& scene, Target target, bool strict = false) {
    try {
        (void)export_scene(scene, target, {.name = "a.gltf", .strict = strict});
    } catch (const InputError& error) {
        return error.what();
    }
    return "exported";
}

}  // namespace

// TANDEM_WRITE_TABLE=1 puts the table into the page.
TEST_CASE("EXPORT.md has the table of features") {
    const std::filesystem::path page = scenes / "format" / "EXPORT.md";
    std::string text = read_file(page);
    const std::string head = "*refused*: not written.\n\n", tail = "\n## What comes in";
    const std::size_t begin = text.find(head) + head.size(), end = text.find(tail);
    REQUIRE(begin < end);
    if (std::getenv("TANDEM_WRITE_TABLE") != nullptr) write_text_file(page, text.replace(begin, end - begin, table()));
    CHECK((text.substr(begin, text.find(tail) - begin) == table()));
}

TEST_CASE("a target refuses what it cannot say, with the reason and the mend") {
    CHECK(contains(
        line_of(shipped("glass"), Target::pbrt), "glass: pbrt cannot say: mirrors, in the material brushed metal: "));
    CHECK(contains(line_of(shipped("textures"), Target::blender), "blender cannot say: images on spheres, in "));
    CHECK(contains(line_of(shipped("whitted"), Target::mitsuba), "mitsuba cannot say: integrator whitted"));
    CHECK(contains(line_of(shipped("cloud"), Target::blender), "blender cannot say: "));
    CHECK(
        contains(line_of(shipped("nested-glass"), Target::pbrt), "pbrt cannot say: priorities, in the material glass"));
    CHECK(contains(line_of(shipped("closed-forms/motion"), Target::pbrt), "pbrt cannot say: lamps that move"));
    CHECK(contains(line_of(shipped("glass"), Target::gltf, true), "leave --strict out"));
    CHECK(line_of(shipped("glass"), Target::gltf) == "exported");
}

TEST_CASE("a lamp on both sides goes to Mitsuba if nothing is inside of it") {
    Scene scene = shipped("conductors");  // its cool lamp is a ball
    scene.background.down = scene.background.up;
    for (Texture& texture : scene.textures) texture.space = TextureSpace::coordinates;
    CHECK(line_of(scene, Target::mitsuba) == "exported");
    const auto lamp = std::ranges::find(scene.entities, std::string("cool lamp"), &Entity::name);
    REQUIRE(lamp != scene.entities.end());
    lamp->object_to_world[3] += glm::dvec4(scene.camera.position - glm::dvec3(3.2, 3.8, 2.0), 0.0);
    CHECK(contains(line_of(scene, Target::mitsuba), "mitsuba cannot say: lamps that emit on both sides"));
}

TEST_CASE("one mesh of a glTF model comes without its node's transform") {
    const TemporaryFolder folder;
    const auto files = export_scene(shipped("smooth"), Target::gltf, {.name = "a.gltf"});
    put(folder / "a.gltf", files.front().bytes);
    Json scene = base();
    const auto entity = [](const Json& gltf) { return Json{{"material", "m"}, {"primitives", {{{"gltf", gltf}}}}}; };
    scene["entities"] = {entity({{"file", "a.gltf"}, {"mesh", 1}}), entity({{"file", "a.gltf"}})};
    const Scene loaded = load(folder, scene);
    CHECK(loaded.entities[0].primitive_count > 0);
    CHECK(loaded.entities[0].primitive_count < loaded.entities[1].primitive_count);
    scene["entities"] = {entity({{"file", "a.gltf"}, {"mesh", 99}})};
    CHECK(contains(refusal(folder, scene), "meshes, and no mesh 99"));
    scene["entities"] = {Json{{"material", "m"}, {"primitives", {{{"obj", {{"file", "a.obj"}, {"mesh", 0}}}}}}}};
    CHECK(contains(refusal(folder, scene), "an OBJ model has no meshes by number"));
}

TEST_CASE("volumes of glTF glass absorb as their attenuation says") {
    const TemporaryFolder folder;
    Scene source = shipped("closed-forms/slab");
    source.background = {};
    source.media.emplace_back().absorption = {0.5, 0.1, 3.0};
    for (Material& material : source.materials)
        if (material.translucent) material.interior = 0;
    const auto files = export_scene(source, Target::gltf, {.name = "a.gltf", .strict = true});
    put(folder / "a.gltf", files.front().bytes);
    Json scene = base();
    scene["entities"] = {{{"primitives", {{{"gltf", {{"file", "a.gltf"}}}}}}}};
    const Scene loaded = load(folder, scene);
    REQUIRE(loaded.media.size() == 1);
    for (int c = 0; c < 3; ++c)
        CHECK(loaded.media[0].absorption[c] == doctest::Approx(source.media[0].absorption[c]).epsilon(1e-12));
}

TEST_CASE("unsound glTF is refused by import in one line") {
    const TemporaryFolder folder;
    const auto line = [&](const std::string& text) {
        put(folder / "a.gltf", text);
        try {
            (void)scene_import::import_scene(folder / "a.gltf", folder / "a.json");
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("imported");
    };
    CHECK(contains(line("{"), "a.gltf"));
    CHECK(contains(line(R"({"scenes": [{}]})"), "has no camera"));
    CHECK(contains(line(R"({"scene": 3, "scenes": [{}]})"), "/scene"));
    CHECK(contains(line(R"({"scenes": [{"nodes": [0]}], "nodes": [{"children": [0]}]})"), "no tree"));
    CHECK(contains(line(R"({"scenes": [{"nodes": [0]}], "nodes": [{"camera": 0, "scale": [2, 2, 2]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1}}]})"),
        "a camera is scaled"));
    CHECK(contains(line(R"({"scenes": [{"nodes": [0]}], "nodes": [{"camera": 0}],
        "cameras": [{"type": "orthographic"}]})"),
        "is no perspective camera"));
}

}  // namespace tandem::test
