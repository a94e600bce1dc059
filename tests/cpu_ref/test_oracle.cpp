// The oracle as a backend: what it refuses, and that its estimates do not depend on threads, cuts or stops. Its physics
// is held against closed forms in tests/suite.
#include <doctest/doctest.h>

#include <chrono>
#include <thread>

#include "common/error.h"
#include "cpu_ref/backend.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::test;

namespace {

Scene some_scene() {
    return SceneBuilder()
        .camera({0.0, 1.0, 5.0}, black, 40.0)
        .background(white, dvec3(0.5, 0.7, 1.0))
        .floor(diffuse({0.5, 0.4, 0.3}), -1.0, 10.0)
        .sphere(glass(1.5), {0.5, 0.0, 0.0}, 0.8)
        .cuboid(mirror(dvec3(0.9), 0.2), {-1.5, -0.9, -0.5}, {-0.5, 0.4, 0.5}, rotated(30.0, {0.0, 1.0, 0.0}))
        .scene();
}

RenderSettings small() {
    RenderSettings settings;
    settings.width = 7;
    settings.height = 5;
    settings.seed = 0x123456789ABCDEFu;
    return settings;
}

Estimate render(SampleRange range, unsigned threads) {
    BackendOptions options;
    options.threads = threads;
    return oracle_backend().create(options)->prepare(some_scene(), small())->render(range).estimate;
}

bool same_bits(const Estimate& a, const Estimate& b) {
    const Estimate::Plane left = a.totals(), right = b.totals();
    if (a.ranges() != b.ranges() || left.size() != right.size()) return false;
    for (std::size_t i = 0; i < left.size(); ++i)
        if (left[i].sum != right[i].sum || left[i].sum_of_squares != right[i].sum_of_squares) return false;
    return true;
}

}  // namespace

TEST_CASE("the oracle gives the same bits on any number of threads") {
    CHECK(same_bits(render({0, 100}, 1), render({0, 100}, 3)));
}

TEST_CASE("the oracle gives the same bits however the samples are cut") {
    Estimate parts = render({128, 200}, 2);
    parts.merge(render({0, 64}, 1));
    parts.merge(render({64, 128}, 1));
    CHECK(same_bits(parts, render({0, 200}, 2)));
}

TEST_CASE("a stopped oracle returns the samples that every pixel has, half of those begun at least") {
    std::stop_source source;
    RenderControl control;
    control.stop = source.get_token();
    double last = 0.0;
    control.progress = [&](double samples) {
        CHECK(samples > last);
        last = samples;
        if (samples >= 100.0) source.request_stop();
    };
    BackendOptions options;
    options.threads = 1;
    const auto renderer = oracle_backend().create(options);
    const Estimate estimate = renderer->prepare(some_scene(), small())->render({0, 640}, control).estimate;
    CHECK(estimate.count() == 96);  // a block, and passes of 1, 1, 2, 4, 8 and 16
    CHECK(same_bits(estimate, render({0, 96}, 1)));
}

TEST_CASE("a stop ends the oracle within a path") {
    const Scene box = SceneBuilder()
                          .camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0)
                          .triangle_box(diffuse(white), dvec3(-1.0), dvec3(1.0))
                          .scene();
    RenderSettings settings = small();
    settings.bounces = 200'000'000u;  // minutes
    std::stop_source source;
    const auto job = oracle_backend().create({})->prepare(box, settings);
    const std::jthread stopper([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        source.request_stop();
    });
    CHECK(job->render({0, 64}, {.stop = source.get_token(), .progress = {}}).estimate.count() == 0);
}

TEST_CASE("the oracle refuses what it does not do, and says so") {
    const auto refuses = [](const auto& change) {
        BackendOptions options;
        change(options);
        CHECK_THROWS_AS((void)oracle_backend().create(options), UnsupportedError);
    };
    refuses([](BackendOptions& o) { o.precision = Precision::single_precision; });
    refuses([](BackendOptions& o) { o.device = "0"; });
    refuses([](BackendOptions& o) { o.kernel = "megakernel"; });
    refuses([](BackendOptions& o) { o.validation = true; });
    refuses([](BackendOptions& o) { o.planted_bug = PlantedBug::alpha_ignored; });

    const auto renderer = oracle_backend().create({});
    RenderSettings settings = small();
    settings.integrator = Integrator::bidirectional;
    CHECK_THROWS_AS((void)renderer->prepare(some_scene(), settings), UnsupportedError);
    Scene scene = some_scene();
    scene.lights.emplace_back().intensity = white;
    CHECK_THROWS_WITH_AS((void)renderer->prepare(scene, small()), doctest::Contains("next-event"), UnsupportedError);
}

TEST_CASE("the oracle refuses a camera without a frame") {
    const auto renderer = oracle_backend().create({});
    Scene scene = some_scene();
    scene.camera.up = scene.camera.target - scene.camera.position;
    CHECK_THROWS_AS((void)renderer->prepare(scene, small()), UnsupportedError);
    scene.camera.target = scene.camera.position;
    CHECK_THROWS_AS((void)renderer->prepare(scene, small()), UnsupportedError);
}

TEST_CASE("the oracle refuses a range that does not begin at a block") {
    const auto renderer = oracle_backend().create({});
    CHECK_THROWS_AS((void)renderer->prepare(some_scene(), small())->render({1, 64}), Error);
}
