// The Embree path tracer as a Renderer: closed forms, estimators against each other, and the promises of RenderJob.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include "common/error.h"
#include "common/stopwatch.h"
#include "cpu_ref/backend.h"
#include "cpu_ref/planted.h"
#include "tests/scene_builder.h"

using namespace tandem;

namespace {

BackendOptions with(Precision precision, unsigned threads = 0) {
    BackendOptions options;
    options.precision = precision;
    options.threads = threads;
    return options;
}

RenderSettings settings(std::uint32_t size, Integrator integrator, std::uint32_t bounces, std::uint64_t seed = 1) {
    RenderSettings s;
    s.width = s.height = size;
    s.integrator = integrator;
    s.bounces = bounces;
    s.seed = seed;
    return s;
}

RenderResult render(const Scene& scene, const RenderSettings& s, SampleRange range,
    const BackendOptions& options = with(Precision::single_precision), const RenderControl& control = {}) {
    const auto renderer = cpu_backend().create(options);
    return renderer->prepare(scene, s)->render(range, control);
}

bool same_bits(const Estimate& a, const Estimate& b) {
    const Estimate::Plane left = a.totals(), right = b.totals();
    return a.count() == b.count() && std::ranges::equal(left, right, [](const Moments& x, const Moments& y) {
        return x.sum == y.sum && x.sum_of_squares == y.sum_of_squares;
    });
}

// Mean over all pixels of each channel, and its standard error from the variance between samples.
struct Pooled {
    double mean[3]{}, error[3]{};
};
Pooled pooled(const Estimate& estimate) {
    const auto mean = mean_of(estimate), variance = variance_of(estimate);
    const double pixels = static_cast<double>(estimate.pixel_count()), n = static_cast<double>(estimate.count());
    Pooled result;
    for (std::size_t i = 0; i < mean.size(); ++i) {
        result.mean[i % 3] += mean[i] / pixels;
        result.error[i % 3] += variance[i] / n / (pixels * pixels);
    }
    for (double& e : result.error) e = std::sqrt(e);
    return result;
}

// Two independent estimates of one mean differ by less than six standard errors of their difference. That is a false
// alarm in 10^9, and the seeds are fixed.
void check_same_mean(const Estimate& a, const Estimate& b) {
    const Pooled x = pooled(a), y = pooled(b);
    for (int c = 0; c < 3; ++c) {
        CAPTURE(x.mean[c]);
        CAPTURE(y.mean[c]);
        CHECK(std::abs(x.mean[c] - y.mean[c]) <= 6.0 * std::hypot(x.error[c], y.error[c]));
    }
}

Scene furnace(double albedo, double radiance) {
    test::SceneBuilder b;
    b.cuboid(test::diffuse(glm::dvec3(albedo), glm::dvec3(radiance)), {-1, -2, -3}, {4, 5, 6});
    return b.camera({0, 0, 0}, {1, 0.5, 0.2}, 60).scene();
}

// Two unequal lamps (one a quad, one a sphere), a mirror, a glass ball and a box, in a room of cuboids and triangles.
Scene room() {
    test::SceneBuilder b;
    b.camera({0, 1.2, 4.5}, {0, 1, 0}, 45).background({0.05, 0.05, 0.1});
    b.quad(test::diffuse({0.7, 0.7, 0.6}), {-3, 0, 3}, {3, 0, 3}, {3, 0, -3}, {-3, 0, -3});
    b.cuboid(test::diffuse({0.6, 0.2, 0.2}), {-3.2, 0, -3}, {-3, 4, 3})
        .cuboid(test::diffuse(glm::dvec3(0.5)), {-3, 0, -3.2}, {3, 4, -3});
    b.quad(test::emitter({6, 5, 4}, EmittingSides::front), {-1, 3.5, -1}, {1, 3.5, -1}, {1, 3.5, 1}, {-1, 3.5, 1});
    b.sphere(test::emitter({1, 2, 4}), {-1.8, 0.6, 0.5}, 0.3);
    b.sphere(test::glass(1.5, Fresnel::exact, 0.5, {0.8, 0.9, 1.0}), {0.9, 0.7, 0.8}, 0.6);
    b.cuboid(test::mirror(glm::dvec3(0.9), 0.2), {-0.4, 0, -0.4}, {0.4, 1.4, 0.4},
        test::moved({-0.4, 0.01, -0.8}) * test::rotated(25, {0, 1, 0}));
    return b.scene();
}

}  // namespace

TEST_CASE("in a closed furnace every sample is E (1 - a^(D+1)) / (1 - a), for every number of bounces D") {
    for (const Precision precision : {Precision::single_precision, Precision::double_precision})
        for (const std::uint32_t bounces : {0u, 1u, 2u, 5u, 12u, 40u}) {
            CAPTURE(bounces);
            const double a = 0.75, e = 0.5;
            const Estimate estimate =
                render(furnace(a, e), settings(8, Integrator::path, bounces), {0, 32}, with(precision)).estimate;
            const double expected = e * (1.0 - std::pow(a, bounces + 1.0)) / (1.0 - a);
            // 0.75 is exact, its powers and their sum round at most 2 (D + 1) times.
            const double roundoff = precision == Precision::single_precision ? 0x1p-24 : 0x1p-53;
            for (const double mean : mean_of(estimate))
                CHECK(std::abs(mean / expected - 1.0) <= 2.0 * (bounces + 2.0) * roundoff);
            CHECK(estimate.invalid() == 0);
        }
}

TEST_CASE("next event estimation leaves the furnace's mean alone") {
    const Estimate estimate = render(furnace(0.75, 0.5), settings(16, Integrator::next_event, 6), {0, 256}).estimate;
    const Pooled p = pooled(estimate);
    CHECK(std::abs(p.mean[0] - 0.5 * (1.0 - std::pow(0.75, 7.0)) / 0.25) <= 6.0 * p.error[0]);
}

TEST_CASE("both integrators estimate the same mean, next event with less variance") {
    const Estimate path = render(room(), settings(48, Integrator::path, 8, 3), {0, 512}).estimate;
    const Estimate next = render(room(), settings(48, Integrator::next_event, 8, 4), {0, 512}).estimate;
    check_same_mean(path, next);
    CHECK(pooled(next).error[0] < pooled(path).error[0]);
}

TEST_CASE("single and double precision estimate the same mean") {
    for (const Integrator integrator : {Integrator::path, Integrator::next_event})
        check_same_mean(render(room(), settings(40, integrator, 8, 5), {0, 192}).estimate,
            render(room(), settings(40, integrator, 8, 6), {0, 192}, with(Precision::double_precision)).estimate);
}

TEST_CASE("with the same seed, single and double precision follow the same paths") {
    const RenderSettings s = settings(32, Integrator::next_event, 4, 9);
    const auto a = mean_of(render(room(), s, {0, 64}).estimate);
    const auto b = mean_of(render(room(), s, {0, 64}, with(Precision::double_precision)).estimate);
    // Few pixels hold a path that rounding parts (an edge, a choice near its threshold).
    std::size_t apart = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (std::abs(a[i] - b[i]) > 1e-3 * (a[i] + b[i])) ++apart;
    CHECK(apart < a.size() / 20);
}

TEST_CASE("roulette changes no mean") {
    RenderSettings with_roulette = settings(40, Integrator::next_event, 10, 7);
    with_roulette.roulette_start = 1;
    check_same_mean(render(room(), settings(40, Integrator::next_event, 10, 8), {0, 256}).estimate,
        render(room(), with_roulette, {0, 256}).estimate);
}

TEST_CASE("an estimate has the same bits for any number of threads") {
    const RenderSettings s = settings(37, Integrator::next_event, 6);
    const Estimate one = render(room(), s, {0, 96}, with(Precision::single_precision, 1)).estimate;
    for (const unsigned threads : {2u, 5u})
        CHECK(same_bits(one, render(room(), s, {0, 96}, with(Precision::single_precision, threads)).estimate));
}

TEST_CASE("an estimate has the same bits however its range is cut, also in the hierarchy") {
    test::SceneBuilder many;  // more primitives than one leaf holds
    many.camera({0, 0, 6}, {0, 0, 0}, 50).background(glm::dvec3(1.0));
    for (int i = 0; i < 100; ++i)
        many.triangle_box(test::diffuse(glm::dvec3(0.6)), {-0.2, -0.2, -0.2}, {0.2, 0.2, 0.2},
            test::moved({(i % 10) * 0.5 - 2.3, (i / 10) * 0.5 - 2.3, 0.1 * (i % 7)}) *
                test::rotated(7.0 * i, {1, 2, 3}));
    for (const Scene& scene : {room(), many.scene()}) {
        const auto renderer = cpu_backend().create(with(Precision::single_precision));
        const auto job = renderer->prepare(scene, settings(24, Integrator::next_event, 6));
        const Estimate whole = job->render({0, 200}).estimate;
        Estimate parts = job->render({128, 200}).estimate;
        parts.merge(job->render({0, 64}).estimate);
        parts.merge(job->render({64, 128}).estimate);
        CHECK(same_bits(whole, parts));
    }
}

TEST_CASE("samples beyond 2^32 are their own") {
    const RenderSettings s = settings(8, Integrator::path, 4);
    const std::uint64_t far = (std::uint64_t{1} << 32);
    const auto renderer = cpu_backend().create({});
    const auto job = renderer->prepare(room(), s);
    CHECK_FALSE(mean_of(job->render({0, 64}).estimate) == mean_of(job->render({far, far + 64}).estimate));
    CHECK(job->render({far, far + 64}).estimate.ranges().front() == SampleRange{far, far + 64});
}

TEST_CASE("a stop request ends a long render with what every pixel has") {
    std::stop_source source;
    std::atomic<bool> has_block = false;
    const RenderControl control{.stop = source.get_token(), .progress = [&](double samples) {
                                    if (samples >= 64.0) has_block = true;
                                }};
    std::jthread stopper([&] {
        while (!has_block) std::this_thread::sleep_for(std::chrono::milliseconds(10));
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
        source.request_stop();
    });
    const RenderSettings s = settings(128, Integrator::next_event, 12);
    const RenderResult result = render(room(), s, {0, 1u << 24}, {}, control);
    stopper.join();
    const std::uint64_t count = result.estimate.count();
    CHECK(count > 0);
    CHECK(count < (1u << 24));
    CHECK(result.estimate.ranges().size() == 1);
    CHECK(same_bits(result.estimate, render(room(), s, {0, count}).estimate));
}

TEST_CASE("a stop request before the start renders nothing") {
    std::stop_source source;
    source.request_stop();
    RenderControl control;
    control.stop = source.get_token();
    CHECK(render(room(), settings(16, Integrator::path, 3), {0, 64}, {}, control).estimate.count() == 0);
}

TEST_CASE("progress grows to the samples asked for") {
    std::vector<double> calls;
    RenderControl control;
    control.progress = [&](double done) { calls.push_back(done); };
    const RenderResult result = render(room(), settings(64, Integrator::next_event, 6), {0, 200}, {}, control);
    CHECK(result.estimate.count() == 200);
    REQUIRE_FALSE(calls.empty());
    CHECK(calls.back() == doctest::Approx(200.0));
    CHECK(std::ranges::is_sorted(calls));
}

TEST_CASE("an empty scene shows its background, and an empty range no sample") {
    test::SceneBuilder b;
    b.background({0.25, 0.5, 1.0});
    const Estimate estimate = render(b.scene(), settings(4, Integrator::next_event, 3), {0, 64}).estimate;
    CHECK(mean_of(estimate)[0] == doctest::Approx(0.25).epsilon(1e-6));
    CHECK(render(b.scene(), settings(4, Integrator::path, 3), {0, 0}).estimate.count() == 0);
}

TEST_CASE("a range that does not begin at a block is refused") {
    CHECK_THROWS_AS(render(room(), settings(4, Integrator::path, 3), {1, 64}), Error);
}

// Release builds hold no trace of planted bugs: the question is answered when compiling.
static_assert(!cpu::planted(PlantedBug::cosine_dropped));

TEST_CASE("what the backend cannot do it refuses") {
    BackendOptions device, kernel, validation, bug;
    kernel.kernel = "megakernel";
    device.device = "0";
    validation.validation = true;
    bug.planted_bug = PlantedBug::cosine_dropped;
    for (const BackendOptions& options : {device, kernel, validation, bug})
        CHECK_THROWS_AS(cpu_backend().create(options), UnsupportedError);
    CHECK_THROWS_AS(render(room(), settings(0, Integrator::path, 3), {0, 64}), UnsupportedError);
    CHECK_THROWS_AS(render(room(), settings(65536, Integrator::path, 3), {0, 64}), UnsupportedError);
    CHECK_THROWS_AS(render(room(), settings(4, Integrator::bidirectional, 3), {0, 64}), UnsupportedError);
    RenderSettings too_few = settings(4, Integrator::path, 3);
    too_few.effects = EffectSet{Effect::triangles};
    CHECK_THROWS_AS(render(room(), too_few, {0, 64}), UnsupportedError);
    RenderSettings quick = settings(4, Integrator::path, 3);
    quick.hierarchy = HierarchyQuality::low;
    for (const Backend& backend : {oracle_backend(), first_backend()})
        CHECK_THROWS_AS((void)backend.create({})->prepare(room(), quick), UnsupportedError);
}

namespace {

// A torus of 2 n^2 triangles about `place`, and a camera beside it.
Scene torus_at(const glm::dvec3& place, std::uint32_t n) {
    Scene scene = test::SceneBuilder()
                      .camera(place + glm::dvec3(0.0, 2.0, 4.0), place)
                      .background(glm::dvec3(1.0), glm::dvec3(1.0))
                      .sphere(test::diffuse(glm::dvec3(0.5)), place, 0.1)
                      .scene();
    const auto angle = [&](std::uint32_t i) { return 2.0 * std::numbers::pi * i / n; };
    Entity torus = scene.entities.front();
    torus.first_primitive = static_cast<std::uint32_t>(scene.primitives.size());
    torus.primitive_count = 2 * n * n;
    const auto first = static_cast<std::uint32_t>(scene.vertices.size());
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < n; ++j) {
            const double around = 1.0 + 0.3 * std::cos(angle(j));
            scene.vertices.push_back(
                place + glm::dvec3(around * std::cos(angle(i)), 0.3 * std::sin(angle(j)), around * std::sin(angle(i))));
            const auto at = [&](std::uint32_t a, std::uint32_t b) { return first + (i + a) % n * n + (j + b) % n; };
            for (const std::array<std::uint32_t, 3>& corners :
                {std::array{at(0, 0), at(0, 1), at(1, 1)}, std::array{at(0, 0), at(1, 1), at(1, 0)}}) {
                Primitive triangle;
                triangle.kind = PrimitiveKind::triangle;
                triangle.index = corners;
                scene.primitives.push_back(triangle);
            }
        }
    scene.entities.push_back(torus);
    return scene;
}

}  // namespace

namespace {

// Stacks of five squares in one place, each of another colour: which one is hit is for rules to decide, not for trees.
Scene coincident() {
    test::SceneBuilder b;
    b.camera({0.5, 0.7, 6.0}, glm::dvec3(0.0), 50.0).background(glm::dvec3(0.3), glm::dvec3(0.8));
    for (int i = 0; i < 20; ++i)
        for (const double albedo : {0.1, 0.3, 0.5, 0.7, 0.9}) {
            const double x = 0.5 * (i % 5) - 1.2, y = 0.5 * (i / 5) - 0.8, z = 0.1 * (i % 3);
            b.quad(test::diffuse(glm::dvec3(albedo)),
                {glm::dvec3{x, y, z}, {x + 0.4, y, z}, {x + 0.4, y + 0.4, z}, {x, y + 0.4, z}});
        }
    return b.scene();
}

}  // namespace

TEST_CASE("the quality of the hierarchy changes no bit of an image, also where triangles coincide") {
    for (const Scene& scene : {torus_at({0.0, 0.0, 0.0}, 40), torus_at({1e4, 0.0, 0.0}, 40), coincident()})
        for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
            RenderSettings s = settings(32, Integrator::path, 4);
            const Estimate high = render(scene, s, {0, 16}, with(precision)).estimate;
            for (const HierarchyQuality quality : {HierarchyQuality::medium, HierarchyQuality::low}) {
                s.hierarchy = quality;
                CAPTURE(hierarchy_quality_names[static_cast<std::size_t>(quality)]);
                CHECK(same_bits(high, render(scene, s, {0, 16}, with(precision)).estimate));
            }
        }
}

TEST_CASE("the time that a hierarchy took to build is told, and a leaf takes none") {
    const Scene scene = torus_at({0.0, 0.0, 0.0}, 300);
    for (const HierarchyQuality quality : {HierarchyQuality::low, HierarchyQuality::medium, HierarchyQuality::high}) {
        RenderSettings s = settings(8, Integrator::path, 1);
        s.hierarchy = quality;
        const Stopwatch watch;
        const double seconds = cpu_backend().create({})->prepare(scene, s)->facts().hierarchy_seconds;
        CHECK(seconds > 0.0);
        CHECK(seconds < watch.seconds());
    }
    CHECK(
        cpu_backend().create({})->prepare(room(), settings(8, Integrator::path, 1))->facts().hierarchy_seconds == 0.0);
}

// Its triangles' bounds were wider than the whole torus: every ray met all of them.
TEST_CASE("a fine mesh far from another body takes no longer than its triangles' order") {
    const glm::dvec3 far(1e6, 0.0, 0.0);
    const Scene alone = torus_at(far, 50);
    Scene beside = alone;
    beside.vertices.emplace_back(0.0);
    Primitive ball;
    ball.kind = PrimitiveKind::sphere;
    ball.index[0] = static_cast<std::uint32_t>(beside.vertices.size() - 1);
    ball.radius = 1.0;
    beside.primitives.push_back(ball);
    Entity entity = beside.entities.front();
    entity.first_primitive = static_cast<std::uint32_t>(beside.primitives.size() - 1);
    entity.primitive_count = 1;
    beside.entities.push_back(entity);
    const RenderSettings s = settings(16, Integrator::path, 4);
    // The quickest of several, as others may be at work on the machine.
    const auto quickest = [&](const Scene& scene) {
        double seconds = std::numeric_limits<double>::infinity();
        for (int run = 0; run < 3; ++run) seconds = std::min(seconds, render(scene, s, {0, 64}).seconds);
        return seconds;
    };
    const double one = quickest(alone), both = quickest(beside);
    CAPTURE(one);
    CAPTURE(both);
    CHECK(both < 50.0 * one + 0.2);
}
