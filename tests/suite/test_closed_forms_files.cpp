// The shipped scenes with an `expect` block: every tracer and integrator meets the radiance that the file declares.
#include <algorithm>
#include <filesystem>

#include "common/scene/loader/scene_loader.h"
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

std::vector<Scene> scenes_with_closed_form() {
    std::vector<std::filesystem::path> files;
    for (const char* folder : {TANDEM_SOURCE_DIR "/scenes", TANDEM_SOURCE_DIR "/scenes/closed-forms"})
        for (const auto& entry : std::filesystem::directory_iterator(folder))
            if (entry.path().extension() == ".json") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<Scene> scenes;
    for (const auto& file : files) {
        Scene scene = load_scene(file);
        if (scene.expect) scenes.push_back(std::move(scene));
    }
    return scenes;
}

void check_files(Integrator integrator, bool mis = true) {
    auto& all = tracers();
    const std::vector<Scene> scenes = scenes_with_closed_form();
    REQUIRE(scenes.size() >= 40);
    for (const Scene& scene : scenes) {
        CAPTURE(scene.name);
        if (integrator == Integrator::path && !scene.lights.empty()) continue;  // scattering finds none of them
        RenderSettings settings = default_settings(scene);
        const bool dark = scene.background.down + scene.background.up == dvec3(0.0);
        if (integrator == Integrator::whitted &&
            !(settings.integrator == Integrator::next_event && settings.bounces == 1 && dark))
            continue;
        settings.integrator = integrator;
        settings.mis = mis;
        settings.width = std::min(settings.width, 12u);  // the fields show one value, or are one pixel
        settings.height = std::min(settings.height, 12u);
        const std::uint64_t samples = settings.width == 1 ? 4096 : 256;
        check_mean(all, scene, settings, samples, scene.expect->radiance, 8.0 * settings.bounces + 64.0);
    }
}

}  // namespace

TEST_CASE("every shipped closed form is met by scattering alone" * doctest::test_suite("full")) {
    check_files(Integrator::path);
}

TEST_CASE("every shipped closed form is met by light sampling") { check_files(Integrator::next_event); }

TEST_CASE("every shipped closed form of one bounce of sampled light is met by whitted") {
    check_files(Integrator::whitted);
}

TEST_CASE("every shipped closed form is met by light sampling without MIS" * doctest::test_suite("full")) {
    check_files(Integrator::next_event, false);
}
