// Ellipsoids, moving and translucent emitters as sampled lights (MODEL.md section 9.2), rendered: closed forms, next
// events against scattering alone, here and by the oracle.
#include <doctest/doctest.h>

#include <functional>

#include "tests/cpu_ref/renders.h"

using namespace tandem;
using namespace tandem::test::renders;
using glm::dvec3;

namespace {

Estimate render_by_oracle(const Scene& scene, const RenderSettings& s, std::uint64_t samples) {
    return oracle_backend().create({})->prepare(scene, s)->render({0, samples}).estimate;
}

// Next events in both precisions, against scattering alone here and in the oracle.
void check_integrators(const Scene& scene, std::uint32_t bounces) {
    const Estimate path = render(scene, settings(16, Integrator::path, bounces, 3), 4096);
    const Estimate next = render(scene, settings(16, Integrator::next_event, bounces, 4), 1024);
    check_same_mean(path, next);
    check_same_mean(
        path, render(scene, settings(16, Integrator::next_event, bounces, 5), 512, Precision::double_precision));
    check_same_mean(next, render_by_oracle(scene, settings(16, Integrator::path, bounces, 6), 1024));
}

// A floor, with a ball and a box on it, around where lamps hang at (0, 1.2, 0).
test::SceneBuilder stage() {
    test::SceneBuilder b;
    b.camera({0, 2, 5}, {0, 0.5, 0}, 40).floor(test::diffuse({0.7, 0.6, 0.5}), 0.0, 3.0);
    b.sphere(test::diffuse({0.3, 0.5, 0.7}), {-1, 0.4, 0.3}, 0.4);
    b.cuboid(test::diffuse(dvec3(0.6)), {0.7, 0, -0.4}, {1.3, 0.5, 0.2});
    return b;
}
const dvec3 glow(6, 5, 4);

Material glowing_glass(EmittingSides sides = EmittingSides::both, double alpha = 0.6) {
    Material material = test::glass(1.3, Fresnel::exact, alpha, {0.9, 0.7, 0.8});
    material.kind = MaterialKind::emissive;
    material.radiance = glow;
    material.sides = sides;
    return material;
}

// Mean over tau of f.
double over_time(const std::function<double(double)>& f) {
    constexpr int n = 2000;
    double sum = 0.0;
    for (int i = 0; i < n; ++i) sum += f((i + 0.5) / n) / n;
    return sum;
}

constexpr std::array both_precisions{Precision::single_precision, Precision::double_precision};

}  // namespace

TEST_CASE("within an ellipsoid of even radiance a floor sends C times it") {
    for (const dvec3& axes : {dvec3(3, 5, 4), dvec3(8, 0.8, 5)})
        for (const Precision precision : both_precisions)
            for (const Integrator integrator : {Integrator::next_event, Integrator::whitted}) {
                test::SceneBuilder b;
                b.camera({0.3, 0.5, 0.1}, {0.2, 0, 0}, 20).floor(test::diffuse({0.8, 0.4, 0.2}), 0.0, 0.6);
                b.sphere(test::emitter(dvec3(2)), {0, 0, 0}, 1.0,
                    test::moved({0.2, 0.1, 0}) * test::rotated(15, {1, 1, 0.4}) * test::scaled(axes));
                const Estimate lit = render(b.scene(), settings(8, integrator, 1), 4096, precision);
                check_mean(lit, 1.6, 0, 2e-5);
                check_mean(lit, 0.4, 2, 2e-5);
            }
}

TEST_CASE("under an ellipsoid of revolution a floor has the irradiance of its cone") {
    // Tangents from a point at h below its centre, semiaxes b along the vertical and a across it: tan^2 = a^2/(h^2 -
    // b^2).
    const auto expected = [](double a, double b, double h) { return 0.5 * 3 * a * a / (a * a + h * h - b * b); };
    for (const dvec3& abh :
        {dvec3(1, 0.3, 2), dvec3(0.3, 1.5, 2), dvec3(1, 0.001, 1), dvec3(0.001, 1, 1.2), dvec3(2, 0.5, 0.51)})
        for (const Precision precision : both_precisions)
            for (const Integrator integrator : {Integrator::next_event, Integrator::whitted}) {
                CAPTURE(abh.x);
                CAPTURE(abh.y);
                CAPTURE(abh.z);
                test::SceneBuilder b = floor_below(test::diffuse(dvec3(0.5)));
                b.camera({3, 0.02, 0}, {0, 0, 0}, 1e-6)
                    .sphere(test::emitter(dvec3(3)), {0, 0, 0}, 1.0,
                        test::moved({0, abh.z, 0}) * test::scaled({abh.x, abh.y, abh.x}));
                check_mean(render(b.scene(), settings(8, integrator, 1), 2048, precision),
                    expected(abh.x, abh.y, abh.z), 0, 1e-4);
            }
}

TEST_CASE("a lamp that moves lights a floor as its mean over time") {
    const auto lit = [](const Scene& scene, const dvec3& motion, double expected) {
        Scene moving = scene;
        moving.entities[1].motion = motion;
        moving.camera.position = {0, 4, 20};  // past the lamp
        for (const Precision precision : both_precisions)
            for (const Integrator integrator : {Integrator::path, Integrator::next_event, Integrator::whitted})
                check_mean(render(moving, settings(8, integrator, 1), 4096, precision), expected, 0, 1e-4);
    };
    // A sphere of radius 1 at height 2, from x = -3 to 5; one that is stretched, from height 1.5 to 4.
    test::SceneBuilder ball = floor_below(test::diffuse(dvec3(0.5)));
    ball.sphere(test::emitter(dvec3(3)), {-3, 2, 0}, 1.0);
    lit(ball.scene(), {8, 0, 0}, over_time([](double t) {
        const double x = -3 + 8 * t, square = 4 + x * x;
        return 0.5 * 3 / square * 2 / std::sqrt(square);
    }));
    test::SceneBuilder egg = floor_below(test::diffuse(dvec3(0.5)));
    egg.sphere(test::emitter(dvec3(3)), {0, 0, 0}, 1.0, test::moved({0, 1.5, 0}) * test::scaled({0.5, 1.2, 0.5}));
    lit(egg.scene(), {0, 2.5, 0}, over_time([](double t) {
        const double h = 1.5 + 2.5 * t;
        return 0.5 * 3 * 0.25 / (0.25 + h * h - 1.44);
    }));
}

TEST_CASE("next events find ellipsoids as scattering does") {
    const auto lamp = test::emitter(glow);
    const auto hang = test::moved({0, 1.2, 0}) * test::rotated(40, {1, 0.2, 0.5});
    check_integrators(stage().sphere(lamp, {0, 0, 0}, 0.3, hang * test::scaled({1, 0.3, 2})).scene(), 3);
    check_integrators(
        stage()
            .sphere(test::emitter(glow, EmittingSides::front), {0, 0, 0}, 0.5, hang * test::scaled({1, -0.001, 1}))
            .scene(),
        3);
    // On the floor, and one that is lit itself, from within too: all of the stage lies in it.
    check_integrators(
        stage().sphere(test::diffuse(dvec3(0.6), glow), {0, 0.2, 0}, 0.2, test::scaled({2, 1, 1.5})).scene(), 3);
    check_integrators(
        stage().sphere(test::diffuse(dvec3(0.4), dvec3(0.5)), {0, 0, 0}, 1.0, test::scaled({6, 5, 8})).scene(), 3);
}

TEST_CASE("next events find moving lamps of all kinds as scattering does") {
    const auto check = [](const test::SceneBuilder& b, const dvec3& motion) {
        Scene scene = b.scene();
        scene.entities.back().motion = motion;
        check_integrators(scene, 3);
        scene.entities[1].motion = {0.3, 0.2, 0};  // what it lights, too
        check_integrators(scene, 2);
    };
    const Material lamp = test::emitter(glow);
    check(stage().triangle(lamp, {-0.3, 1.2, 0.3}, {0.3, 1.2, 0.3}, {0, 1.4, -0.3}), {0.9, 0.3, -0.5});
    check(stage().sphere(lamp, {-0.5, 1.2, 0}, 0.25), {1.2, 0.2, 0.4});
    check(stage().cuboid(lamp, {-0.7, 1.0, -0.2}, {-0.3, 1.2, 0.2}, test::rotated(20, {0, 1, 1})), {1.2, 0.2, 0.4});
    check(
        stage().sphere(lamp, {0, 0, 0}, 0.3, test::moved({-0.5, 1.2, 0}) * test::scaled({1, 0.3, 2})), {1.2, 0.2, 0.4});
}

TEST_CASE("next events find glowing glass as scattering does, outside and inside of it") {
    for (const EmittingSides sides : {EmittingSides::both, EmittingSides::front}) {
        const Material glass = glowing_glass(sides), ball = test::diffuse({0.8, 0.5, 0.6});
        check_integrators(stage().sphere(ball, {0, 1.1, 0}, 0.25).sphere(glass, {0, 1.2, 0}, 0.6).scene(), 4);
        check_integrators(stage()
                              .sphere(ball, {0, 1.1, 0}, 0.25)
                              .sphere(glass, {0, 1.2, 0}, 0.6, test::scaled({1.2, 1, 0.7}))
                              .scene(),
            4);
        check_integrators(
            stage().sphere(ball, {0, 1.1, 0}, 0.25).cuboid(glass, {-0.5, 0.7, -0.6}, {0.5, 1.6, 0.5}).scene(), 4);
    }
    Scene moving = stage()
                       .sphere(test::diffuse(dvec3(0.7)), {0, 1.1, 0}, 0.25)
                       .cuboid(glowing_glass(), {-0.5, 0.7, -0.6}, {0.5, 1.6, 0.5})
                       .scene();
    moving.entities.back().motion = {0.5, 0.3, 0.2};  // over the ball, in part
    check_integrators(moving, 4);
}

TEST_CASE("small lamps cost next events a hundredth of the variance that scattering leaves, also those that move") {
    const dvec3 bright = 100.0 * glow;
    const auto ratio = [](const Scene& scene) {
        Scene seen = scene;
        seen.camera.target = {0, 0, 1};
        seen.camera.vertical_field_degrees = 15;  // the floor, not the lamp
        const auto variance = [&](Integrator integrator) {
            double sum = 0.0;
            for (const double v : variance_of(render(seen, settings(16, integrator, 3), 8192))) sum += v;
            return sum;
        };
        const double relative = variance(Integrator::next_event) / variance(Integrator::path);
        MESSAGE("variance relative to path: " << relative);
        return relative;
    };
    Scene moving = stage().sphere(test::emitter(bright), {-1.0, 2.2, 0}, 0.06).scene();
    moving.entities.back().motion = {2.0, 0.3, 0.5};
    CHECK(ratio(moving) < 0.01);
    const auto at = test::moved({0, 2.2, 0}) * test::rotated(40, {1, 0, 1});
    CHECK(ratio(stage().sphere(test::emitter(bright), {0, 0, 0}, 0.06, at * test::scaled({1, 0.3, 2})).scene()) < 0.01);
    // A glass emitter is sampled on its outside alone: next events do not find what its inside sends through it.
    Material glass = glowing_glass(EmittingSides::front);
    glass.radiance = bright;
    CHECK(ratio(stage().sphere(glass, {0, 2.2, 0}, 0.06).scene()) < 0.01);
    CHECK(ratio(stage().cuboid(glass, {0, 2.2, 0}, {0.1, 2.25, 0.1}).scene()) < 0.01);
}
