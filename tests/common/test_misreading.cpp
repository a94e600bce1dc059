// What a scene has otherwise than its file says: nothing for any shipped scene, and what is changed by hand.
#include <doctest/doctest.h>

#include <filesystem>
#include <functional>

#include "common/render/renderer.h"
#include "common/scene/export/misreading.h"
#include "common/scene/loader/scene_loader.h"
#include "common/validation/explanation/suspects.h"
#include "common/validation/verify/scene_verdict.h"

using namespace tandem;

namespace {

const std::filesystem::path scenes = std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes";

std::string changed(const std::string& name, const std::function<void(Scene&)>& change) {
    const std::filesystem::path file = scenes / (name + ".json");
    Scene scene = load_scene(file);
    change(scene);
    const std::optional<Misreading> found = misreading_of(scene, file);
    return found ? found->words : "";
}

}  // namespace

TEST_CASE("every shipped scene has what its file says") {
    std::size_t count = 0;
    for (const char* folder : {".", "closed-forms", "hard", "lessons"})
        for (const auto& entry : std::filesystem::directory_iterator(scenes / folder)) {
            if (entry.path().extension() != ".json" || entry.path().stem() == "catalogue")
                continue;  // that lists scenes
            CAPTURE(entry.path().string());
            const std::optional<Misreading> found = misreading_of(load_scene(entry.path()), entry.path());
            CHECK((found ? found->words : "") == "");
            ++count;
        }
    CHECK(count > 100);
}

TEST_CASE("what a scene has otherwise than its file is told, with its place and both values") {
    CHECK(changed("closed-forms/furnace-0.99", [](Scene& s) { s.defaults.bounces = 8; }) ==
          "/render/bounces is 40 in the file and 8 in the scene");
    CHECK(changed("closed-forms/furnace-0.99", [](Scene& s) { s.camera.position.y = 0.06; }) ==
          "/camera/position/1 is 0.05 in the file and 0.06 in the scene");
    CHECK(changed("closed-forms/furnace-0.99", [](Scene& s) {
        s.materials[0].colour.z *= 1.0 + 0x1p-20;
    }).starts_with("/materials/wall/colour/2 is 0.99 in the file"));
    CHECK(changed("closed-forms/furnace-0.99", [](Scene& s) { s.background.up.x = 1.0; }) ==
          "/background/0 is 0 in the file and 1.0 in the scene");
    CHECK(changed("closed-forms/camera-motion", [](Scene& s) { s.camera.target_motion = {}; }) ==
          "/camera/motion/target/0 is 2 in the file and 0.0 in the scene");
    CHECK(changed("motion", [](Scene& s) { s.camera.position_motion = {}; }).starts_with("/camera/motion is {"));
    CHECK(changed("motion", [](Scene& s) { s.defaults.roulette_start = no_roulette; }) ==
          "/render/roulette_start is 3 in the file and nothing in the scene");
    CHECK(changed("fog", [](Scene& s) { s.media[0].anisotropy += 0.1; }).starts_with("/media/"));
    CHECK(changed("textures", [](Scene& s) {
        for (Texture& texture : s.textures) texture.frequency *= 2.0;
    }).starts_with("/textures/"));
}

TEST_CASE("a misreading is a disagreement, of the part that it lies in") {
    SceneVerdict verdict;
    verdict.reference_name = "CPU";
    verdict.candidate_name = "Vulkan";
    conclude(verdict);
    CHECK(verdict.verdict == Verdict::undecided);
    verdict.misreading = Misreading{"/render/bounces", "/render/bounces is 40 in the file and 8 in the scene"};
    conclude(verdict);
    CHECK(verdict.verdict == Verdict::disagree);
    CHECK(verdict.sentence.starts_with("the scene is not what its file says: /render/bounces is 40"));
    REQUIRE(verdict.suspects.size() == 1);
    CHECK(verdict.suspects[0].part == Subsystem::roulette);
    const std::vector<Suspect> of_material = suspects_of({"/materials/wall/colour/2", ""});
    REQUIRE(of_material.size() == 2);
    CHECK(of_material[0].part == Subsystem::scene_data);
    CHECK(of_material[1].part == Subsystem::bsdf);
    CHECK(suspects_of({"/materials/pane/priority", ""}).back().part == Subsystem::dielectric);
    CHECK(suspects_of({"/entities/0/material", ""}).back().part == Subsystem::scene_data);
    CHECK(suspects_of({"/camera/up/0", ""}).front().part == Subsystem::camera);
}
