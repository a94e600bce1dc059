// Optical depth, its inverse, free flight and the phase function (MODEL.md section 10).
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "common/render/random.h"
#include "cpu_ref/path_tracer/material/media.h"
#include "cpu_ref/path_tracer/material/phase.h"
#include "tests/cpu_ref/statistics.h"

using namespace tandem;
using namespace tandem::cpu;
using glm::dvec3;

namespace {

double number(std::uint32_t i, std::uint32_t which) { return to_unit<double>(random_block(5, i, 0, 0)[which]); }

std::shared_ptr<DensityGrid> grid_of(std::array<std::uint32_t, 3> cells) {
    auto grid = std::make_shared<DensityGrid>();
    grid->cells = cells;
    grid->low = {-1.0, 0.5, -2.0};
    grid->high = {2.0, 1.5, 1.0};
    for (std::uint32_t i = 0; i < cells[0] * cells[1] * cells[2]; ++i)
        grid->density.push_back(i % 5 == 0 ? 0.0f : static_cast<float>(3.0 * number(i, 3)));
    return grid;
}

double density_at(const DensityGrid& grid, const dvec3& p) {
    std::array<std::size_t, 3> cell{};
    for (int i = 0; i < 3; ++i) {
        const double place = (p[i] - grid.low[i]) / (grid.high[i] - grid.low[i]);
        if (place < 0.0 || place >= 1.0) return 0.0;
        cell[static_cast<std::size_t>(i)] = static_cast<std::size_t>(place * grid.cells[static_cast<std::size_t>(i)]);
    }
    return static_cast<double>(grid.density[(cell[2] * grid.cells[1] + cell[1]) * grid.cells[0] + cell[0]]);
}

Medium medium_of(const dvec3& absorption, const dvec3& scattering, std::shared_ptr<DensityGrid> grid = nullptr) {
    Medium medium;
    medium.absorption = absorption;
    medium.scattering = scattering;
    medium.grid = std::move(grid);
    return medium;
}

MediumRay some_ray(std::uint32_t i) {
    const double z = 2.0 * number(i, 0) - 1.0, azimuth = 2.0 * std::numbers::pi * number(i, 1),
                 rho = std::sqrt(1 - z * z);
    const dvec3 through(-1.0 + 3.0 * number(i, 2), 0.5 + number(i, 3), -2.0 + 3.0 * number(i + 1000, 0));
    const dvec3 direction(rho * std::cos(azimuth), rho * std::sin(azimuth), z);
    return {through - direction * (3.0 * number(i + 1000, 1)), direction};
}

}  // namespace

TEST_CASE("the optical depth through a grid is that of a brute-force march, and its inverse comes back") {
    const auto grid = grid_of({7, 3, 5});
    const MediumForm form(medium_of(dvec3(1.0), dvec3(1.0), grid));
    for (std::uint32_t i = 0; i < 40; ++i) {
        const MediumRay ray = some_ray(i);
        const double length = 4.0;
        constexpr int steps = 200000;
        double marched = 0.0;
        for (int s = 0; s < steps; ++s)
            marched += density_at(*grid, ray.origin + ((s + 0.5) * length / steps) * ray.direction) * length / steps;
        const double exact = form.density_integral(ray, length);
        // A march errs by a step of the greatest density at each of at most 16 borders.
        CHECK(std::abs(exact - marched) <= 16.0 * 3.0 * length / steps);
        if (exact <= 0.0) continue;
        for (const double share : {0.1, 0.5, 0.9}) {
            const double t = form.distance_to(ray, length, share * exact);
            REQUIRE(t <= length);
            CHECK(form.density_integral(ray, t) == doctest::Approx(share * exact).epsilon(1e-9));
        }
        CHECK(std::isinf(form.distance_to(ray, length, exact * 1.001)));
    }
}

TEST_CASE("rays along the axes and cell borders cross every cell of their row once") {
    const auto grid = grid_of({3, 1, 3});
    const MediumForm form(medium_of(dvec3(1.0), dvec3(0.0), grid));
    double expected = 0.0;
    for (std::size_t i = 0; i < 3; ++i) expected += static_cast<double>(grid->density[3 + i]);  // cells 1 long
    for (const double side : {-1.0, 1.0}) {
        const MediumRay ray{{0.5 - 5.0 * side, 1.0, -0.5}, {side, 0.0, 0.0}};
        CHECK(form.density_integral(ray, std::numeric_limits<double>::infinity()) == doctest::Approx(expected));
    }
    CHECK(form.density_integral({{0.5, 3.0, 0.0}, {1.0, 0.0, 0.0}}, 100.0) == 0.0);
}

TEST_CASE("an absorbing medium thins light by exp(-sigma d), and one of no extinction not at all over infinity") {
    const MediumForm form(medium_of({0.5, 2.0, 0.0}, dvec3(0.0)));
    const auto step = form.advance({dvec3(0.0), {0, 0, 1}}, 1.5, 0.3, 0.9);
    CHECK_FALSE(step.scattered);
    CHECK(step.weight.x == doctest::Approx(std::exp(-0.75)));
    CHECK(step.weight.y == doctest::Approx(std::exp(-3.0)));
    CHECK(form.transmittance({dvec3(0.0), {0, 0, 1}}, std::numeric_limits<double>::infinity()) == dvec3(0, 0, 1));
}

TEST_CASE("free flight weighs so that the mean over its numbers is transmittance and scattering albedo, by channel") {
    // E[weight; through] = T(e), E[weight; scattered] = albedo (1 - T(e)), for homogeneous media and in a grid.
    for (const bool in_grid : {false, true}) {
        const dvec3 absorption(0.2, 0.1, 0.0), scattering(0.3, 1.0, 0.05);
        const auto grid = grid_of({4, 4, 4});
        const MediumForm form(medium_of(absorption, scattering, in_grid ? grid : nullptr));
        const MediumRay ray{{-1.5, 1.1, -0.7}, glm::normalize(dvec3(1.0, 0.05, 0.1))};
        const double end = 2.5;
        dvec3 through(0.0), scattered(0.0);
        constexpr int n = 3000;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < n; ++j) {
                const auto step = form.advance(ray, end, (i + 0.5) / 3.0, (j + 0.5) / n);
                (step.scattered ? scattered : through) += step.weight / (3.0 * n);
                if (step.scattered) CHECK((step.t >= 0.0 && step.t < end));
            }
        const dvec3 t = form.transmittance(ray, end), albedo = scattering / (absorption + scattering);
        for (int c = 0; c < 3; ++c) {
            // The rule of n equal steps errs by at most a step of the integrand's variation, here below 3 in sum.
            CHECK(std::abs(through[c] - t[c]) < 3.0 / n);
            CHECK(std::abs(scattered[c] - albedo[c] * (1.0 - t[c])) < 3.0 / n);
        }
    }
}

TEST_CASE_TEMPLATE(
    "Henyey-Greenstein directions are distributed as their density, whose mean cosine is g", Real, float, double) {
    using V = Lanes<Real>;
    constexpr int bins = 40, n = 20000;
    for (const double g : {0.0, 0.01, -0.5, 0.8, 0.99}) {
        CAPTURE(g);
        const Vec3<V> d{V(Real(0.48)), V(Real(-0.6)), V(Real(0.64))};
        std::vector<double> counts(bins, 0.0), expected(bins, 0.0);
        double mean = 0.0, worst = 0.0;
        const auto density = [&](double mu) {  // over the sphere, written as in MODEL.md
            return (1.0 - g * g) / (4.0 * std::numbers::pi * std::pow(1.0 + g * g - 2.0 * g * mu, 1.5));
        };
        for (int i = 0; i < n; ++i) {
            const V u1(static_cast<Real>((i + 0.5) / n)),
                u2(to_unit<Real>(random_block(1, 0, 0, static_cast<std::uint32_t>(i))[0]));
            const Vec3<V> w = sample_phase(d, V(static_cast<Real>(g)), u1, u2);
            const double mu = std::clamp(static_cast<double>(dot(d, w)[0]), -1.0, 1.0);
            const double p = static_cast<double>(phase_density(d, w, V(static_cast<Real>(g)))[0]);
            if (std::abs(g) < 0.9) worst = std::max(worst, std::abs(p / density(mu) - 1.0));
            mean += mu;
            counts[static_cast<std::size_t>(std::min(bins - 1.0, (mu + 1.0) * 0.5 * bins))] += 1.0;
        }
        double total = 0.0;
        for (const double c : counts) total += c;
        for (int b = 0; b < bins; ++b)
            for (int s = 0; s < 1000; ++s) {
                const double mu = -1.0 + 2.0 * (b + (s + 0.5) / 1000.0) / bins;
                expected[static_cast<std::size_t>(b)] +=
                    total * 2.0 * std::numbers::pi * density(mu) * 2.0 / bins / 1000.0;
            }
        CHECK(test::chi_squared_excess(counts, expected) < 4.0);
        CHECK(std::abs(mean / total - g) < 1e-3);
        CHECK(worst < (sizeof(Real) == 4 ? 3e-4 : 1e-11));
    }
}
