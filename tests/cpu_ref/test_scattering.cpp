// Fresnel, Snell and fuzz of MODEL.md section 7.
#include <doctest/doctest.h>

#include <cmath>

#include "cpu_ref/path_tracer/material/scattering.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::cpu;

namespace {

template <class Real>
struct Reflectance {
    double value;
    bool total;
};
template <class Real>
Reflectance<Real> reflectance(double cosine, double eta, bool schlick) {
    const auto d = dielectric(Lanes<Real>(static_cast<Real>(cosine)), Lanes<Real>(static_cast<Real>(eta)),
        Mask<Real>::from_bits(schlick ? ~0u : 0u));
    return {static_cast<double>(d.reflectance[0]), (d.total_reflection.to_bits() & 1u) != 0};
}

// A direction of cosine c arriving at the plane z = 0 from above, and what u makes of it.
template <class Real>
struct Event {
    Vec3<double> direction;
    bool alive;
};
template <class Real>
Event<Real> event(const Material& material, double c, bool front, std::array<double, 3> numbers) {
    using V = Lanes<Real>;
    test::SceneBuilder b;
    b.triangle(material, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const Tables<Real> tables = make_tables<Real>(b.scene(), {});
    const V zero(Real(0)), one(Real(1)), cosine(static_cast<Real>(c)), sine(static_cast<Real>(std::sqrt(1.0 - c * c)));
    const Vec3<V> facing{zero, zero, one}, normal{zero, zero, front ? one : -one}, direction{sine, zero, -cosine};
    const RandomLanes<Real> u{
        V(static_cast<Real>(numbers[0])), V(static_cast<Real>(numbers[1])), V(static_cast<Real>(numbers[2])), zero};
    const Ints<Real> first(UnsignedOf<Real>{0});
    const Mask<Real> every = Mask<Real>::from_bits(~0u);
    const auto scattered = scatter_specular(tables, first, tables.materials.bits[first], every, direction, normal,
        facing, cosine, Mask<Real>::from_bits(front ? ~0u : 0u), u);
    return {{static_cast<double>(scattered.direction.x[0]), static_cast<double>(scattered.direction.y[0]),
                static_cast<double>(scattered.direction.z[0])},
        (scattered.alive.to_bits() & 1u) != 0};
}

template <class Real>
constexpr double tolerance = sizeof(Real) == 4 ? 2e-6 : 4e-15;  // some ten roundings of numbers about 1

}  // namespace

TEST_CASE_TEMPLATE(
    "glass of index 1.5 reflects 0.04 at normal incidence, from both sides, by both formulas", Real, float, double) {
    for (const bool schlick : {false, true})
        for (const double eta : {1.5, 1.0 / 1.5}) {
            CAPTURE(eta);
            CHECK(reflectance<Real>(1.0, eta, schlick).value == doctest::Approx(0.04).epsilon(tolerance<Real> * 10.0));
        }
}

TEST_CASE_TEMPLATE("a body of index 1 reflects nothing, near grazing too", Real, float, double) {
    for (const double c : {1.0, 0.1, 1e-3, 2e-4, 1e-4, 1e-7, 1e-9}) {
        CAPTURE(c);
        CHECK(reflectance<Real>(c, 1.0, false).value < 1e-13);
        CHECK_FALSE(reflectance<Real>(c, 1.0, false).total);
    }
}

TEST_CASE_TEMPLATE("exact reflectance vanishes for the parallel part at Brewster's angle", Real, float, double) {
    const double c = 1.0 / std::sqrt(1.0 + 1.5 * 1.5);  // tan = n
    const double eta = 1.0 / 1.5, ct = std::sqrt(1.0 - eta * eta * (1.0 - c * c));
    const double rs = (eta * c - ct) / (eta * c + ct);
    CHECK(reflectance<Real>(c, eta, false).value == doctest::Approx(0.5 * rs * rs).epsilon(tolerance<Real> * 10.0));
}

TEST_CASE_TEMPLATE("beyond the critical angle all is reflected, short of it not", Real, float, double) {
    const double critical = std::sqrt(1.0 - 1.0 / (1.5 * 1.5));  // its cosine inside
    CHECK(reflectance<Real>(critical - 1e-3, 1.5, false).total);
    CHECK(reflectance<Real>(critical - 1e-3, 1.5, true).value == 1.0);
    CHECK_FALSE(reflectance<Real>(critical + 1e-3, 1.5, false).total);
    CHECK(reflectance<Real>(critical + 1e-3, 1.5, false).value < 1.0);
}

TEST_CASE_TEMPLATE("grazing light is all reflected", Real, float, double) {
    CHECK(reflectance<Real>(0.0, 1.0 / 1.5, false).value == doctest::Approx(1.0));
    CHECK(reflectance<Real>(0.0, 1.0 / 1.5, true).value == doctest::Approx(1.0));
}

TEST_CASE_TEMPLATE("Schlick takes the cosine on the less dense side", Real, float, double) {
    const double c = 0.9, ct = std::sqrt(1.0 - 1.5 * 1.5 * (1.0 - c * c));
    const double expected = 0.04 + 0.96 * std::pow(1.0 - ct, 5.0);
    CHECK(reflectance<Real>(c, 1.5, true).value == doctest::Approx(expected).epsilon(tolerance<Real> * 100.0));
}

TEST_CASE_TEMPLATE("refraction follows Snell on both sides", Real, float, double) {
    const double c = 0.8, sine = 0.6;
    for (const bool front : {true, false}) {
        const double eta = front ? 1.0 / 1.5 : 1.5;
        const auto [direction, alive] = event<Real>(test::glass(1.5), c, front, {0.0, 0.0, 0.999});
        CHECK(alive);
        CHECK(direction.x == doctest::Approx(eta * sine).epsilon(tolerance<Real>));
        CHECK(
            direction.z == doctest::Approx(-std::sqrt(1.0 - eta * eta * sine * sine)).epsilon(tolerance<Real> * 10.0));
    }
}

TEST_CASE_TEMPLATE("the choice number below the reflectance reflects", Real, float, double) {
    const auto [direction, alive] = event<Real>(test::glass(1.5), 1.0, true, {0.0, 0.0, 0.0399});
    CHECK(direction.z == doctest::Approx(1.0));
    CHECK(event<Real>(test::glass(1.5), 1.0, true, {0.0, 0.0, 0.0401}).direction.z == doctest::Approx(-1.0));
}

TEST_CASE_TEMPLATE("total reflection mirrors and goes on", Real, float, double) {
    const auto [direction, alive] = event<Real>(test::glass(1.5), 0.5, false, {0.0, 0.0, 0.999});
    CHECK(alive);
    CHECK(direction.z == doctest::Approx(0.5).epsilon(tolerance<Real>));
}

TEST_CASE_TEMPLATE("a clear mirror reflects exactly, whatever the numbers", Real, float, double) {
    const auto [direction, alive] = event<Real>(test::mirror(glm::dvec3(1.0)), 0.6, true, {0.9, 0.3, 0.1});
    CHECK(alive);
    CHECK(direction.x == doctest::Approx(0.8).epsilon(tolerance<Real>));
    CHECK(direction.z == doctest::Approx(0.6).epsilon(tolerance<Real>));
}

TEST_CASE_TEMPLATE("fuzz absorbs (1 - c/f)/2 of the directions", Real, float, double) {
    const double c = 0.3, fuzz = 0.75;
    constexpr int n = 64;
    int absorbed = 0;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            if (!event<Real>(test::mirror(glm::dvec3(1.0), fuzz), c, true, {(i + 0.5) / n, (j + 0.5) / n, 0.0}).alive)
                ++absorbed;
    // The sphere's z is linear in the first number, so only one row of the grid can fall on the wrong side.
    CHECK(std::abs(absorbed / double(n * n) - 0.5 * (1.0 - c / fuzz)) <= 1.0 / n);
}

TEST_CASE_TEMPLATE("absorption is the colour, thinned by alpha where translucent", Real, float, double) {
    for (const double alpha : {0.0, 0.25, 1.0}) {
        test::SceneBuilder b;
        b.triangle(test::glass(1.5, Fresnel::exact, alpha, {0.2, 0.5, 1.0}), {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
        const Tables<Real> tables = make_tables<Real>(b.scene(), {});
        const Ints<Real> first(UnsignedOf<Real>{0});
        const auto a = absorption(tables, first, tables.materials.bits[first], tables.materials.colour[first]);
        CHECK(static_cast<double>(a.x[0]) == doctest::Approx(1.0 - alpha * 0.8).epsilon(tolerance<Real>));
        CHECK(static_cast<double>(a.z[0]) == 1.0);
    }
}
