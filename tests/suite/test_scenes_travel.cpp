// Scenes that were exported and imported again look as before: the verdict says so, of images of other seeds.
#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "common/files/write_file.h"
#include "common/image/image_io_parts.h"
#include "common/scene/export/export.h"
#include "common/scene/import/import.h"
#include "common/scene/loader/scene_loader.h"
#include "common/validation/compare/compare.h"
#include "tests/refusal.h"
#include "tests/suite/tracers.h"
#include "tests/temporary_folder.h"

namespace tandem::test {
namespace {

using scene_export::ExportOptions;
using scene_export::Target;
using scene_import::Json;

Scene shipped(const std::string& name) {
    return load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / (name + ".json"));
}

void write(const std::vector<scene_export::ExportedFile>& files, const TemporaryFolder& folder) {
    for (const auto& file : files) write_text_file(folder / file.name, file.bytes);
}

// To `name` and back. `change` is done to the export's text in between.
Scene there_and_back(const Scene& scene, Target target, const ExportOptions& options,
    const std::function<void(std::string&)>& change = {}) {
    const TemporaryFolder folder;
    auto files = export_scene(scene, target, options);
    if (change) change(files.front().bytes);
    write(files, folder);
    const auto imported = scene_import::import_scene(folder / options.name, folder / "again.json");
    write(imported.files, folder);
    return parse_scene(imported.document.dump(), folder / "again.json");
}

Image image_by_cpu(const Scene& scene, std::uint64_t seed, std::uint64_t samples) {
    RenderSettings settings = with_longer_side(default_settings(scene), 32);
    settings.seed = seed;
    if (settings.integrator == Integrator::bidirectional) settings.integrator = Integrator::next_event;
    const auto renderer = cpu_backend().create({});
    return image_of(renderer->prepare(scene, settings)->render({0, samples}).estimate, {});
}

Verdict verdict_on(const Scene& scene, const Scene& again, std::uint64_t samples = 256) {
    CompareOptions options;
    options.criteria.margins.image = 0.05;
    options.criteria.margins.tile = 0.5;
    const SceneVerdict verdict =
        compare_images({{"a", image_by_cpu(scene, 1, samples)}}, {{"b", image_by_cpu(again, 2, samples)}}, options);
    if (verdict.verdict != Verdict::agree) MESSAGE(scene.name, ": ", verdict.sentence);
    return verdict.verdict;
}

}  // namespace

TEST_CASE("shipped scenes agree with what comes back from glTF") {
    for (const char* name : {"glass", "conductors", "environment", "smooth", "nested-glass", "lights", "motion",
             "boundaries", "moons", "cornell-thesis"}) {
        CAPTURE(std::string(name));
        const Scene scene = shipped(name);
        CHECK(verdict_on(scene, there_and_back(scene, Target::gltf, {.name = "a.gltf"})) == Verdict::agree);
    }
}

TEST_CASE("textures agree with what comes back of them from glTF" * doctest::skip(!image_files::has_library())) {
    const Scene scene = shipped("textures");
    CHECK(verdict_on(scene, there_and_back(scene, Target::gltf, {.name = "a.gltf"})) == Verdict::agree);
}

TEST_CASE("what glTF says by itself comes back without extras") {
    for (const char* name : {"cornell-classic", "lights", "closed-forms/polygon-light"}) {
        CAPTURE(std::string(name));
        Scene scene = shipped(name);
        scene.background = {};
        if (scene.lights.empty() && name != std::string("cornell-classic"))
            scene.lights.push_back(
                {.name = "sun", .kind = PunctualKind::sun, .direction = {0, -0.8, -0.6}, .intensity = {2.0, 1.0, 0.5}});
        for (Material& material : scene.materials)  // glTF's metals have another curve
            if (material.kind == MaterialKind::conductor) material.kind = MaterialKind::diffuse;
        Scene again = there_and_back(scene, Target::gltf, {.name = "a.glb", .strict = true});
        scene.defaults = again.defaults = {.integrator = Integrator::next_event, .bounces = 6};
        again.film = scene.film;
        CHECK(verdict_on(scene, again, 1024) == Verdict::agree);
    }
}

// What pbrt says of a scene: two colours of the sky are one, lamps stand still, and its materials are those that pbrt
// has.
Scene for_pbrt(Scene scene) {
    scene.background.up = scene.background.down = glm::max(scene.background.down, glm::dvec3(0.2));
    scene.background.image = nullptr;
    scene.camera.position_motion = scene.camera.target_motion = glm::dvec3(0.0);
    for (Texture& texture : scene.textures)
        if (texture.kind == TextureKind::noise) texture.kind = TextureKind::checker;
    for (Material& material : scene.materials) {
        if (material.kind == MaterialKind::specular && !material.translucent) material.kind = MaterialKind::diffuse;
        if (material.kind == MaterialKind::emissive) material.translucent = false;
        if (material.translucent) material.alpha = 0.0;
        if (material.kind == MaterialKind::rough_diffuse) material.kind = MaterialKind::diffuse;
        material.fuzz = 0.0;
        material.fresnel = Fresnel::exact;
        material.priority = {};
    }
    for (Entity& entity : scene.entities)
        if (scene.materials[entity.material].kind == MaterialKind::emissive) entity.motion = glm::dvec3(0.0);
    scene.defaults = {.integrator = Integrator::next_event, .bounces = 6};
    return scene;
}

TEST_CASE("what pbrt says comes back from its text") {
    for (const char* name : {"cornell-classic", "glass", "conductors", "textures", "lights", "fog", "motion", "smooth",
             "closed-forms/pixel-coverage", "boundaries"}) {
        CAPTURE(std::string(name));
        Scene scene = for_pbrt(shipped(name));
        if (name == std::string("boundaries"))
            for (Medium& medium : scene.media) medium.grid = nullptr;
        const Scene again = there_and_back(scene, Target::pbrt, {.name = "a.pbrt"});
        CHECK(again.entities.size() >= scene.entities.size());
        CHECK(verdict_on(scene, again, 1024) == Verdict::agree);
    }
}

// pbrt's own scenes do not mirror their images before LookAt, as an export does: the importer mirrors their world.
TEST_CASE("a pbrt scene in left-handed coordinates gives the image that pbrt makes of it") {
    const std::string world = R"(
        Film "rgb" "integer xresolution" 48 "integer yresolution" 32
        WorldBegin
        AttributeBegin
          AreaLightSource "diffuse" "rgb L" [ 9 6 3 ]
          Translate POS1.5 1 0
          Shape "sphere" "float radius" 0.4
        AttributeEnd
        LightSource "point" "point3 from" [ NEG1 2 2 ] "rgb I" [ 4 5 6 ]
        Material "diffuse" "rgb reflectance" [ 0.8 0.5 0.3 ]
        Shape "trianglemesh" "point3 P" [ NEG3 -1 2  POS3 -1 2  POS3 -1 -3  NEG3 -1 -3 ] "integer indices" [ 0 1 2 0 2 3 ]
        AttributeBegin
          Identity
          Translate NEG1 0 0
          AreaLightSource "diffuse" "rgb L" [ 0 2 4 ]
          Shape "trianglemesh" "point3 P" [ 0 0 0  0.7 0 0  0 0.9 0 ] "integer indices" [ FACE ]
        AttributeEnd
    )";
    const auto imported = [&](const std::string& camera, const std::map<std::string, std::string>& words) {
        const TemporaryFolder folder;
        std::string text = camera + "Camera \"perspective\" \"float fov\" 50\n" + world;
        for (const auto& [word, value] : words)
            for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += value.size())
                text.replace(at, word.size(), value);
        write_text_file(folder / "a.pbrt", text);
        const auto scene = scene_import::import_scene(folder / "a.pbrt", folder / "a.json");
        write(scene.files, folder);
        return parse_scene(scene.document.dump(), folder / "a.json");
    };
    // The same picture written for both: x turned round, and with it the fronts of what is mirrored.
    const Scene left = imported("LookAt 0.5 1 6  0 0 0  0 1 0\n", {{"NEG", "-"}, {"POS", ""}, {"FACE", "0 1 2"}});
    const Scene right = imported("Scale -1 1 1\nLookAt -0.5 1 6  0 0 0  0 1 0\n",
        {{"NEG", ""}, {"POS", "-"}, {"FACE", "0 2 1"}, {" 0.7 0 0", " -0.7 0 0"}});
    CHECK(left.camera.position.x == right.camera.position.x);
    CHECK(verdict_on(left, right, 1024) == Verdict::agree);
}

TEST_CASE("what pbrt means otherwise than Tandem is refused, with its line") {
    const TemporaryFolder folder;
    const auto line = [&](const std::string& world) {
        write_text_file(folder / "a.pbrt",
            "Scale -1 1 1\nLookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n" + world);
        try {
            (void)parse_scene(
                scene_import::import_scene(folder / "a.pbrt", folder / "a.json").document.dump(), folder / "a.json");
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("imported");
    };
    const auto refused = [&](const std::string& world, const std::string& reason) {
        CAPTURE(world);
        CHECK_MESSAGE(line(world).find(reason) != std::string::npos, line(world));
    };
    CHECK(line("Shape \"sphere\"") == "imported");
    refused("Shape \"disk\"", "line 5: the shape disk; use sphere or trianglemesh");
    refused("Shape \"sphere\" \"float zmin\" 0", "a part of a sphere");
    refused("Material \"coateddiffuse\"", "the material coateddiffuse is none of Tandem's");
    refused(
        "Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\"", "eta is a spectrum");
    refused("Material \"dielectric\" \"float roughness\" .2", "has its roughness remapped");
    refused("LightSource \"infinite\" \"string filename\" \"sky.exr\"", "squares of equal area");
    refused("LightSource \"goniometric\"", "the light goniometric");
    refused("Include \"more.pbrt\"", "the directive Include");
    refused("AttributeBegin", "ends within an AttributeBegin");
    refused("AttributeEnd", "AttributeEnd without its begin");
    refused("Translate 1 2", "ends where a number should stand");
    refused("Translate 1 2 x", "\"x\" is no number");
    refused("Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 7 ]",
        "vertex 7 is not among 3");
    refused("NamedMaterial \"x\"", "knows no material \"x\"");
    refused(
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"integer dimension\" 3\nMaterial \"diffuse\" \"texture "
        "reflectance\" \"t\"\nTranslate 1 0 0\nShape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]",
        "laid out in another space than its shape");
    refused("ActiveTransform EndTime\nRotate 5 0 1 0", "moves a body by more than a displacement");
    refused("ActiveTransform EndTime\nIdentity", "moves a body by more than a displacement");
    refused("Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ]", "a mesh without indices");
    refused("Material \"interface\"\nShape \"sphere\"", "makes a scene that is refused");
    // Each block has its own: what follows it does not move.
    const std::string moving = "ActiveTransform EndTime\nTranslate 1 0 0\nShape \"sphere\"\n";
    CHECK(line("AttributeBegin\n" + moving + "AttributeEnd\nRotate 5 0 1 0\nShape \"sphere\"") == "imported");
    const auto before = [&](const std::string& text) {
        write_text_file(folder / "a.pbrt", text);
        return refusal([&] { (void)scene_import::import_scene(folder / "a.pbrt", folder / "a.json"); });
    };
    const std::string camera = "Camera \"perspective\" \"float fov\" 40 ";
    CHECK(contains(before("ActiveTransform EndTime\nTranslate 1 0 0\n" + camera + "\nWorldBegin\nShape \"sphere\""),
        "a camera that moves"));
    CHECK(before("ActiveTransform EndTime\n" + camera + "\nWorldBegin\nRotate 5 0 1 0\nShape \"sphere\"").empty());
    CHECK(contains(
        before(camera + "\"float shutterclose\" .5\nWorldBegin\n" + moving), "for another time than from 0 to 1"));
    CHECK(contains(before("Film \"rgb\" \"integer xresolution\" 0\n" + camera + "\nWorldBegin\nShape \"sphere\""),
        "xresolution is 0; write a whole number of at least 1"));
    CHECK(contains(
        before("LookAt 0 0 0 0 0 0 0 1 0\n" + camera + "\nWorldBegin\nShape \"sphere\""), "looks at its own place"));
}

TEST_CASE("a pbrt material that is made with a name is not taken before it is named") {
    const TemporaryFolder folder;
    write_text_file(folder / "a.pbrt", R"(Camera "perspective" "float fov" 40
        WorldBegin
        Material "diffuse" "rgb reflectance" [ 0.8 0.8 0.8 ]
        MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [ 0.9 0 0 ]
        Shape "sphere"
        NamedMaterial "red"
        Shape "sphere")");
    const Json document = scene_import::import_scene(folder / "a.pbrt", folder / "a.json").document;
    const auto colour = [&](std::size_t i) {
        return document["materials"][document["entities"][i]["material"].get<std::string>()]["colour"];
    };
    CHECK(colour(0) == Json{0.8, 0.8, 0.8});
    CHECK(colour(1) == Json{0.9, 0.0, 0.0});
}

TEST_CASE("a pbrt mesh without coordinates has pbrt's where its material asks for some") {
    const TemporaryFolder folder;
    const auto mesh = [&](const std::string& more) {
        write_text_file(folder / "a.pbrt", R"(Camera "perspective" "float fov" 40
            WorldBegin
            Texture "t" "spectrum" "checkerboard"
            Material "diffuse" "texture reflectance" "t"
            )" + more + R"(Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 0  0 1 0 ])");
        return scene_import::import_scene(folder / "a.pbrt", folder / "a.json").files.at(0).bytes;
    };
    CHECK(contains(mesh(""), "vt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n"));
    CHECK(contains(mesh("ReverseOrientation\n"), "vt 0 0\nvt 1 0\nvt 1 1\nf 1/1 3/3 2/2\n"));
    CHECK(!contains(mesh("Material \"diffuse\"\n"), "vt "));
}

TEST_CASE("a glTF scene that is no tree, or that holds nothing, is refused by import") {
    const TemporaryFolder folder;
    const auto refused = [&](const std::string& text) {
        write_text_file(folder / "a.gltf", text);
        return refusal([&] { (void)scene_import::import_scene(folder / "a.gltf", folder / "a.json"); });
    };
    CHECK(contains(refused(R"({"asset":{"version":"2.0"},"scenes":[]})"), "/scenes: holds nothing"));
    Json nodes = Json::array();
    for (int i = 1; i <= 40; ++i) nodes.push_back({{"children", {i, i}}});
    nodes.push_back(Json::object());
    const Json document{{"asset", {{"version", "2.0"}}}, {"scenes", {{{"nodes", {0}}}}}, {"nodes", nodes}};
    CHECK(contains(refused(document.dump()), "nodes that are no tree"));
}

TEST_CASE("a name that is no UTF-8 travels as JSON") {
    Scene scene = shipped("cornell-classic");
    for (Entity& entity : scene.entities) entity.name = "W\xE4nde";
    const auto files = export_scene(scene, Target::gltf, {.name = "a.gltf"});
    CHECK(contains(files.front().bytes, "W\uFFFDnde"));
}

TEST_CASE("the verdict sees a lamp that came back 10 % brighter") {
    const Scene scene = shipped("cornell-classic");
    const auto brighten = [](std::string& text) {
        const std::string strength = "\"emissiveStrength\": 15.0";
        REQUIRE(text.find(strength) != std::string::npos);
        text.replace(text.find(strength), strength.size(), "\"emissiveStrength\": 16.5");
    };
    CHECK(verdict_on(scene, there_and_back(scene, Target::gltf, {.name = "a.gltf"}, brighten), 1024) != Verdict::agree);
}

}  // namespace tandem::test
