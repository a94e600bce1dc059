// Light choice, points on lights and their densities (MODEL.md section 9.2).
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "cpu_ref/path_tracer/geometry/accelerator.h"
#include "cpu_ref/path_tracer/light/light_sampling.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::cpu;

namespace {

const Material lamp = test::emitter(glm::dvec3(1.0));
const Material front_lamp = test::emitter(glm::dvec3(1.0), EmittingSides::front);

template <class Real>
struct Stage {
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    explicit Stage(const Scene& scene)
        : device(rtcNewDevice(nullptr)), tables(make_tables<Real>(scene, {})), accelerator(device.get(), tables) {}

    static Receiver<Real> receiver(const glm::dvec3& p) {
        const auto splat = [](double x) { return V(static_cast<Real>(x)); };
        return {{splat(p.x), splat(p.y), splat(p.z)}, {splat(0), splat(1), splat(0)}, Ints<Real>(U{no_primitive}), {}};
    }

    embree::Device device;
    Tables<Real> tables;
    Accelerator<Real> accelerator;
};

struct Tally {
    double solid_angle = 0.0;    // mean of 1/density over usable samples: the solid angle that they cover
    double worst_density = 0.0;  // relative difference between the sampled density and that of the direction hit
    int missed = 0;              // samples whose ray does not come to the light
};

// Samples a scene's lights from p over an n x n grid of the two numbers of the point, with choice number `choice`.
template <class Real>
Tally tally(const Scene& scene, const glm::dvec3& p, double choice = 0.0, int n = 64) {
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    const Stage<Real> stage(scene);
    const Receiver<Real> from = Stage<Real>::receiver(p);
    Tally result;
    for (int row = 0; row < n; ++row)
        for (int first = 0; first < n; first += lane_count<Real>) {
            V v1;
            for (int i = 0; i < lane_count<Real>; ++i)
                v1.v[i] = (static_cast<Real>(first + i) + Real(0.5)) / static_cast<Real>(n);
            const V v2((static_cast<Real>(row) + Real(0.5)) / static_cast<Real>(n)), v0(static_cast<Real>(choice));
            const LightSample<Real> sample = sample_light(stage.tables, from, {v0, v1, v2, v0});
            const Ray<V> ray = make_ray(from.point, sample.direction, V(Real(0)), V(stage.tables.limit));
            const Hit<Real> hit = stage.accelerator.closest(ray, {Ints<Real>(U{no_primitive}), {}}, sample.usable);
            const Surface<Real> surface = surface_at(stage.tables, ray, hit);
            const V density =
                light_density(stage.tables, from.point, from.primitive, from.inside, hit, surface, sample.direction);
            for (int i = 0; i < lane_count<Real>; ++i) {
                if (((sample.usable.to_bits() >> i) & 1u) == 0) continue;
                const double sampled = static_cast<double>(sample.density[i]);
                result.solid_angle += 1.0 / sampled / (n * n);
                if (((hit.found.to_bits() >> i) & 1u) == 0)
                    ++result.missed;
                else
                    result.worst_density =
                        std::max(result.worst_density, std::abs(static_cast<double>(density[i]) / sampled - 1.0));
            }
        }
    return result;
}

template <class Real>
constexpr double tolerance = sizeof(Real) == 4 ? 2e-5 : 1e-12;

constexpr double pi = std::numbers::pi;

// Solid angle of a triangle from the origin. [Van Oosterom, Strackee 1983]
double solid_angle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    return 2.0 * std::abs(std::atan2(glm::dot(a, glm::cross(b, c)),
                     la * lb * lc + glm::dot(a, b) * lc + glm::dot(a, c) * lb + glm::dot(b, c) * la));
}

}  // namespace

TEST_CASE_TEMPLATE(
    "samples of a triangle cover its solid angle, at the density of their directions", Real, float, double) {
    const glm::dvec3 a(-1, 2, -1), b(2, 2.5, 0), c(0, 2, 1.5);
    test::SceneBuilder builder;
    builder.triangle(lamp, a, b, c);
    const Tally t = tally<Real>(builder.scene(), {0, 0, 0});
    CHECK(t.solid_angle == doctest::Approx(solid_angle(a, b, c)).epsilon(1e-3));  // midpoint rule at 64 x 64
    CHECK(t.worst_density < tolerance<Real>);
    CHECK(t.missed == 0);
}

TEST_CASE_TEMPLATE("samples of a sphere from outside fill its cone evenly", Real, float, double) {
    test::SceneBuilder builder;
    builder.sphere(lamp, {1, 3, 0.5}, 1.2);
    const Tally t = tally<Real>(builder.scene(), {0, 0, 0});
    const double s2 = 1.2 * 1.2 / (1 + 9 + 0.25);
    CHECK(t.solid_angle == doctest::Approx(2 * pi * (1 - std::sqrt(1 - s2))).epsilon(tolerance<Real>));
    CHECK(t.worst_density < tolerance<Real>);
    CHECK(t.missed == 0);
}

TEST_CASE_TEMPLATE("samples of a sphere from inside cover all directions", Real, float, double) {
    test::SceneBuilder builder;
    builder.sphere(lamp, {0.2, 0.1, 0}, 2.0);
    const Tally t = tally<Real>(builder.scene(), {0, 0, 0});
    CHECK(t.solid_angle == doctest::Approx(4 * pi).epsilon(1e-3));
    CHECK(t.worst_density < 10 * tolerance<Real>);
    CHECK(t.missed == 0);
}

TEST_CASE_TEMPLATE("a sphere far away keeps its solid angle", Real, float, double) {
    test::SceneBuilder builder;
    builder.sphere(lamp, {0, 1e4, 0}, 1.0);
    CHECK(tally<Real>(builder.scene(), {0, 0, 0}).solid_angle ==
          doctest::Approx(pi * 1e-8).epsilon(1e-6 + tolerance<Real>));
}

TEST_CASE_TEMPLATE("samples of a cuboid count on the faces that are seen, from inside on all", Real, float, double) {
    test::SceneBuilder builder;
    builder.cuboid(lamp, {-1, 2, -1}, {1, 3, 1});
    const Tally outside = tally<Real>(builder.scene(), {0, 0, 0}, 0.0, 192),
                inside = tally<Real>(builder.scene(), {0, 2.4, 0.1}, 0.0, 192);
    const double seen =
        solid_angle({-1, 2, -1}, {1, 2, -1}, {1, 2, 1}) + solid_angle({-1, 2, -1}, {1, 2, 1}, {-1, 2, 1});
    // One face of area 4 in a total of 16: 48 of 192 rows of the grid, cut exactly at its edges.
    CHECK(outside.solid_angle == doctest::Approx(seen).epsilon(1e-3));
    CHECK(inside.solid_angle == doctest::Approx(4 * pi).epsilon(5e-3));
    CHECK(outside.worst_density < tolerance<Real>);
    CHECK(inside.worst_density < 10 * tolerance<Real>);
    CHECK(outside.missed == 0);
    CHECK(inside.missed == 0);
}

TEST_CASE_TEMPLATE("one-sided lights are not sampled from behind", Real, float, double) {
    test::SceneBuilder up, sphere, cuboid;
    up.triangle(front_lamp, {-1, 2, 1}, {1, 2, 1}, {0, 2, -1});  // front upwards
    sphere.sphere(front_lamp, {0, 0, 0}, 1.0);
    cuboid.cuboid(front_lamp, {-1, -1, -1}, {1, 1, 1});
    CHECK(tally<Real>(up.scene(), {0, 0, 0}).solid_angle == 0.0);
    CHECK(tally<Real>(up.scene(), {0, 4, 0}).solid_angle > 0.1);
    CHECK(tally<Real>(sphere.scene(), {0, 0.1, 0}).solid_angle == 0.0);
    CHECK(tally<Real>(cuboid.scene(), {0, 0.1, 0}).solid_angle == 0.0);
}

TEST_CASE_TEMPLATE("lights are chosen by area times radiance, in id order", Real, float, double) {
    // Areas 1 and 3: the first light has a quarter.
    for (const std::size_t extra : {std::size_t{0}, std::size_t{40}}) {
        test::SceneBuilder builder;
        builder.triangle(lamp, {0, 0, 0}, {2, 0, 0}, {0, 1, 0}).triangle(lamp, {0, 0, 0}, {6, 0, 0}, {0, 1, 0});
        for (std::size_t i = 0; i < extra; ++i) builder.triangle(lamp, {0, 0, 0}, {0.2, 0, 0}, {0, 1, 0});  // 0.1 each
        const Tables<Real> tables = make_tables<Real>(builder.scene(), {});
        const double total = 4.0 + 0.1 * static_cast<double>(extra);
        const auto chosen = [&](double v) { return choose_light(tables.lights, Lanes<Real>(static_cast<Real>(v)))[0]; };
        CHECK(chosen(0.0) == 0);
        CHECK(chosen(0.999 / total) == 0);
        CHECK(chosen(1.001 / total) == 1);
        CHECK(chosen(3.999 / total) == 1);
        CHECK(chosen(1.0 - 0x1p-24) == 1 + extra);
        if (extra > 0) CHECK(chosen(4.05 / total) == 2);
        if (extra > 0) CHECK(chosen(5.55 / total) == 17);
    }
}

TEST_CASE("what emits is a sampled light, but for clear and tracked glass and what has no area") {
    Material glow = test::glass(1.5, Fresnel::exact, 0.5);
    glow.kind = MaterialKind::emissive;
    glow.radiance = glm::dvec3(1.0);
    const auto lights = [](const test::SceneBuilder& builder) {
        return make_tables<float>(builder.scene(), {}).lights;
    };
    test::SceneBuilder none;
    none.triangle(lamp, {0, 0, 0}, {1, 0, 0}, {2, 0, 0});  // no area
    none.sphere(test::glass(1.5), {0, 0, 0}, 1.0);
    Material clear = glow, with_interior = glow, with_priority = glow;
    clear.alpha = 0.0;
    with_interior.interior = 0;
    with_priority.priority = 0;
    for (const Material& material : {clear, with_interior, with_priority}) none.sphere(material, {0, 0, 0}, 1.0);
    CHECK(lights(none).count == 0);

    test::SceneBuilder some;
    some.sphere(lamp, {0, 0, 0}, 1.0, test::rotated(30, {1, 1, 0}) * test::scaled(glm::dvec3(2.0)));
    some.sphere(lamp, {0, 0, 0}, 1.0, test::scaled({1, 2, 4}));  // as one of radius 2
    some.sphere(glow, {0, 0, 0}, 2.0);                           // of half the radiance
    some.cuboid(glow, {0, 0, 0}, {1, 1, 1});
    const LightTable<float> table = lights(some);
    REQUIRE(table.count == 4);
    const double sphere = 16 * std::numbers::pi, total = 2.5 * sphere + 0.5 * 6;
    CHECK(table.chance.at(0) == doctest::Approx(sphere / total));
    CHECK(table.chance.at(1) == doctest::Approx(sphere / total));
    CHECK(table.chance.at(2) == doctest::Approx(0.5 * sphere / total));
    CHECK(table.chance.at(3) == doctest::Approx(0.5 * 6 / total));
    CHECK(table.kind.at(0) == static_cast<std::uint32_t>(LightKind::sphere));
    CHECK(table.kind.at(1) == static_cast<std::uint32_t>(LightKind::ellipsoid));
    CHECK(table.any_ellipsoid);
    CHECK(!table.any_moving);
}

TEST_CASE("power heuristic weights of two techniques sum to one, also where one has no density or an infinite one") {
    const auto sum = [](float a, float b) { return power_heuristic(a, b) + power_heuristic(b, a); };
    CHECK(sum(1.0f, 3.0f) == doctest::Approx(1.0));
    CHECK(power_heuristic(3.0f, 1.0f) == doctest::Approx(0.9));
    CHECK(sum(1e30f, 1e-30f) == doctest::Approx(1.0));
    CHECK(power_heuristic(std::numeric_limits<float>::infinity(), 1.0f) == 1.0f);
}
