// The report folder and its maps.
#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/files/write_file.h"
#include "common/validation/report/colour_map.h"
#include "common/validation/report/report.h"
#include "common/validation/verify/verify.h"
#include "tests/common/synthetic_renderer.h"
#include "tests/temporary_folder.h"

using namespace tandem;

namespace {

Radiance noisy(std::uint32_t x, std::uint32_t y, SampleRandom& random) {
    const double value = (0.2 + 0.02 * x) * random.exponential() * (y < 20 ? 1.0 : 0.5);
    return {value, 0.8 * value, 0.5 * value};
}

}  // namespace

TEST_CASE("maps end at their named colours and pass through white") {
    CHECK(diverging_colour(0.0) == Colour{1.0, 1.0, 1.0});
    CHECK(diverging_colour(7.0)[0] == doctest::Approx(0xb2 / 255.0));
    CHECK(diverging_colour(-7.0)[2] == doctest::Approx(0xac / 255.0));
    CHECK(sequential_colour(0.0) == Colour{1.0, 1.0, 1.0});  // where nothing differs a map is not black
    CHECK(sequential_colour(1.0)[0] == doctest::Approx(0x67 / 255.0));
}

TEST_CASE("a report folder holds the verdict and every picture that it names") {
    Scene scene;
    scene.name = "a scene/with: odd name";
    VerifyOptions options;
    RenderSettings settings;
    settings.width = 40;
    settings.height = 30;
    options.settings = settings;
    options.max_samples = 128;
    SyntheticRenderer a(noisy, "cpu"), b(noisy, "vulkan");
    const std::vector<SceneVerdict> verdicts{verify_scene(scene, a, b, options)};
    const TemporaryFolder temporary;
    const std::filesystem::path folder = temporary / "report";
    write_report(folder, verdicts);
    const nlohmann::json report = nlohmann::json::parse(std::ifstream(folder / "report.json"));
    for (const char* picture : {"reference", "candidate", "difference", "tiles", "p"}) {
        CAPTURE(picture);
        CHECK(std::filesystem::exists(folder / report["scenes"][0]["images"][picture].get<std::string>()));
    }
}

TEST_CASE("scripts/report makes one HTML file that needs nothing beside it") {
    Scene scene;
    scene.name = "html";
    VerifyOptions options;
    RenderSettings settings;
    settings.width = settings.height = 32;
    options.settings = settings;
    options.max_samples = 512;
    options.criteria.margins.image = 1e-6;  // several looks, hence a plot
    SyntheticRenderer a(noisy, "cpu"), b(noisy, "vulkan");
    const std::vector<SceneVerdict> verdicts{verify_scene(scene, a, b, options)};
    const TemporaryFolder temporary;
    const std::filesystem::path folder = temporary / "report";
    write_report(folder, verdicts);
    const std::string command = "/usr/bin/python3 " TANDEM_SOURCE_DIR "/scripts/report " + folder.string();
    REQUIRE(std::system(command.c_str()) == 0);
    std::ifstream stream(folder / "report.html");
    const std::string html{std::istreambuf_iterator<char>(stream), {}};
    CHECK(html.find("<span class=\"verdict undecided\">undecided</span>") != std::string::npos);
    CHECK(html.find("src=\"data:image/png;base64,") != std::string::npos);
    CHECK(html.find("<svg") != std::string::npos);
    CHECK(html.find("src=\"http") == std::string::npos);
}

TEST_CASE("a report folder that cannot be made is refused") {
    CHECK_THROWS_AS(check_writable_folder("/dev/null/report"), InputError);
}
