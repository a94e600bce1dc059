// What a window shows and how its camera moves, without a window.
#include <doctest/doctest.h>

#include <chrono>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "common/view/camera_control.h"
#include "common/view/session.h"
#include "tests/common/synthetic_renderer.h"

using namespace tandem;

namespace {

Camera oblique() {
    Camera camera;
    camera.position = {3.0, 2.0, 5.0};
    camera.target = {0.5, 1.0, -1.0};
    camera.focus_distance = 6.5;
    return camera;
}

// Its brightness is how far the camera is to the right.
class PlacedRenderer final : public Renderer {
public:
    [[nodiscard]] RendererInfo info() const override { return {"synthetic", "none", "none", "none"}; }
    [[nodiscard]] std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        if (scene.camera.position.x < 0.0) throw UnsupportedError("no place for a camera");
        const double x = scene.camera.position.x;
        return std::make_unique<SyntheticJob>(
            settings, [x](std::uint32_t, std::uint32_t, SampleRandom& random) -> Radiance {
                const double value = x * random.uniform();
                return {value, value, value};
            });
    }
};

RenderSettings small() {
    RenderSettings settings;
    settings.width = 5;
    settings.height = 3;
    return settings;
}

std::unique_ptr<ProgressiveView> view_of(std::uint64_t samples) {
    return std::make_unique<ProgressiveView>(std::make_unique<PlacedRenderer>(), Scene{}, small(), samples);
}

Camera at(double x) {
    Camera camera;
    camera.position.x = x;
    return camera;
}

// A minute, for a busy machine, is ten thousand times what it takes.
template <class Condition>
bool soon(const Condition& condition) {
    for (int i = 0; i < 60'000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

}  // namespace

TEST_CASE("a camera turns about its target at one distance, and never over a pole") {
    const Camera before = oblique();
    const Camera after = orbited(before, 0.3, 0.2);
    CHECK(after.target == before.target);
    CHECK(glm::length(after.position - after.target) == doctest::Approx(glm::length(before.position - before.target)));
    // Right: seen from above the camera goes clockwise, so that the scene follows the hand.
    const auto azimuth = [](const Camera& camera) {
        const glm::dvec3 back = camera.position - camera.target;
        return std::atan2(back.x, back.z);
    };
    CHECK(azimuth(after) - azimuth(before) == doctest::Approx(-0.3));
    const auto height = [](const Camera& camera) {
        return std::asin(glm::normalize(camera.position - camera.target).y);
    };
    CHECK(height(after) - height(before) == doctest::Approx(0.2));
    CHECK(height(orbited(before, 0.0, 9.0)) == doctest::Approx(89.0 * std::numbers::pi / 180.0));
    CHECK(height(orbited(before, 0.0, -9.0)) == doctest::Approx(-89.0 * std::numbers::pi / 180.0));
}

TEST_CASE("a camera looks around, shifts, and goes nearer with its focus") {
    const Camera before = oblique();
    const Camera looked = turned(before, 0.4, 0.1);
    CHECK(looked.position == before.position);
    CHECK(glm::dot(glm::normalize(looked.target - looked.position), glm::normalize(before.target - before.position)) <
          std::cos(0.3));
    const double distance = glm::length(before.target - before.position);
    const Camera shifted = moved(before, {0.0, 0.0, 1.0});
    CHECK(glm::length(shifted.position - before.target) < 1e-12);
    CHECK(glm::length(shifted.target - shifted.position) == doctest::Approx(distance));
    const Camera near = approached(before, 0.5);
    CHECK(glm::length(near.target - near.position) == doctest::Approx(0.5 * distance));
    CHECK(near.focus_distance == doctest::Approx(before.focus_distance - 0.5 * distance));
    CHECK(approached(before, 1e-3).focus_distance > 0.0);
}

TEST_CASE("a view of n samples has the bits of a render of n samples") {
    for (const std::uint64_t samples : {1, 16, 64, 100, 1000}) {
        const auto view = view_of(samples);
        view->restart(at(2.0), 5, 3);
        REQUIRE(soon([&] { return view->state().finished; }));
        CHECK(view->state().samples == samples);
        Scene scene;
        scene.camera = at(2.0);
        const Estimate expected = PlacedRenderer().prepare(scene, small())->render({0, samples}, {}).estimate;
        const Estimate::Plane shown = view->estimate().totals(), whole = expected.totals();
        REQUIRE(shown.size() == whole.size());
        for (std::size_t i = 0; i < whole.size(); ++i) {
            CHECK(shown[i].sum == whole[i].sum);
            CHECK(shown[i].sum_of_squares == whole[i].sum_of_squares);
        }
        CHECK(view->picture()->mean == mean_of(expected));
    }
}

TEST_CASE("a view begins anew where the camera goes, and tells why it cannot") {
    const auto view = view_of(64);
    view->restart(at(1.0), 5, 3);
    REQUIRE(soon([&] { return view->state().finished; }));
    view->restart(at(8.0), 4, 2);
    REQUIRE(soon([&] { return view->state().finished; }));
    CHECK(view->picture()->width == 4);
    CHECK(view->picture()->mean.front() == doctest::Approx(4.0).epsilon(0.3));
    view->restart(at(-1.0), 4, 2);
    REQUIRE(soon([&] { return !view->state().failure.empty(); }));
    CHECK(view->state().failure == "no place for a camera");
    CHECK(view->picture()->width == 4);  // the last one stays to be seen
    view->restart(at(1.0), 4, 2);
    REQUIRE(soon([&] { return view->state().finished; }));
    CHECK(view->state().failure.empty());
}

TEST_CASE("of two backends the first is seen left of the split") {
    std::vector<std::unique_ptr<ProgressiveView>> views;
    views.push_back(view_of(1));
    views.push_back(view_of(64));
    Scene scene;
    scene.camera = at(1.0);
    ViewSession session(scene, small(), std::move(views));
    CHECK(session.seen(0.5).width == 0);
    session.follow();
    REQUIRE(soon([&] { return session.finished(); }));
    const Image all_first = session.seen(1.0), all_second = session.seen(0.0), both = session.seen(0.4);
    for (std::size_t i = 0; i < both.pixels.size(); ++i) {
        const std::size_t x = i / 3 % 5;
        CHECK(both.pixels[i] == (x < 2 ? all_first : all_second).pixels[i]);
        CHECK(all_first.pixels[i] != all_second.pixels[i]);
    }
    // Mid grey in sRGB is 188 of 255, and half of it 137 [IEC 61966-2-1].
    const ViewSession::Shown shown = session.shown({.exposure = 0.5 / all_first.pixels[0], .split = 1.0});
    CHECK(shown.rgba[0] == 188);
    CHECK(session.shown({.exposure = 0.25 / all_first.pixels[0], .split = 1.0}).rgba[0] == 137);
    CHECK(shown.rgba[3] == 255);
}

TEST_CASE("a saved view is a scene with the new camera, and finds its files from another folder") {
    const std::filesystem::path original = TANDEM_SOURCE_DIR "/scenes/textures.json";
    Scene scene = load_scene(original);
    scene.camera = orbited(scene.camera, 0.1, 0.05);
    const std::filesystem::path folder = std::filesystem::temp_directory_path() / "tandem-view-test";
    std::filesystem::create_directories(folder);
    const std::filesystem::path target = folder / "saved.json";
    { std::ofstream(target) << scene_text_with(original, scene.camera, target); }
    const Scene saved = load_scene(target);
    CHECK(saved.camera.position == scene.camera.position);
    CHECK(saved.camera.target == scene.camera.target);
    CHECK(saved.camera.vertical_field_degrees == scene.camera.vertical_field_degrees);
    CHECK(saved.textures.size() == scene.textures.size());
    CHECK(saved.entities.size() == scene.entities.size());
    std::filesystem::remove_all(folder);
}
