// Bidirectional path tracing against the oracle's path tracing and closed forms: every way to sample a path counts
// once.
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "cpu_ref/backend.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::test;

namespace {

struct Mean {
    dvec3 value{0.0}, error{0.0};  // over the image; standard error
    std::uint64_t invalid = 0;
};

// From batches of 64 samples: what one sample gives to several pixels makes these depend on each other.
Mean mean_of_batches(Renderer& renderer, const Scene& scene, const RenderSettings& settings, std::uint64_t batches) {
    const auto job = renderer.prepare(scene, settings);
    Mean mean;
    dvec3 squares(0.0);
    for (std::uint64_t batch = 0; batch < batches; ++batch) {
        const Estimate estimate = job->render({64 * batch, 64 * (batch + 1)}).estimate;
        const std::vector<double> pixels = tandem::mean_of(estimate);
        dvec3 sum(0.0);
        for (std::size_t i = 0; i < pixels.size(); ++i) sum[static_cast<int>(i % 3)] += pixels[i];
        sum /= static_cast<double>(estimate.pixel_count());
        mean.value += sum;
        squares += sum * sum;
        mean.invalid += estimate.invalid();
    }
    const auto n = static_cast<double>(batches);
    mean.value /= n;
    mean.error = glm::sqrt(glm::max(squares / n - mean.value * mean.value, dvec3(0.0)) / (n - 1.0));
    return mean;
}

// With 20 batches a mean leaves six of its standard errors, Student's t, once in 1e5; seeds are fixed.
constexpr double sigmas = 6.0;

void check_against_oracle(const Scene& scene, std::uint32_t bounces, Integrator reference = Integrator::path,
    std::uint32_t roulette_start = no_roulette) {
    const auto cpu = cpu_backend().create({}), oracle = oracle_backend().create({});
    RenderSettings settings = settings_of(16, bounces, Integrator::bidirectional);
    settings.roulette_start = roulette_start;
    const Mean found = mean_of_batches(*cpu, scene, settings, 20);
    const Mean expected = mean_of_batches(*oracle, scene, settings_of(16, bounces, reference, 99), 20);
    CHECK(found.invalid == 0);
    for (int i = 0; i < 3; ++i) {
        CAPTURE(i);
        CAPTURE(found.value[i]);
        CAPTURE(expected.value[i]);
        CAPTURE(found.error[i]);
        CAPTURE(expected.error[i]);
        CHECK(std::abs(found.value[i] - expected.value[i]) <= sigmas * std::hypot(found.error[i], expected.error[i]));
    }
}

Scene shipped(const std::string& name) { return load_scene(std::string(TANDEM_SOURCE_DIR "/scenes/") + name); }

Material rough_gold() {
    Material material;
    material.kind = MaterialKind::conductor;
    material.eta = {0.143, 0.375, 1.442};
    material.k = {3.983, 2.386, 1.603};
    material.roughness = 0.5;
    return material;
}

// A grey room of one cuboid, seen from within, with a lamp below its ceiling.
SceneBuilder room(const Material& lamp) {
    return SceneBuilder()
        .camera({0.0, 0.2, 1.8}, {0.0, -0.2, 0.0}, 60.0)
        .cuboid(diffuse({0.6, 0.5, 0.4}), {-1.0, -1.0, -1.0}, {1.0, 1.0, 2.0})
        .quad(lamp, {-0.3, 0.9, -0.3}, {0.3, 0.9, -0.3}, {0.3, 0.9, 0.3}, {-0.3, 0.9, 0.3});
}

void check_depth(std::uint32_t bounces) {
    CAPTURE(bounces);
    check_against_oracle(room(emitter(dvec3(6.0, 5.0, 4.0))).scene(), bounces);
}

void check_material(const Material& material) {
    CAPTURE(material.translucent);
    CAPTURE(material.fuzz);
    CAPTURE(material.roughness);
    check_against_oracle(room(emitter({6.0, 5.0, 4.0})).sphere(material, {0.1, -0.4, 0.1}, 0.45).scene(), 4);
}

}  // namespace

TEST_CASE("bidirectional paths have the mean of the path integrator in the Cornell box") {
    check_against_oracle(shipped("cornell-classic.json"), 6);
}

TEST_CASE("bidirectional paths have the mean of the path integrator on further shipped scenes" *
          doctest::test_suite("full")) {
    for (const char* name : {"cornell-thesis.json", "glass.json", "furnace.json"}) {
        CAPTURE(name);
        check_against_oracle(shipped(name), 6);
    }
}

TEST_CASE("bidirectional paths have the mean of the path integrator at the first depths") {
    for (const std::uint32_t bounces : {0u, 1u, 2u}) check_depth(bounces);
}

TEST_CASE("bidirectional paths have the mean of the path integrator at further depths" * doctest::test_suite("full")) {
    for (const std::uint32_t bounces : {3u, 4u}) check_depth(bounces);
}

TEST_CASE("bidirectional paths count every kind of light that they sample once") {
    const dvec3 glow(6.0, 5.0, 4.0);
    check_against_oracle(
        room(emitter(glow, EmittingSides::front)).sphere(emitter(glow), {0.4, -0.5, 0.1}, 0.2).scene(), 3);
    check_against_oracle(room(diffuse(dvec3(0.5), glow))
                             .cuboid(emitter(glow, EmittingSides::front), {-0.6, -0.9, -0.4}, {-0.3, -0.5, 0.0},
                                 rotated(30.0, {0.0, 1.0, 0.3}))
                             .scene(),
        3);
}

TEST_CASE(
    "bidirectional paths count lights that they do not sample, and mirrored ones, once" * doctest::test_suite("full")) {
    const dvec3 glow(6.0, 5.0, 4.0);
    // Not among its lights: an ellipsoid, glowing glass, and a lamp that moves.
    check_against_oracle(
        room(emitter(black)).sphere(emitter(glow), {0.4, -0.5, 0.1}, 0.3, scaled({1.0, 1.4, 0.8})).scene(), 3);
    Material glass_lamp = glass(1.4, Fresnel::exact, 0.5);
    glass_lamp.kind = MaterialKind::emissive;
    glass_lamp.radiance = glow;
    check_against_oracle(room(emitter(black)).sphere(glass_lamp, {0.4, -0.5, 0.1}, 0.3).scene(), 3);
    Scene moving = room(emitter(black)).sphere(emitter(glow), {0.4, -0.5, 0.1}, 0.3).scene();
    moving.entities.back().motion = {-0.6, 0.5, 0.0};
    check_against_oracle(moving, 3);
    // Mirrored: its front looks down.
    const dmat4 upside_down = scaled({1.0, -1.0, 1.0});
    check_against_oracle(room(emitter(black))
                             .triangle(emitter(glow, EmittingSides::front), {-0.5, 0.5, 0.5}, {0.5, 0.5, 0.5},
                                 {0.0, 0.5, -0.5}, upside_down)
                             .scene(),
        3);
}

TEST_CASE("bidirectional paths have the mean of the path integrator with rough gold and frosted glass") {
    Material frosted = glass(1.5);
    frosted.roughness = 0.4;
    for (const Material& material : {rough_gold(), frosted}) check_material(material);
}

TEST_CASE("bidirectional paths have the mean of the path integrator with each further material" *
          doctest::test_suite("full")) {
    Material dust = diffuse({0.8, 0.6, 0.4});
    dust.kind = MaterialKind::rough_diffuse;
    dust.roughness = 0.7;
    for (const Material& material : {dust, mirror({0.9, 0.8, 0.7}), mirror(dvec3(0.9), 0.3), glass(1.5),
             glass(1.5, Fresnel::schlick, 0.3, {0.5, 0.8, 0.9}), glass(1.3, Fresnel::exact, 0.0, white, 0.2)})
        check_material(material);
}

TEST_CASE("bidirectional paths keep their mean under water") {
    // The camera outside, lamp and floor in the refracting body: radiance is not scaled by the square of the index.
    const Scene scene =
        SceneBuilder()
            .camera({0.0, 1.5, 4.0}, {0.0, -0.4, 0.0}, 35.0)
            .background(dvec3(0.2, 0.1, 0.3))
            .cuboid(glass(1.5), {-1.0, -1.0, -1.0}, {1.0, 0.0, 1.0})
            .quad(diffuse({0.7, 0.6, 0.5}), {-0.9, -0.9, 0.9}, {0.9, -0.9, 0.9}, {0.9, -0.9, -0.9}, {-0.9, -0.9, -0.9})
            .sphere(emitter({5.0, 6.0, 4.0}), {0.2, -0.4, 0.1}, 0.15)
            .sphere(emitter({9.0, 6.0, 4.0}), {-0.5, 0.8, 0.1}, 0.25)
            .scene();
    check_against_oracle(scene, 5);
}

TEST_CASE("bidirectional paths keep their mean through a lens and by roulette") {
    Scene scene = room(emitter(dvec3(6.0, 5.0, 4.0))).sphere(glass(1.5), {0.1, -0.4, 0.1}, 0.45).scene();
    scene.camera.lens_radius = 0.15;
    scene.camera.focus_distance = 2.0;
    check_against_oracle(scene, 4);
    check_against_oracle(scene, 4, Integrator::path, 2);
    scene.camera.position_motion = {0.2, 0.1, 0.0};
    scene.camera.target_motion = {0.0, 0.3, 0.0};
    check_against_oracle(scene, 3);
}

TEST_CASE("bidirectional paths keep their mean among textures, moving bodies and under an image of the sky") {
    Scene scene = SceneBuilder()
                      .camera({0.0, 1.5, 4.0}, {0.0, -0.2, 0.0}, 35.0)
                      .floor(diffuse(white), -0.5, 2.0)
                      .sphere(emitter({9.0, 6.0, 4.0}), {-0.5, 1.2, 0.1}, 0.25)
                      .sphere(glass(1.5), {-0.6, 0.0, 0.3}, 0.4)
                      .cuboid(diffuse({0.7, 0.6, 0.5}), {0.2, -0.4, -0.4}, {0.8, 0.3, 0.4})
                      .scene();
    Texture board;
    board.name = "board";
    board.frequency = {1.7, 0.0, 2.3};
    scene.textures.push_back(board);
    scene.materials[0].colour_texture = 0;
    scene.materials[3].colour_texture = 0;
    scene.entities[2].motion = {0.4, 0.1, 0.0};
    scene.entities[3].motion = {-0.3, 0.3, 0.2};
    check_against_oracle(scene, 4);
    Pixels sky{4, 2, {}};
    for (int i = 0; i < 24; ++i) sky.rgb.push_back(static_cast<float>((i * 7) % 10) * 0.1F);
    scene.background.image = std::make_shared<const Pixels>(std::move(sky));
    check_against_oracle(scene, 4);
    scene.background.sampled = true;
    check_against_oracle(scene, 4);
}

TEST_CASE("bidirectional paths sample a sky mixed of two colours beside a lamp") {
    Scene scene = SceneBuilder()
                      .camera({0.0, 1.5, 4.0}, {0.0, -0.2, 0.0}, 35.0)
                      .background({0.1, 0.0, 0.3}, {0.9, 1.2, 1.5})
                      .floor(diffuse({0.6, 0.7, 0.5}), -0.5, 2.0)
                      .sphere(rough_gold(), {-0.6, 0.0, 0.3}, 0.4)
                      .sphere(glass(1.5), {0.5, 0.0, 0.3}, 0.4)
                      .scene();
    scene.background.sampled = true;
    check_against_oracle(scene, 4);
    scene.background.down = black;
    scene.entities[1].object_to_world = moved({0.0, 0.2, 0.0});
    scene.materials[1] = emitter(dvec3(0.5));
    check_against_oracle(scene, 3);
}

TEST_CASE("bidirectional paths see point, spot and sun lights as next events do, beside lamps") {
    const auto add = [](Scene scene, PunctualKind kind) {
        PunctualLight light;
        light.kind = kind;
        light.position = {0.3, 0.5, 0.4};
        light.direction = glm::normalize(dvec3(-0.3, -1.0, 0.2));
        light.intensity = {1.0, 0.8, 0.6};
        light.inner_degrees = 20.0;
        scene.lights.push_back(light);
        return scene;
    };
    const Scene lit = room(emitter(dvec3(1.0, 2.0, 1.5))).sphere(rough_gold(), {0.1, -0.6, 0.1}, 0.3).scene();
    const Scene open = SceneBuilder()
                           .camera({0.0, 1.5, 4.0}, black, 35.0)
                           .background(dvec3(0.2))
                           .floor(diffuse(dvec3(0.6)), -0.5, 2.0)
                           .cuboid(diffuse({0.6, 0.3, 0.2}), {-0.5, -0.5, -0.5}, {0.5, 0.3, 0.4})
                           .sphere(emitter(dvec3(3.0)), {0.9, 0.4, 0.5}, 0.2)
                           .scene();
    for (const PunctualKind kind : {PunctualKind::point, PunctualKind::spot, PunctualKind::sun}) {
        CAPTURE(static_cast<int>(kind));
        check_against_oracle(add(open, kind), 3, Integrator::next_event);
        if (kind != PunctualKind::sun) check_against_oracle(add(lit, kind), 3, Integrator::next_event);
    }
}

TEST_CASE("under a small lamp, a glass ball's caustic has a hundredth of the variance that next events leave") {
    // Scattering finds the lamp seldom, next events never through the glass. Three events: the caustic itself, not yet
    // its image in the glass, which no way of sampling finds often.
    const Scene scene = SceneBuilder()
                            .camera({0.0, 2.0, 3.0}, {0.0, -0.5, 0.0}, 40.0)
                            .floor(diffuse(dvec3(0.7)), -0.6, 3.0)
                            .sphere(glass(1.5), {0.2, 0.1, 0.0}, 0.5)
                            .sphere(emitter(dvec3(1000.0)), {1.6, 2.0, -0.3}, 0.04)
                            .scene();
    const auto cpu = cpu_backend().create({});
    const auto mean_variance = [&](Integrator integrator) {
        const Estimate estimate = cpu->prepare(scene, settings_of(24, 3, integrator))->render({0, 2048}).estimate;
        double sum = 0.0;
        for (const double variance : variance_of(estimate)) sum += variance;
        return sum;
    };
    const double ratio = mean_variance(Integrator::bidirectional) / mean_variance(Integrator::next_event);
    MESSAGE("variance relative to next events: " << ratio);
    CHECK(ratio < 0.01);
}

TEST_CASE("bidirectional estimates do not depend on threads or cuts") {
    const Scene scene = room(emitter(dvec3(6.0, 5.0, 4.0))).sphere(glass(1.5), {0.1, -0.4, 0.1}, 0.45).scene();
    const auto render = [&](unsigned threads, SampleRange range) {
        BackendOptions options;
        options.threads = threads;
        return cpu_backend()
            .create(options)
            ->prepare(scene, settings_of(8, 4, Integrator::bidirectional))
            ->render(range)
            .estimate;
    };
    const Estimate whole = render(1, {0, 150});
    Estimate parts = render(3, {128, 150});
    parts.merge(render(2, {0, 128}));
    REQUIRE(whole.ranges() == parts.ranges());
    const Estimate::Plane a = whole.totals(), b = parts.totals();
    bool same = true;
    for (std::size_t i = 0; i < a.size(); ++i)
        same = same && a[i].sum == b[i].sum && a[i].sum_of_squares == b[i].sum_of_squares;
    CHECK(same);
}

TEST_CASE("the bidirectional integrator refuses what it does not simulate, and says what") {
    const auto cpu = cpu_backend().create({});
    Scene foggy = room(emitter(white)).scene();
    foggy.media.emplace_back();
    foggy.media[0].scattering = white;
    foggy.medium = 0;
    const RenderSettings settings = settings_of(4, 3, Integrator::bidirectional);
    CHECK_THROWS_WITH_AS((void)cpu->prepare(foggy, settings), doctest::Contains("medium"), UnsupportedError);
    Scene smooth = room(emitter(white)).floor(diffuse(white), 0.0, 0.2).scene();
    smooth.normals.assign(smooth.vertices.size(), dvec3(0.6, 0.8, 0.0));
    CHECK_THROWS_WITH_AS(
        (void)cpu->prepare(smooth, settings), doctest::Contains("no shading normals"), UnsupportedError);
    RenderSettings cut = settings;
    cut.ray_max = 5.0;
    CHECK_THROWS_WITH_AS(
        (void)cpu->prepare(room(emitter(white)).scene(), cut), doctest::Contains("ray interval"), UnsupportedError);
    for (const Precision precision : {Precision::single_precision, Precision::mixed}) {
        BackendOptions options;
        options.precision = precision;
        const auto other = cpu_backend().create(options);
        CHECK_THROWS_WITH_AS((void)other->prepare(room(emitter(white)).scene(), settings),
            doctest::Contains("double precision alone"), UnsupportedError);
    }
}

TEST_CASE("a stop ends a bidirectional sample among its ways, and keeps the images that are whole") {
    const Scene box = SceneBuilder()
                          .camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0)
                          .triangle_box(diffuse(white), dvec3(-1.0), dvec3(1.0))
                          .sphere(emitter(white), {0.5, 0.5, 0.5}, 0.01)
                          .scene();
    BackendOptions alone;
    alone.threads = 1;
    const auto cpu = cpu_backend().create(alone);
    std::stop_source source, later;
    {
        // A hundred million joins of a path with a path.
        const auto job = cpu->prepare(box, settings_of(4, 10'000, Integrator::bidirectional));
        const std::jthread stopper([&] {
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
            source.request_stop();
        });
        CHECK(job->render({0, 64}, {.stop = source.get_token(), .progress = {}}).estimate.count() == 0);
    }
    const auto job = cpu->prepare(box, settings_of(4, 5, Integrator::bidirectional));
    const RenderControl control{.stop = later.get_token(), .progress = [&](double done) {
                                    if (done >= 70.0) later.request_stop();
                                }};
    const Estimate stopped = job->render({0, 128}, control).estimate;
    CHECK(stopped.count() == 70);
    CHECK(tandem::mean_of(stopped) == tandem::mean_of(job->render({0, 70}).estimate));
}
