// Conductors and GGX (MODEL.md sections 7.6 and 7.7).
#include <doctest/doctest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "cpu_ref/path_tracer/material/scattering.h"
#include "tests/cpu_ref/number_grid.h"
#include "tests/cpu_ref/statistics.h"

using namespace tandem;
using namespace tandem::cpu;
using test::for_grid;

namespace {

constexpr double pi = std::numbers::pi;

template <class Real>
Vec3<Lanes<Real>> splat_of(double x, double y, double z) {
    return {Lanes<Real>(static_cast<Real>(x)), Lanes<Real>(static_cast<Real>(y)), Lanes<Real>(static_cast<Real>(z))};
}

// Integral over the upper hemisphere of visit(direction), by midpoints in height and azimuth; `visit` gives lanes.
template <class Real, class Visit>
double over_hemisphere(int n, Visit visit) {
    double sum = 0.0;
    for_grid<Real>(n, [&](Lanes<Real> a, Lanes<Real> b) {
        const Lanes<Real> z = a, rho = sqrt(Lanes<Real>(Lanes<Real>(Real(1)) - z * z));
        const auto [c, s] = cosine_sine_turns(b);
        const Lanes<Real> value = visit(Vec3<Lanes<Real>>{rho * c, rho * s, z});
        for (int i = 0; i < lane_count<Real>; ++i) sum += static_cast<double>(value[i]);
    });
    return sum * 2.0 * pi / (double(n) * n);
}

}  // namespace

TEST_CASE("a conductor's reflectance has its known values") {
    const auto f = [](double c, double eta, double k) { return conductor_reflectance(c, eta, k); };
    const auto normal = [](double eta, double k) {
        return ((eta - 1) * (eta - 1) + k * k) / ((eta + 1) * (eta + 1) + k * k);
    };
    CHECK(f(1.0, 0.2, 3.9) == doctest::Approx(normal(0.2, 3.9)).epsilon(1e-12));
    CHECK(f(1.0, 1.5, 0.0) == doctest::Approx(0.04).epsilon(1e-12));
    CHECK(f(0.0, 1.1, 2.0) == doctest::Approx(1.0));
    // k = 0 is a dielectric: the formulas of section 7.4.
    const double c = 0.6, ct = std::sqrt(1.0 - 0.64 / 2.25), rs = (c - 1.5 * ct) / (c + 1.5 * ct),
                 rp = (1.5 * c - ct) / (1.5 * c + ct);
    CHECK(f(c, 1.5, 0.0) == doctest::Approx(0.5 * (rs * rs + rp * rp)).epsilon(1e-12));
    // Copper-like at 60 degrees, from (n cos - 1/..) in complex arithmetic.
    const double eta = 0.6, k = 2.6, s2 = 0.75;
    const std::complex<double> n(eta, k), root = std::sqrt(n * n - s2);
    const auto amplitude_s = (0.5 - root) / (0.5 + root), amplitude_p = (n * n * 0.5 - root) / (n * n * 0.5 + root);
    CHECK(f(0.5, eta, k) == doctest::Approx(0.5 * (std::norm(amplitude_s) + std::norm(amplitude_p))).epsilon(1e-12));
}

// Against the same equations in long double. Half a unit's doubt of the terms of t moves the root by that of their sum.
TEST_CASE_TEMPLATE("a conductor's reflectance is right over all indices and angles", Real, float, double) {
    constexpr long double u = sizeof(Real) == 4 ? 0x1p-24L : 0x1p-53L;
    std::vector<double> cosines{0.0, 1e-6, 1e-4, 1e-3, 1.0 - 0x1p-10, 1.0 - 0x1p-24, 1.0};
    for (int i = 1; i < 64; ++i) cosines.push_back(i / 64.0);
    long double worst = 0.0L;
    for (const double index : {1e-3, 0.2, 0.5, 0.9999, 1.0 - 0x1p-24, 1.0, 1.0 + 0x1p-23, 1.0001, 1.01, 1.5, 10.0, 1e3})
        for (const double extinction : {0.0, 1e-10, 1e-7, 1e-3, 0.1, 1.0, 5.0, 1e3})
            for (const double cosine : cosines) {
                const auto eta = static_cast<Real>(index), k = static_cast<Real>(extinction),
                           c = static_cast<Real>(cosine);
                const Real found = conductor_reflectance(c, eta, k);
                const std::complex<long double> n(eta, k), beyond = (n - 1.0L) * (n + 1.0L);
                const long double x = c, s2 = 1.0L - x * x;
                const std::complex<long double> q = std::sqrt(beyond + x * x);
                if (std::norm(x + q) == 0.0L) {
                    CHECK(found == Real(0));
                    continue;
                }
                const long double expected =
                    0.5L * std::norm(beyond / (x + q) / (x + q)) * (1.0L + std::norm((x * q - s2) / (x * q + s2)));
                const long double terms = std::abs(n - 1.0L) * std::abs(n + 1.0L) + x * x;
                const long double bound =
                    u * expected * (32.0L + 4.0L * terms / std::norm(q)) + 4.0L * std::numeric_limits<Real>::min();
                worst = std::max(worst, std::abs(static_cast<long double>(found) - expected) / bound);
                if (!(found >= Real(0)) || !(found <= Real(1))) MESSAGE(eta << " " << k << " " << c << ": " << found);
                CHECK(found >= Real(0));
                CHECK(found <= Real(1));
            }
    CHECK(worst <= 1.0L);
}

TEST_CASE_TEMPLATE("the distribution of normals has projected area 1", Real, float, double) {
    for (const double alpha : {0.1, 0.3, 1.0}) {
        const double area = over_hemisphere<Real>(
            1024, [&](auto h) { return ggx_distribution(h, Lanes<Real>(static_cast<Real>(alpha))) * h.z; });
        CHECK(area == doctest::Approx(1.0).epsilon(2e-3));
    }
}

TEST_CASE_TEMPLATE("GGX directions are distributed as their density, and weigh as its f cos", Real, float, double) {
    using V = Lanes<Real>;
    constexpr int n = 256, heights = 12, sectors = 16;
    for (const double roughness : {0.35, 0.7, 1.0})
        for (const double sine : {0.0, 0.6, 0.95}) {
            CAPTURE(roughness);
            CAPTURE(sine);
            const V alpha(static_cast<Real>(roughness * roughness));
            const Vec3<V> normal = splat_of<Real>(0, 0, 1), d = splat_of<Real>(-sine, 0, -std::sqrt(1 - sine * sine));
            std::vector<double> counts(heights * sectors + 1, 0.0), expected(heights * sectors + 1, 0.0);
            const auto bin = [](double x, double y, double z) {
                const double turn = std::atan2(y, x) / (2 * pi) + 0.5;
                const auto row = static_cast<std::size_t>(std::min(heights - 1.0, z * heights));
                return row * sectors + static_cast<std::size_t>(std::min(sectors - 1.0, turn * sectors));
            };
            double weight = 0.0, worst = 0.0;
            const Frame<V> frame = frame_about(normal);
            const Vec3<V> i = frame.to_local(-d);
            for_grid<Real>(n, [&](V a, V b) {
                const auto sampled = scatter_conductor(d, normal, alpha, {a, b, a, a});
                const Vec3<V> o = frame.to_local(sampled.direction);
                const auto reflection = ggx_reflection(i, o, alpha);
                for (int l = 0; l < lane_count<Real>; ++l) {
                    if (((sampled.alive.to_bits() >> l) & 1u) == 0) {
                        counts.back() += 1.0;
                        continue;
                    }
                    counts[bin(
                        static_cast<double>(o.x[l]), static_cast<double>(o.y[l]), static_cast<double>(o.z[l]))] += 1.0;
                    weight += static_cast<double>(sampled.weight[l]);
                    const double ratio =
                        static_cast<double>(reflection.transfer[l]) / static_cast<double>(reflection.density[l]);
                    worst = std::max(worst, std::abs(ratio / static_cast<double>(sampled.weight[l]) - 1.0));
                }
            });
            double inside = 0.0;
            over_hemisphere<Real>(1024, [&](auto o) {
                const auto density = ggx_reflection(i, o, alpha).density;
                for (int l = 0; l < lane_count<Real>; ++l) {
                    const double share = static_cast<double>(density[l]) * 2 * pi / (1024.0 * 1024.0);
                    inside += share;
                    expected[bin(static_cast<double>(o.x[l]), static_cast<double>(o.y[l]),
                        static_cast<double>(o.z[l]))] += share * n * n;
                }
                return density;
            });
            expected.back() = std::max(0.0, 1.0 - inside) * n * n;
            CHECK(test::chi_squared_excess(counts, expected) < 4.0);
            CHECK(worst < (sizeof(Real) == 4 ? 1e-4 : 1e-9));
            // Albedo of a white conductor: the mean weight is the integral of f cos.
            const double albedo =
                over_hemisphere<Real>(1024, [&](auto o) { return ggx_reflection(i, o, alpha).transfer; });
            CHECK(weight / (double(n) * n) == doctest::Approx(albedo).epsilon(4e-3));
            CHECK(albedo <= 1.0 + 2e-3);
        }
}

TEST_CASE_TEMPLATE("smooth enough glass refracts about the normal as Snell says, and weighs 1", Real, float, double) {
    using V = Lanes<Real>;
    const V alpha(Real(1e-4)), eta(static_cast<Real>(1.0 / 1.5));
    const Vec3<V> normal = splat_of<Real>(0, 0, 1), d = splat_of<Real>(0.6, 0, -0.8);
    for (const bool reflected : {false, true}) {
        const V number(static_cast<Real>(reflected ? 0.0 : 0.999));
        const auto out = scatter_rough_translucent(
            d, normal, alpha, eta, Mask<Real>{}, {V(Real(0.3)), V(Real(0.4)), number, number});
        CHECK((out.alive.to_bits() & 1u) == 1u);
        CHECK(static_cast<double>(out.direction.x[0]) == doctest::Approx(reflected ? 0.6 : 0.4).epsilon(2e-3));
        CHECK((static_cast<double>(out.direction.z[0]) > 0) == reflected);
        CHECK(static_cast<double>(out.weight[0]) == doctest::Approx(1.0).epsilon(1e-4));
    }
}

TEST_CASE("grazing directions on a rough conductor give finite numbers") {
    using V = Lanes<float>;
    for (const float z : {0.0f, 1e-30f, 1e-6f})
        for (const float u : {0.0f, 0.5f, 1.0f - 0x1p-24f}) {
            const Vec3<V> d{V(std::sqrt(1.0f - z * z)), V(0.0f), V(-z)}, normal{V(0.0f), V(0.0f), V(1.0f)};
            const auto out = scatter_conductor(d, normal, V(0.0009f), {V(u), V(u), V(u), V(u)});
            CHECK(std::isfinite(out.weight[0]));
            CHECK(std::isfinite(out.density[0]));
            CHECK(std::isfinite(out.direction.x[0]));
        }
}
