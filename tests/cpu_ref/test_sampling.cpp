// The numbers and shapes of MODEL.md section 3, in lanes of both precisions.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "cpu_ref/path_tracer/arithmetic/sampling.h"
#include "tests/cpu_ref/number_grid.h"

using namespace tandem;
using namespace tandem::cpu;
using test::for_grid;

namespace {

template <class Real>
constexpr double roundoff = sizeof(Real) == 4 ? 0x1p-24 : 0x1p-53;

template <class Real>
Vec3<double> lane(const Vec3<Lanes<Real>>& a, int i) {
    return {static_cast<double>(a.x[i]), static_cast<double>(a.y[i]), static_cast<double>(a.z[i])};
}

}  // namespace

TEST_CASE_TEMPLATE("the lanes' random numbers are those of the common generator", Real, float, double) {
    using U = UnsignedOf<Real>;
    const std::uint64_t seed = 0xFEDCBA9876543210ull;
    SampleId<Real> id;
    Ints<Real> block;
    for (int i = 0; i < lane_count<Real>; ++i) {
        id.pixel.v[i] = static_cast<std::uint32_t>(0x9E3779B9u * static_cast<unsigned>(i + 1));
        id.sample_low.v[i] = static_cast<std::uint32_t>(0xFFFFFFFFu - 3u * static_cast<unsigned>(i));
        id.sample_high.v[i] = static_cast<U>(i / 2);
        block.v[i] = static_cast<U>(4 + 5 * i);
    }
    const RandomLanes<Real> numbers = random_numbers(seed, id, block);
    for (int i = 0; i < lane_count<Real>; ++i) {
        const std::uint64_t sample = (std::uint64_t{id.sample_high.v[i]} << 32) | id.sample_low.v[i];
        const RandomBlock expected = random_block(
            seed, static_cast<std::uint32_t>(id.pixel.v[i]), sample, static_cast<std::uint32_t>(block.v[i]));
        for (std::size_t k = 0; k < 4; ++k) CHECK(numbers[k][i] == to_unit<Real>(expected[k]));
    }
}

TEST_CASE_TEMPLATE("the lanes' numbers of every other generator are the common ones too", Real, float, double) {
    RenderSettings settings;
    settings.seed = 0xFEDCBA9876543210ull;
    for (const Generator generator : {Generator::hash, Generator::sobol})
        for (const std::uint32_t block : {0u, 1u, 4u, 5u, 6u, 9u, 401u}) {
            settings.generator = generator;
            SampleId<Real> id;
            for (int i = 0; i < lane_count<Real>; ++i) {
                id.pixel.v[i] = static_cast<std::uint32_t>(0x9E3779B9u * static_cast<unsigned>(i + 1));
                id.sample_low.v[i] = static_cast<std::uint32_t>(0xFFFFFFFFu - 3u * static_cast<unsigned>(i));
                id.sample_high.v[i] = static_cast<UnsignedOf<Real>>(i / 2);
            }
            // An idle lane's block has another kind of pairs.
            Ints<Real> blocks(static_cast<UnsignedOf<Real>>(block));
            blocks.v[0] = 1;
            const RandomLanes<Real> numbers = random_numbers<Real>(settings, id, blocks);
            for (int i = 0; i < lane_count<Real>; ++i) {
                const std::uint64_t sample = (std::uint64_t{id.sample_high.v[i]} << 32) | id.sample_low.v[i];
                const RandomBlock expected = random_block(generator, settings.seed,
                    static_cast<std::uint32_t>(id.pixel.v[i]), sample, static_cast<std::uint32_t>(blocks.v[i]));
                for (std::size_t k = 0; k < 4; ++k) CHECK(numbers[k][i] == to_unit<Real>(expected[k]));
            }
        }
}

TEST_CASE_TEMPLATE("sine and cosine are within 2 ulp of 1", Real, float, double) {
    double worst = 0.0;
    // Every 37th of the 2^24 numbers there are.
    for (std::uint32_t first = 0; first < (1u << 24) - 37u * 16u;
         first += 37u * static_cast<unsigned>(lane_count<Real>)) {
        Lanes<Real> u;
        for (int i = 0; i < lane_count<Real>; ++i)
            u.v[i] = to_unit<Real>((first + 37u * static_cast<unsigned>(i)) << 8);
        const auto [cosine, sine] = cosine_sine_turns(u);
        for (int i = 0; i < lane_count<Real>; ++i) {
            const long double angle = 2.0L * std::numbers::pi_v<long double> * static_cast<long double>(u[i]);
            worst =
                std::max(worst, static_cast<double>(std::abs(static_cast<long double>(cosine[i]) - std::cos(angle))));
            worst = std::max(worst, static_cast<double>(std::abs(static_cast<long double>(sine[i]) - std::sin(angle))));
        }
    }
    CHECK(worst <= 2.0 * 2.0 * roundoff<Real>);
}

TEST_CASE_TEMPLATE("quarter turns are exact", Real, float, double) {
    Lanes<Real> u(Real(0));
    for (int i = 0; i < 4; ++i) u.v[i % lane_count<Real>] = static_cast<Real>(i) * Real(0.25);
    const auto [cosine, sine] = cosine_sine_turns(u);
    const std::array<Real, 4> expected{1, 0, -1, 0};
    for (int i = 0; i < std::min(4, lane_count<Real>); ++i) {
        CHECK(cosine[i] == expected[static_cast<std::size_t>(i)]);
        CHECK(sine[i] == expected[static_cast<std::size_t>((i + 3) % 4)]);
    }
}

TEST_CASE_TEMPLATE("the disc has uniform area and polar angles", Real, float, double) {
    double sum_of_squares = 0.0, sum_x = 0.0, count = 0.0;
    for_grid<Real>(64, [&](auto a, auto b) {
        const auto [x, y] = sample_disc(a, b);
        for (int i = 0; i < lane_count<Real>; ++i) {
            const double dx = static_cast<double>(x[i]), dy = static_cast<double>(y[i]);
            // The radius is the square root of a.
            CHECK(dx * dx + dy * dy == doctest::Approx(static_cast<double>(a[i])).epsilon(20.0 * roundoff<Real>));
            sum_of_squares += dx * dx + dy * dy;
            sum_x += dx;
            count += 1.0;
        }
    });
    CHECK(sum_of_squares / count == doctest::Approx(0.5).epsilon(1e-6));  // E r^2; the grid of a is exact in the mean
    CHECK(std::abs(sum_x / count) < 1e-6);                                // the grid of angles is symmetric
}

TEST_CASE_TEMPLATE(
    "the sphere has unit points whose mean is the centre and whose z^2 averages 1/3", Real, float, double) {
    Vec3<double> sum{};
    double square_z = 0.0, count = 0.0;
    for_grid<Real>(64, [&](auto a, auto b) {
        const auto points = sample_sphere(a, b);
        for (int i = 0; i < lane_count<Real>; ++i) {
            const Vec3<double> p = lane(points, i);
            CHECK(std::abs(dot(p, p) - 1.0) < 16.0 * roundoff<Real>);
            sum = sum + p;
            square_z += p.z * p.z;
            count += 1.0;
        }
    });
    CHECK(std::sqrt(dot(sum, sum)) / count < 1e-6);
    // The midpoint rule for the mean of (1 - 2a)^2 is off by 4/12 n^-2.
    CHECK(square_z / count == doctest::Approx(1.0 / 3.0 - 1.0 / (3.0 * 64 * 64)).epsilon(1e-6));
}

TEST_CASE_TEMPLATE("the cosine hemisphere has unit points with cos^2 = 1 - a", Real, float, double) {
    for_grid<Real>(32, [&](auto a, auto b) {
        const auto points = sample_cosine_hemisphere(a, b);
        for (int i = 0; i < lane_count<Real>; ++i) {
            const Vec3<double> p = lane(points, i);
            CHECK(std::abs(dot(p, p) - 1.0) < 16.0 * roundoff<Real>);
            CHECK(p.z * p.z == doctest::Approx(1.0 - static_cast<double>(a[i])).epsilon(8.0 * roundoff<Real>));
        }
    });
    const auto grazing = sample_cosine_hemisphere(Lanes<Real>(static_cast<Real>(1.0 - 0x1p-24)), Lanes<Real>(Real(0)));
    CHECK(grazing.z[0] == static_cast<Real>(0x1p-12));
}

TEST_CASE_TEMPLATE("triangle weights are inside and average to the centroid", Real, float, double) {
    double first = 0.0, second = 0.0, count = 0.0;
    for_grid<Real>(64, [&](auto a, auto b) {
        const auto [w1, w2] = sample_triangle(a, b);
        for (int i = 0; i < lane_count<Real>; ++i) {
            const double x = static_cast<double>(w1[i]), y = static_cast<double>(w2[i]);
            CHECK((x >= 0.0 && y >= 0.0 && x + y <= 1.0));
            first += x;
            second += y;
            count += 1.0;
        }
    });
    // The midpoint rule for the mean of sqrt(a) is within 0.1 n^-1.5 of 2/3.
    CHECK(first / count == doctest::Approx(1.0 / 3.0).epsilon(1e-3));
    CHECK(second / count == doctest::Approx(1.0 / 3.0).epsilon(1e-3));
}

TEST_CASE_TEMPLATE("frames are right-handed and orthonormal, also at the poles and on the seam", Real, float, double) {
    const Real half = static_cast<Real>(std::sqrt(0.5));
    const std::vector<Vec3<Real>> normals{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {1, 0, Real(-0.0)}, {0, -1, Real(-0.0)},
        {half, half, 0}, {Real(0.6), 0, Real(-0.8)}, {0, static_cast<Real>(1e-6), Real(-1)}};
    for (const Vec3<Real>& normal : normals) {
        const Frame<Lanes<Real>> frame = frame_about(splat<Lanes<Real>>(normal));
        const Vec3<double> t = lane(frame.tangent, 0), s = lane(frame.bitangent, 0), n = lane(frame.normal, 0);
        const double tolerance = 16.0 * roundoff<Real>;
        CHECK(std::abs(dot(t, t) - 1.0) < tolerance);
        CHECK(std::abs(dot(s, s) - 1.0) < tolerance);
        CHECK(std::abs(dot(t, s)) < tolerance);
        CHECK(std::abs(dot(t, n)) < tolerance);
        CHECK(std::abs(dot(s, n)) < tolerance);
        CHECK(dot(cross(t, s), n) > 0.5);
    }
}

TEST_CASE_TEMPLATE("minus zero counts as plus zero in the frame's sign", Real, float, double) {
    const Frame<Lanes<Real>> plus = frame_about(splat<Lanes<Real>>(Vec3<Real>{1, 0, 0}));
    const Frame<Lanes<Real>> minus = frame_about(splat<Lanes<Real>>(Vec3<Real>{1, 0, Real(-0.0)}));
    CHECK(plus.tangent.z[0] == minus.tangent.z[0]);
    CHECK(plus.bitangent.y[0] == minus.bitangent.y[0]);
}
