// The shipped scenes with an `expect` block: every witness and integrator meets the radiance that the file declares.
#include <algorithm>
#include <filesystem>

#include "common/scene_loader.h"
#include "tests/suite/witnesses.h"

using namespace tandem;
using namespace tandem::test;

namespace {

std::vector<std::filesystem::path> closed_form_files() {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(TANDEM_SOURCE_DIR "/scenes/closed-forms"))
        if (entry.path().extension() == ".json") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

void check_files(Integrator integrator) {
    auto all = witnesses();
    const auto files = closed_form_files();
    REQUIRE(files.size() >= 19);
    for (const auto& file : files) {
        CAPTURE(file.filename());
        const Scene scene = load_scene(file);
        REQUIRE(scene.expect.has_value());
        RenderSettings settings = default_settings(scene);
        settings.integrator = integrator;
        settings.width = std::min(settings.width, 12u);  // the fields show one value, or are one pixel
        settings.height = std::min(settings.height, 12u);
        const std::uint64_t samples = settings.width == 1 ? 32768 : 256;
        check_mean(all, scene, settings, samples, scene.expect->radiance, 8.0 * settings.bounces + 64.0);
    }
}

}  // namespace

TEST_CASE("every shipped closed form is met by scattering alone") { check_files(Integrator::path); }

TEST_CASE("every shipped closed form is met by light sampling") { check_files(Integrator::next_event); }
