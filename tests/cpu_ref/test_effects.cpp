// The effects of MODEL.md sections 4 to 10 that scenes may leave out, rendered: closed forms, estimators against each
// other, and the general variant of the path tracer against the lean ones.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/scene_loader.h"
#include "cpu_ref/backend.h"
#include "tests/scene_builder.h"

using namespace tandem;
using glm::dvec3;

namespace {

constexpr double pi = std::numbers::pi;

RenderSettings settings(std::uint32_t size, Integrator integrator, std::uint32_t bounces, std::uint64_t seed = 1) {
    RenderSettings s;
    s.width = s.height = size;
    s.integrator = integrator;
    s.bounces = bounces;
    s.seed = seed;
    return s;
}

Estimate render(const Scene& scene, const RenderSettings& s, std::uint64_t samples,
    Precision precision = Precision::single_precision) {
    BackendOptions options;
    options.precision = precision;
    const auto renderer = cpu_backend().create(options);
    return renderer->prepare(scene, s)->render({0, samples}).estimate;
}

bool same_bits(const Estimate& a, const Estimate& b) {
    return std::ranges::equal(a.totals(), b.totals(),
        [](const Moments& x, const Moments& y) { return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares; });
}

struct Pooled {
    double mean, error;
};
Pooled pooled(const Estimate& estimate, std::size_t channel = 0) {
    const auto mean = mean_of(estimate), variance = variance_of(estimate);
    const double pixels = static_cast<double>(estimate.pixel_count()), n = static_cast<double>(estimate.count());
    Pooled result{0.0, 0.0};
    for (std::size_t i = channel; i < mean.size(); i += 3) {
        result.mean += mean[i] / pixels;
        result.error += variance[i] / n / (pixels * pixels);
    }
    result.error = std::sqrt(result.error);
    CHECK(estimate.invalid() == 0);
    return result;
}

// Six standard errors: a false alarm in 10^9, and the seeds are fixed.
void check_mean(const Estimate& estimate, double expected, std::size_t channel = 0, double relative = 2e-6) {
    const Pooled p = pooled(estimate, channel);
    CAPTURE(p.mean);
    CAPTURE(p.error);
    CAPTURE(expected);
    CHECK(std::abs(p.mean - expected) <= 6.0 * p.error + relative * expected);
}
void check_same_mean(const Estimate& a, const Estimate& b) {
    for (std::size_t c = 0; c < 3; ++c) {
        const Pooled x = pooled(a, c), y = pooled(b, c);
        CAPTURE(x.mean);
        CAPTURE(y.mean);
        CAPTURE(x.error);
        CAPTURE(y.error);
        CHECK(x.mean > 0.0);
        CHECK(std::abs(x.mean - y.mean) <= 6.0 * std::hypot(x.error, y.error));
    }
}

PunctualLight light(PunctualKind kind, const dvec3& position, const dvec3& direction, const dvec3& intensity) {
    PunctualLight result;
    result.name = "light";
    result.kind = kind;
    result.position = position;
    result.direction = glm::normalize(direction);
    result.intensity = intensity;
    return result;
}

// Looks down at one point of a floor of colour C: the middle pixel of a narrow camera.
test::SceneBuilder floor_below(const Material& material) {
    test::SceneBuilder b;
    b.camera({0, 4, 0}, {0, 0, 0}, 0.01, {0, 0, -1}).floor(material, 0.0, 50.0);
    return b;
}

Material conductor(double roughness, const dvec3& eta = {0.2, 0.9, 1.1}, const dvec3& k = {3.9, 2.4, 2.2}) {
    Material material;
    material.kind = MaterialKind::conductor;
    material.roughness = roughness;
    material.eta = eta;
    material.k = k;
    return material;
}
Material boundary(std::uint32_t interior) {
    Material material;
    material.kind = MaterialKind::boundary;
    material.interior = interior;
    return material;
}
Medium medium(const dvec3& absorption, const dvec3& scattering, double anisotropy = 0.0) {
    Medium result;
    result.name = "medium";
    result.absorption = absorption;
    result.scattering = scattering;
    result.anisotropy = anisotropy;
    return result;
}

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

TEST_CASE("the general variant estimates the same bits as the lean ones, on the shipped scenes") {
    for (const char* name : {"cornell-classic", "cornell-thesis", "glass", "model", "furnace", "closed-forms/defocus",
             "closed-forms/lamp-from-behind", "closed-forms/polygon-light", "closed-forms/fuzz"}) {
        CAPTURE(name);
        const Scene scene = load_scene(std::string(TANDEM_SOURCE_DIR "/scenes/") + name + ".json");
        for (const Integrator integrator : {Integrator::path, Integrator::next_event})
            for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
                RenderSettings s = default_settings(scene);
                s.width = s.height = 20;
                s.integrator = integrator;
                s.roulette_start = 3;
                const Estimate lean = render(scene, s, 8, precision);
                s.effects = EffectSet::all();
                CHECK(same_bits(lean, render(scene, s, 8, precision)));
            }
    }
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

TEST_CASE("rough glass in a white furnace loses only what single scattering loses, and none when all but smooth") {
    test::SceneBuilder b;
    Material rough = test::glass(1.5);
    rough.roughness = 0.03;
    b.camera({0, 0, 4}, {0, 0, 0}, 10).background(dvec3(1.0)).sphere(rough, {0, 0, 0}, 1.0);
    check_mean(render(b.scene(), settings(8, Integrator::path, 40), 256), 1.0, 0, 2e-3);
    Scene rougher = b.scene();
    rougher.materials[0].roughness = 0.6;
    const double mean = pooled(render(rougher, settings(8, Integrator::path, 40), 256)).mean;
    CHECK(mean < 1.0);
    CHECK(mean > 0.7);
}

TEST_CASE("a ball that moves across a pixel covers it for the share of the shutter that it is there") {
    // One pixel sees only the axis; the ball of radius 1 moves 8 units through it: there for 2/8 of the time.
    for (const std::size_t others : {std::size_t{0}, std::size_t{80}}) {
        test::SceneBuilder b;
        b.camera({0, 0, 20}, {0, 0, 0}, 0.01).background(dvec3(1.0));
        b.sphere(test::emitter(dvec3(3.0)), {-5, 0, 0}, 1.0);
        for (std::size_t i = 0; i < others; ++i)  // past one leaf: the hierarchy
            b.sphere(test::diffuse(dvec3(0.5)), {-40.0 + static_cast<double>(i), 30, 0}, 0.3);
        Scene scene = b.scene();
        scene.entities[0].motion = {8, 0, 0};
        for (const Precision precision : {Precision::single_precision, Precision::double_precision})
            check_mean(render(scene, settings(2, Integrator::path, 1), 4096, precision), 0.75 + 3.0 * 0.25);
        // The same seen by a camera that moves instead.
        scene.entities[0].motion = {};
        scene.camera.position_motion = scene.camera.target_motion = {-8, 0, 0};
        check_mean(render(scene, settings(2, Integrator::path, 1), 4096), 0.75 + 3.0 * 0.25);
    }
}

TEST_CASE("moving triangles and cuboids shade and shadow as their mean over time") {
    for (const bool cuboid : {false, true}) {
        test::SceneBuilder b = floor_below(test::diffuse(dvec3(0.5)));
        if (cuboid)
            b.cuboid(test::diffuse(dvec3(0.5)), {-4, 5, -1}, {-2, 6, 1});
        else
            b.quad(test::diffuse(dvec3(0.5)), {-4, 5, 1}, {-2, 5, 1}, {-2, 5, -1}, {-4, 5, -1});
        Scene scene = b.scene();
        scene.lights = {light(PunctualKind::sun, {}, {0, -1, 0}, dvec3(2))};
        scene.entities[1].motion = {8, 0, 0};  // over the point from tau = 1/4 to 1/2
        check_mean(render(scene, settings(2, Integrator::next_event, 1), 4096), 0.5 / pi * 2 * 0.75);
    }
}

TEST_CASE("Beer-Lambert: a slab of glass without a change of index, and the surroundings, thin the sky") {
    test::SceneBuilder b;
    b.camera({0, 0, 5}, {0, 0, 0}, 0.01).background(dvec3(1.0));
    b.cuboid(boundary(0), {-1, -1, -0.75}, {1, 1, 0.75});
    Scene scene = b.scene();
    scene.media = {medium({0.5, 1.0, 0.0}, dvec3(0.0))};
    const auto mean = mean_of(render(scene, settings(1, Integrator::path, 2), 4));
    CHECK(mean[0] == doctest::Approx(std::exp(-0.75)).epsilon(1e-5));
    CHECK(mean[1] == doctest::Approx(std::exp(-1.5)).epsilon(1e-5));
    CHECK(mean[2] == 1.0);
    // A lamp at a distance in fog all around.
    test::SceneBuilder lamp;
    lamp.camera({0, 0, 5}, {0, 0, 0}, 0.01).cuboid(test::emitter(dvec3(2.0)), {-1, -1, -1}, {1, 1, 0});
    Scene foggy = lamp.scene();
    foggy.media = scene.media;
    foggy.medium = 0;
    CHECK(mean_of(render(foggy, settings(1, Integrator::path, 0), 4))[0] ==
          doctest::Approx(2 * std::exp(-2.5)).epsilon(1e-5));
}

TEST_CASE("single precision measures its ways from the surface, not from where rays start off it") {
    // On a floor of 200 units rays start 2e-4 off it, which would show in 1/r^2 and in exp(-sigma d).
    Scene scene = floor_below(test::diffuse(dvec3(0.5))).scene();
    for (dvec3& vertex : scene.vertices) vertex *= 2.0;
    scene.lights = {light(PunctualKind::point, {0, 1, 0}, {0, -1, 0}, dvec3(2))};
    scene.media = {medium(dvec3(0.5), dvec3(0.0))};
    scene.medium = 0;
    CHECK(mean_of(render(scene, settings(1, Integrator::next_event, 1), 16))[0] ==
          doctest::Approx(0.5 / pi * 2 * std::exp(-0.5 * 5)).epsilon(2e-6));
    test::SceneBuilder b;
    b.camera({0, 3, 0}, {0, 0, 0}, 1e-4, {0, 0, 1}).background(dvec3(1.0));
    b.cuboid(boundary(0), {-100, -1, -100}, {100, 0, 100});
    Scene slab = b.scene();
    slab.media = scene.media;
    CHECK(mean_of(render(slab, settings(1, Integrator::path, 4), 16))[0] ==
          doctest::Approx(std::exp(-0.5)).epsilon(2e-6));
}

TEST_CASE("fog thins next events over the way of their light") {
    Scene scene = floor_below(test::diffuse(dvec3(0.5))).scene();
    scene.media = {medium({0.25, 0.0, 0.0}, dvec3(0.0))};
    scene.medium = 0;
    scene.lights = {light(PunctualKind::point, {0, 2, 0}, {0, -1, 0}, dvec3(8))};
    const auto mean = mean_of(render(scene, settings(1, Integrator::next_event, 1), 16));
    CHECK(mean[0] == doctest::Approx(0.5 / pi * 2 * std::exp(-0.25 * (4 + 2))).epsilon(1e-4));
    CHECK(mean[1] == doctest::Approx(0.5 / pi * 2).epsilon(1e-4));
}

TEST_CASE("a medium that only scatters keeps all light of an even sky") {
    for (const double g : {0.0, 0.7, -0.3})
        for (const bool grid : {false, true}) {
            test::SceneBuilder b;
            b.camera({0, 0, 5}, {0, 0, 0}, 20).background(dvec3(1.0)).sphere(boundary(0), {0, 0, 0}, 1.0);
            Scene scene = b.scene();
            scene.media = {medium(dvec3(0.0), {1.0, 2.0, 0.5}, g)};
            if (grid) {
                auto density = std::make_shared<DensityGrid>();
                density->cells = {2, 2, 2};
                density->low = dvec3(-1.0);
                density->high = dvec3(1.0);
                density->density = {1, 0, 2, 0.5, 0, 3, 1, 1};
                scene.media[0].grid = density;
            }
            for (const std::size_t c : {std::size_t{0}, std::size_t{1}})
                check_mean(render(scene, settings(8, Integrator::path, 200), 256), 1.0, c, 1e-4);
            scene.background.sampled = true;  // every shadow ray ends at the boundary
            check_mean(render(scene, settings(8, Integrator::next_event, 200), 256), 1.0, 0, 1e-4);
        }
}

TEST_CASE("single scattering of a point light in fog is its integral") {
    // Fog around everything with a black wall at distance 3, and a point light in it: the camera sees, per length,
    // sigma_s p I/r^2 T(s + r) over the way s of sight.
    const double sigma_s = 0.3, sigma_a = 0.2, g = 0.6, sigma = sigma_s + sigma_a;
    test::SceneBuilder b;
    b.camera({0, 0, 0}, {0, 0, -1}, 0.001)
        .quad(test::diffuse(dvec3(0.0)), {-9, -9, -3}, {9, -9, -3}, {9, 9, -3}, {-9, 9, -3});
    Scene scene = b.scene();
    scene.media = {medium(dvec3(sigma_a), dvec3(sigma_s), g)};
    scene.medium = 0;
    const dvec3 position(0.5, 0, -1.5);
    scene.lights = {light(PunctualKind::point, position, {0, -1, 0}, dvec3(5.0))};
    double expected = 0.0;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) {
        const double s = 3.0 * (i + 0.5) / n;
        const dvec3 to_light = position - dvec3(0, 0, -s);
        const double r = glm::length(to_light), mu = -to_light.z / r;
        const double phase = (1 - g * g) / (4 * pi * std::pow(1 + g * g - 2 * g * mu, 1.5));
        expected += 3.0 / n * sigma_s * std::exp(-sigma * (s + r)) * phase * 5.0 / (r * r);
    }
    for (const Integrator integrator : {Integrator::next_event, Integrator::whitted})
        check_mean(render(scene, settings(8, integrator, 1), 4096), expected, 0, 1e-4);
}

TEST_CASE("nested slabs: a ray through glass with water inside meets index against index") {
    // A slab of glass (priority 2) that overlaps one of water (priority 1): air, glass, water, air. The overlap is
    // glass, and the water's face within it is not there.
    Material glass = test::glass(1.5), water = test::glass(1.33);
    glass.priority = 2;
    water.priority = 1;
    const auto reflectance = [](double n) { return (n - 1) * (n - 1) / ((n + 1) * (n + 1)); };
    // Only the straight way comes to the lamp behind within four events: three transmissions and one skipped face.
    test::SceneBuilder with_lamp;
    with_lamp.camera({0, 0, 10}, {0, 0, 0}, 0.01);
    with_lamp.cuboid(glass, {-9, -9, 0}, {9, 9, 2}).cuboid(water, {-9, -9, -2}, {9, 9, 1});
    with_lamp.quad(test::emitter(dvec3(1.0)), {-9, -9, -5}, {9, -9, -5}, {9, 9, -5}, {-9, 9, -5});
    const double expected = (1 - reflectance(1.5)) * (1 - reflectance(1.33 / 1.5)) * (1 - reflectance(1.33));
    check_mean(render(with_lamp.scene(), settings(16, Integrator::path, 4), 1024), expected, 0, 1e-5);
    // Fewer events do not come through, as the skipped face counts.
    CHECK(pooled(render(with_lamp.scene(), settings(8, Integrator::path, 3), 64)).mean == 0.0);
}

TEST_CASE("a medium in a body of higher priority rules where two overlap") {
    Material inner = boundary(0), outer = boundary(1);
    inner.priority = 5;
    test::SceneBuilder b;
    b.camera({0, 0, 10}, {0, 0, 0}, 0.01).background(dvec3(1.0));
    b.cuboid(inner, {-1, -1, -1}, {1, 1, 1}).cuboid(outer, {-2, -2, 0}, {2, 2, 3});
    Scene scene = b.scene();
    scene.media = {medium(dvec3(0.5), dvec3(0.0)), medium(dvec3(0.25), dvec3(0.0))};
    // outer from 3 to 1, inner from 1 to -1.
    CHECK(mean_of(render(scene, settings(1, Integrator::path, 6), 4))[0] ==
          doctest::Approx(std::exp(-0.25 * 2 - 0.5 * 2)).epsilon(1e-5));
}

TEST_CASE("a fifth body around a path makes its samples invalid") {
    test::SceneBuilder b;
    b.camera({0, 0, 20}, {0, 0, 0}, 0.01).background(dvec3(1.0));
    for (int i = 0; i < 5; ++i) b.sphere(boundary(0), {0, 0, 0}, 10.0 - i);
    Scene scene = b.scene();
    scene.media = {medium(dvec3(0.0), dvec3(0.0))};
    CHECK(render(scene, settings(2, Integrator::path, 12), 16).invalid() == 4u * 16u);
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
