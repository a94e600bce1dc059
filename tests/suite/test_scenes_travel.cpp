// Scenes that were exported and imported again look as before: the verdict says so, of images of other seeds.
#include <fmt/format.h>

#include <filesystem>

#include "common/files/write_file.h"
#include "common/scene/export/export.h"
#include "common/scene/import/import.h"
#include "common/scene/loader/scene_loader.h"
#include "common/validation/compare/compare.h"
#include "tests/suite/tracers.h"
#include "tests/temporary_folder.h"

namespace tandem::test {
namespace {

using scene_export::ExportOptions;
using scene_export::Target;

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
    INFO(scene.name, ": ", verdict.sentence);
    return verdict.verdict;
}

}  // namespace

TEST_CASE("shipped scenes agree with what comes back from glTF") {
    for (const char* name : {"glass", "conductors", "environment", "textures", "smooth", "nested-glass", "lights",
             "motion", "boundaries", "moons", "cornell-thesis"}) {
        CAPTURE(name);
        const Scene scene = shipped(name);
        CHECK(verdict_on(scene, there_and_back(scene, Target::gltf, {.name = "a.gltf"})) == Verdict::agree);
    }
}

TEST_CASE("what glTF says by itself comes back without extras") {
    for (const char* name : {"cornell-classic", "lights", "closed-forms/polygon-light"}) {
        CAPTURE(name);
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
