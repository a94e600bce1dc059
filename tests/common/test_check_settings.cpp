// What every backend refuses alike, asked of the one function that refuses it.
#include <doctest/doctest.h>

#include <limits>
#include <memory>

#include "common/error.h"
#include "common/render/check_settings.h"
#include "tests/refusal.h"

using namespace tandem;

namespace {

// The reason for which these are refused; empty where they are not.
std::string refusal(const Scene& scene, const RenderSettings& settings) {
    return tandem::refusal<UnsupportedError>([&] { check_settings(scene, settings); });
}

template <class Change>
std::string refusal_of(Change change) {
    RenderSettings settings;
    change(settings);
    return refusal(Scene{}, settings);
}

}  // namespace

TEST_CASE("the default settings are refused by nobody") { CHECK(refusal(Scene{}, RenderSettings{}).empty()); }

TEST_CASE("an image has 1 to 65536 pixels a side and fewer than 2^32") {
    const auto of_size = [](std::uint32_t width, std::uint32_t height) {
        return refusal_of([&](RenderSettings& s) { s.width = width, s.height = height; });
    };
    CHECK(contains(of_size(0, 1), "0 x 1 pixels"));
    CHECK(contains(of_size(1, 0), "1 x 0 pixels"));
    CHECK(contains(of_size(65537, 1), "out of range"));
    CHECK(contains(of_size(1, 65537), "out of range"));
    CHECK(contains(of_size(65536, 65536), "below 2^32"));
    CHECK(of_size(65536, 65535).empty());
}

TEST_CASE("an interval of ray lengths begins at 0 or above and does not end before") {
    const auto of_interval = [](double least, double most) {
        return refusal_of([&](RenderSettings& s) { s.ray_min = least, s.ray_max = most; });
    };
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(contains(of_interval(-1.0, 2.0), "ray_min"));
    CHECK(contains(of_interval(2.0, 1.0), "ray_min"));
    CHECK(contains(of_interval(nan, 1.0), "ray_min"));
    CHECK(contains(of_interval(0.0, nan), "ray_min"));
    CHECK(of_interval(1.0, 1.0).empty());
}

TEST_CASE("2^28 bounces have no random numbers") {
    CHECK(contains(refusal_of([](RenderSettings& s) { s.bounces = 1u << 28; }), "2^28 bounces"));
    CHECK(refusal_of([](RenderSettings& s) { s.bounces = (1u << 28) - 1; }).empty());
}

TEST_CASE("a camera needs a frame at every moment") {
    Scene still, along_up, passing;
    still.camera.target = still.camera.position;
    along_up.camera.up = along_up.camera.target - along_up.camera.position;
    passing.camera.target_motion = {0.0, 0.0, 2.0};  // through its position, at half time
    for (const Scene& scene : {still, along_up, passing}) CHECK(contains(refusal(scene, {}), "camera has no frame"));
    passing.camera.target_motion = {0.0, 0.0, 0.9};
    CHECK(refusal(passing, {}).empty());
}

TEST_CASE("sums in single precision take no radiances above 1e15, and name whose they are") {
    Scene material, light, sky, image;
    material.materials.emplace_back().name = "lamp";
    material.materials.back().radiance = {0.0, 1e16, 0.0};
    light.lights.emplace_back().name = "bulb";
    light.lights.back().intensity = {0.0, 0.0, 1e16};
    sky.background.up = {1e16, 0.0, 0.0};
    image.background.image = std::make_shared<Pixels>(Pixels{2, 1, {0.0F, 0.0F, 0.0F, 0.0F, 2.0F, 0.0F}});
    image.background.image_scale = 1e15;
    RenderSettings settings;
    for (const Accumulation accumulation : {Accumulation::plain, Accumulation::compensated}) {
        settings.accumulation = accumulation;
        CHECK(contains(refusal(material, settings), "material 'lamp'"));
        CHECK(contains(refusal(light, settings), "light 'bulb'"));
        CHECK(contains(refusal(sky, settings), "the background"));
        CHECK(contains(refusal(image, settings), "the background"));
    }
    settings.accumulation = Accumulation::in_double;
    for (const Scene& scene : {material, light, sky, image}) CHECK(refusal(scene, settings).empty());
}

TEST_CASE("adaptive sampling is refused with the settings that it does not go with") {
    const std::string refused = refusal_of([](RenderSettings& s) {
        s.sampling = Sampling::adaptive;
        s.generator = Generator::sobol;
    });
    CHECK(contains(refused, "Sobol"));
}
