// Lights, sky, textures, conductors and rough glass of MODEL.md, rendered. Tests are closed forms, estimators against
// each other, and the path tracer's general variant against the lean ones.
#include <doctest/doctest.h>

#include <filesystem>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "cpu_ref/path_tracer/variants.h"
#include "tests/cpu_ref/renders.h"
#include "tests/thorough.h"

using namespace tandem;
using namespace tandem::test::renders;
using glm::dvec3;

namespace {

std::shared_ptr<Pixels> sky_image() {
    auto image = std::make_shared<Pixels>(Pixels{16, 8, {}});
    for (std::uint32_t i = 0; i < 16 * 8; ++i) {
        const float value = i == 2 * 16 + 5 ? 30.0f : 0.1f * static_cast<float>(i % 5);
        for (const float tint : {1.0f, 0.5f, 0.25f}) image->rgb.push_back(value * tint);
    }
    return image;
}

// A diffuse floor and wall, a rough metal ball, a lamp, smoke, a glass ball: all that next events deal with.
Scene workshop(bool smoke, bool image) {
    test::SceneBuilder b;
    b.camera({0, 1.5, 5}, {0, 0.8, 0}, 45).background({0.2, 0.2, 0.3}, {0.8, 0.9, 1.0});
    b.floor(test::diffuse({0.7, 0.6, 0.5}), 0.0, 4.0);
    b.cuboid(test::diffuse(dvec3(0.5)), {-2, 0, -2}, {2, 2, -1.8});
    b.sphere(conductor(0.5), {-0.9, 0.7, 0}, 0.6);
    b.sphere(test::glass(1.5), {0.9, 0.7, 0.2}, 0.5);
    b.quad(test::emitter({6, 5, 4}, EmittingSides::front), {-0.6, 2.5, -0.6}, {0.6, 2.5, -0.6}, {0.6, 2.5, 0.6},
        {-0.6, 2.5, 0.6});
    b.sphere(test::emitter({2, 4, 6}), {1.6, 0.4, 0.9}, 0.2);
    if (smoke) b.cuboid(boundary(0), {-0.4, 0.2, 0.6}, {0.5, 1.2, 1.4});
    Scene scene = b.scene();
    scene.background.sampled = true;
    if (image) {
        scene.background.image = sky_image();
        scene.background.rotation_degrees = 30.0;
    }
    if (smoke) scene.media.push_back(medium({0.1, 0.3, 0.2}, {2.0, 1.0, 0.0}, 0.5));
    return scene;
}

}  // namespace

TEST_CASE("the general variant estimates the same bits as the one of a scene, on all shipped scenes") {
    std::size_t lean = 0, pairs = 0;
    for (const char* folder : {"scenes", "scenes/closed-forms"})
        for (const auto& entry :
            std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / folder)) {
            if (entry.path().extension() != ".json") continue;
            const Scene scene = load_scene(entry.path());
            CAPTURE(scene.name);
            for (const Integrator integrator : {Integrator::path, Integrator::next_event}) {
                RenderSettings s = with_longer_side(default_settings(scene), 16);
                if (integrator == Integrator::path && !scene.lights.empty()) continue;  // refused
                if (s.integrator != Integrator::whitted) s.integrator = integrator;
                s.bounces = std::min(s.bounces, 8u);
                s.roulette_start = 3;
                ++pairs;
                for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
                    // One precision a pair of scene and integrator, in turn.
                    if (!test::thorough() && (precision == Precision::single_precision) != (pairs % 4 < 2)) continue;
                    const Estimate own = render(scene, s, 3, precision);
                    RenderSettings general = s;
                    general.effects = EffectSet::all();
                    CHECK(same_bits(own, render(scene, general, 3, precision)));
                }
                if (cpu::variants::lean_next_event.covers(needed_effects(scene, s))) ++lean;
            }
        }
    CHECK(lean >= 9);
}

TEST_CASE("a job tells what it simulates, and lean ones keep less state a path") {
    const Scene scene = load_scene(TANDEM_SOURCE_DIR "/scenes/cornell-classic.json");
    const auto renderer = cpu_backend().create({});
    RenderSettings s = default_settings(scene);
    const JobFacts lean = renderer->prepare(scene, s)->facts();
    s.effects = EffectSet::all();
    const JobFacts general = renderer->prepare(scene, s)->facts();
    CHECK(lean.effects.covers(needed_effects(scene, s)));
    CHECK(general.effects == EffectSet::all());
    CHECK(lean.bytes_per_path > 0);
    CHECK(lean.bytes_per_path < general.bytes_per_path);
    CHECK(lean.variant == "lean-next-event");
    CHECK(lean.compiled == lean.effects);
    CHECK(general.variant == "general");
    CHECK(general.compiled == EffectSet::all());
    REQUIRE(lean.buffers.size() == 1);
    CHECK(lean.buffers[0].amount < general.buffers[0].amount);
    s.effects.reset();
    s.integrator = Integrator::path;
    CHECK(renderer->prepare(scene, s)->facts().variant == "lean-path");
    s.integrator = Integrator::bidirectional;
    const JobFacts bidirectional = renderer->prepare(scene, s)->facts();
    CHECK(bidirectional.variant == "bidirectional");
    CHECK(!bidirectional.compiled.has(Effect::medium_scattering));
    CHECK(bidirectional.bytes_per_path > 0);
}

TEST_CASE("a sun, a point and a spot light a floor as their irradiance says") {
    const dvec3 colour(0.6, 0.3, 0.9);
    for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
        Scene scene = floor_below(test::diffuse(colour)).scene();
        scene.lights = {light(PunctualKind::sun, {}, {1, -2, 0}, {3, 3, 3})};
        const double cosine = 2.0 / std::sqrt(5.0);
        for (const Integrator integrator : {Integrator::next_event, Integrator::whitted}) {
            const auto mean = mean_of(render(scene, settings(1, integrator, 1), 64, precision));
            CHECK(mean[0] == doctest::Approx(0.6 / pi * 3 * cosine).epsilon(1e-5));
            CHECK(mean[2] == doctest::Approx(0.9 / pi * 3 * cosine).epsilon(1e-5));
        }
        scene.lights = {light(PunctualKind::point, {1, 2, 0}, {0, -1, 0}, {7, 7, 7})};
        CHECK(mean_of(render(scene, settings(1, Integrator::next_event, 1), 64, precision))[1] ==
              doctest::Approx(0.3 / pi * 7 / 5.0 * cosine).epsilon(1e-3));
        // 30 degrees off the axis of a spot from 20 to 50 degrees.
        scene.lights = {light(PunctualKind::spot, {0, 2, 0}, {std::tan(pi / 6), -1, 0}, {7, 7, 7})};
        scene.lights[0].inner_degrees = 20.0;
        scene.lights[0].outer_degrees = 50.0;
        const double inner = std::cos(pi / 9), outer = std::cos(pi * 5 / 18);
        const double t = (std::cos(pi / 6) - outer) / (inner - outer);
        CHECK(mean_of(render(scene, settings(1, Integrator::next_event, 1), 64, precision))[1] ==
              doctest::Approx(0.3 / pi * 7 / 4.0 * t * t * (3 - 2 * t)).epsilon(1e-3));
        scene.lights[0].outer_degrees = 25.0;
        CHECK(mean_of(render(scene, settings(1, Integrator::next_event, 1), 64, precision))[1] == 0.0);
    }
}

TEST_CASE("near and far lights together keep their means") {
    Scene scene = floor_below(test::diffuse(dvec3(0.5))).scene();
    scene.lights = {light(PunctualKind::sun, {}, {0, -1, 0}, dvec3(3)),
        light(PunctualKind::sun, {}, {0, -1, 0}, dvec3(1)),
        light(PunctualKind::point, {0, 2, 0}, {0, -1, 0}, dvec3(8))};
    check_mean(render(scene, settings(8, Integrator::next_event, 1), 512), 0.5 / pi * (3 + 1 + 8 / 4.0));
}

TEST_CASE("what lies between a floor and a sun shadows it, also where rays have an end") {
    test::SceneBuilder b = floor_below(test::diffuse(dvec3(0.5)));
    b.sphere(test::diffuse(dvec3(0.5)), {-6, 6, 0}, 0.5);
    Scene scene = b.scene();
    scene.lights = {light(PunctualKind::sun, {}, {1, -1, 0}, dvec3(3))};
    CHECK(mean_of(render(scene, settings(1, Integrator::whitted, 1), 64))[0] == 0.0);
    RenderSettings s = settings(1, Integrator::whitted, 1);
    s.ray_max = 4.5;  // past the floor, short of the sphere
    scene.camera.position = {0, 3.5, 0};
    CHECK(mean_of(render(scene, s, 64))[0] > 0.1);
}

TEST_CASE("a constant sky over a floor is C times it, found by scattering, sampled, or both") {
    Scene scene = floor_below(test::diffuse(dvec3(0.5))).background(dvec3(1.0)).scene();
    check_mean(render(scene, settings(4, Integrator::path, 1), 64), 0.5);
    scene.background.sampled = true;
    check_mean(render(scene, settings(4, Integrator::next_event, 1), 1024), 0.5);
    check_mean(render(scene, settings(4, Integrator::whitted, 1), 1024), 0.5);
}

TEST_CASE("all integrators that see everything estimate one mean, with metal, sky, smoke and lamps") {
    for (const bool smoke : {false, true})
        for (const bool image : {false, true}) {
            CAPTURE(smoke);
            CAPTURE(image);
            const Scene scene = workshop(smoke, image);
            const Estimate path = render(scene, settings(32, Integrator::path, 7, 3), 512);
            const Estimate next = render(scene, settings(32, Integrator::next_event, 7, 4), 512);
            check_same_mean(path, next);
            CHECK(pooled(next).error < pooled(path).error);
            RenderSettings with_roulette = settings(32, Integrator::next_event, 7, 5);
            with_roulette.roulette_start = 1;
            check_same_mean(next, render(scene, with_roulette, 512));
        }
}

TEST_CASE("single and double precision estimate the same mean of all effects") {
    const Scene scene = workshop(true, true);
    check_same_mean(render(scene, settings(24, Integrator::next_event, 7, 3), 512),
        render(scene, settings(24, Integrator::next_event, 7, 4), 256, Precision::double_precision));
}

TEST_CASE("a checkered floor under an even sky shows the mean of its two colours, a noisy one its range") {
    Scene scene = floor_below(test::diffuse(dvec3(0.5))).background(dvec3(1.0)).scene();
    scene.camera.vertical_field_degrees = 2.0 * 180.0 / pi * std::atan(1.0);  // 8 x 8 units
    Texture checker;
    checker.first = {0.2, 0.4, 0.0};
    checker.second = {0.6, 0.0, 1.0};
    checker.frequency = {0.5, 0.0, 0.5};
    scene.textures = {checker};
    scene.materials[0].colour_texture = 0;
    const auto mean = mean_of(render(scene, settings(4, Integrator::path, 1), 64));
    // Pixels are cells: x in [-4, -2) and z in [-4, -2) first.
    CHECK(mean[0] == doctest::Approx(0.2));
    CHECK(mean[3] == doctest::Approx(0.6));
    CHECK(mean[3 * 4] == doctest::Approx(0.6));
    CHECK(mean[3 * 4 + 3] == doctest::Approx(0.2));
    scene.textures[0].kind = TextureKind::noise;
    scene.textures[0].frequency = dvec3(3.0);
    const auto noisy = mean_of(render(scene, settings(32, Integrator::path, 1), 4));
    CHECK(*std::ranges::max_element(noisy) <= 1.0);
    CHECK(noisy[0] != doctest::Approx(noisy[3]).epsilon(1e-6));
}

TEST_CASE("a smooth conductor mirrors by its reflectance") {
    test::SceneBuilder b = floor_below(conductor(0.0));
    b.background(dvec3(2.0));
    const dvec3 eta(0.2, 0.9, 1.1), k(3.9, 2.4, 2.2);
    const auto mean = mean_of(render(b.scene(), settings(1, Integrator::path, 1), 16));
    for (std::size_t c = 0; c < 3; ++c) {
        const int i = static_cast<int>(c);
        const double f = ((eta[i] - 1) * (eta[i] - 1) + k[i] * k[i]) / ((eta[i] + 1) * (eta[i] + 1) + k[i] * k[i]);
        CHECK(mean[c] == doctest::Approx(2.0 * f).epsilon(1e-5));
    }
}

TEST_CASE("a rough conductor in an even sky reflects the same by scattering and by sampling the sky") {
    for (const double roughness : {0.1, 0.4, 1.0}) {
        CAPTURE(roughness);
        test::SceneBuilder b;
        b.camera({0, 1, 3}, {0, 0, 0}, 30).background(dvec3(1.0)).floor(conductor(roughness), 0.0, 50.0);
        Scene scene = b.scene();
        const Estimate path = render(scene, settings(8, Integrator::path, 1, 2), 4096);
        scene.background.sampled = true;
        check_same_mean(path, render(scene, settings(8, Integrator::next_event, 1, 3), 4096));
    }
}

TEST_CASE("whitted shows direct light and what mirrors show, and no more") {
    test::SceneBuilder b = floor_below(test::diffuse(dvec3(0.5)));
    b.quad(test::emitter(dvec3(2.0), EmittingSides::both), {-1, 6, 1}, {1, 6, 1}, {1, 6, -1}, {-1, 6, -1});
    const Scene scene = b.scene();
    // One scattering event of next_event is all direct light.
    check_same_mean(render(scene, settings(8, Integrator::next_event, 1, 2), 512),
        render(scene, settings(8, Integrator::whitted, 9, 3), 512));
    test::SceneBuilder mirror = floor_below(test::mirror(dvec3(0.8)));
    mirror.quad(test::emitter(dvec3(2.0)), {-9, 6, 9}, {9, 6, 9}, {9, 6, -9}, {-9, 6, -9});
    CHECK(mean_of(render(mirror.scene(), settings(1, Integrator::whitted, 2), 16))[0] ==
          doctest::Approx(1.6).epsilon(1e-5));
}
