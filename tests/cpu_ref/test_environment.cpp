// The background as an image and as a light (MODEL.md sections 8.1 and 8.2).
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "common/render/random.h"
#include "cpu_ref/path_tracer/light/distant_lights.h"
#include "cpu_ref/path_tracer/light/environment.h"
#include "tests/cpu_ref/statistics.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::cpu;
using glm::dvec3;

namespace {

constexpr double pi = std::numbers::pi;

// A dim sky with a small bright patch.
Background sky(double rotation_degrees = 0.0) {
    auto image = std::make_shared<Pixels>(Pixels{16, 8, {}});
    for (std::uint32_t i = 0; i < 16 * 8; ++i) {
        const float value = i == 2 * 16 + 5 ? 40.0f : i % 7 == 0 ? 0.0f : 0.1f * static_cast<float>(i % 5);
        for (const float tint : {1.0f, 0.5f, 0.25f}) image->rgb.push_back(value * tint);
    }
    Background background;
    background.image = image;
    background.image_scale = 2.0;
    background.rotation_degrees = rotation_degrees;
    background.sampled = true;
    return background;
}

dvec3 direction_of(double height, double turn) {
    const double rho = std::sqrt(1.0 - height * height);
    return {rho * std::cos(2 * pi * turn), height, rho * std::sin(2 * pi * turn)};
}

std::size_t bin_of(const dvec3& d) {
    const double turn = std::atan2(d.z, d.x) / (2 * pi) + 0.5;
    return static_cast<std::size_t>(std::min(11.0, (d.y + 1) * 6)) * 24 +
           static_cast<std::size_t>(std::min(23.0, turn * 24));
}

}  // namespace

TEST_CASE("an image shows at the directions that section 8.1 says, and turns counter-clockwise") {
    auto image = std::make_shared<Pixels>(Pixels{4, 2, {}});
    for (int i = 0; i < 8; ++i) image->rgb.insert(image->rgb.end(), 3, static_cast<float>(i));
    Background background;
    background.image = image;
    // Texel (2, 0): u = 5/8, v = 3/4, so azimuth 45 degrees from +x to -z, and 45 degrees up.
    const double c = std::sqrt(0.5);
    CHECK(ImageEnvironment(background).radiance({c * c, c, -c * c}).x == doctest::Approx(2.0).epsilon(1e-12));
    CHECK(ImageEnvironment(background).radiance({c * c, -c, -c * c}).x == doctest::Approx(6.0).epsilon(1e-12));
    background.rotation_degrees = 90.0;  // +x goes to -z, -z to -x
    CHECK(ImageEnvironment(background).radiance({-c * c, c, -c * c}).x == doctest::Approx(2.0).epsilon(1e-12));
    background.image_scale = 3.0;
    CHECK(ImageEnvironment(background).radiance({-c * c, c, -c * c}).x == doctest::Approx(6.0).epsilon(1e-12));
}

TEST_CASE("image sampling: densities integrate to 1, reach all light, and are those of the samples") {
    for (const double rotation : {0.0, 77.0}) {
        const ImageEnvironment environment(sky(rotation));
        constexpr int n = 1200;
        std::vector<double> expected(12 * 24, 0.0), counts(12 * 24, 0.0);
        double total = 0.0, light = 0.0;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) {
                const dvec3 d = direction_of((i + 0.5) / n * 2 - 1, (j + 0.5) / n);
                const double share = environment.density(d) * 4 * pi / (double(n) * n);
                total += share;
                expected[bin_of(d)] += share * 40000;
                const double radiance = environment.radiance(d).x;
                light += radiance * 4 * pi / (double(n) * n);
                if (radiance > 1e-9) REQUIRE(share > 0.0);
            }
        CHECK(total == doctest::Approx(1.0).epsilon(2e-3));
        double estimate = 0.0, squares = 0.0, mismatch = 0.0;
        for (std::uint32_t i = 0; i < 40000; ++i) {
            const RandomBlock words = random_block(9, i, 0, 0);
            const auto sample = environment.sample(to_unit<double>(words[0]), to_unit<double>(words[1]));
            CHECK(glm::length(sample.direction) == doctest::Approx(1.0).epsilon(1e-12));
            counts[bin_of(sample.direction)] += 1.0;
            mismatch += std::abs(environment.density(sample.direction) / sample.density - 1.0) > 1e-9 ? 1.0 : 0.0;
            const double value = environment.radiance(sample.direction).x / sample.density;
            estimate += value / 40000;
            squares += value * value / 40000;
        }
        CHECK(mismatch <= 2.0);  // a sample on a cell's border may count as its neighbour's
        CHECK(test::chi_squared_excess(counts, expected) < 4.5);
        const double error = std::sqrt((squares - estimate * estimate) / 40000);
        CHECK(std::abs(estimate - light) <= 5.0 * error + 1e-3 * light);
        CHECK(error < 0.02 * light);  // against 0.2 with uniform directions
    }
}

TEST_CASE_TEMPLATE("the mix of two colours is sampled by its density", Real, float, double) {
    using V = Lanes<Real>;
    for (const auto& [down, up] :
        {std::array{0.2, 3.0}, std::array{1.0, 1.0}, std::array{2.0, 0.0}, std::array{0.0, 1.0}}) {
        CAPTURE(down);
        CAPTURE(up);
        test::SceneBuilder builder;
        builder.background(dvec3(down), dvec3(up));
        Scene scene = builder.scene();
        scene.background.sampled = true;
        const auto tables = make_tables<Real>(scene, {});
        REQUIRE(tables.lights.count == 1);
        CHECK(tables.lights.background_chance == Real(1));
        std::vector<double> counts(20, 0.0), expected(20, 0.0);
        double worst = 0.0;
        constexpr int n = 4000;
        for (int i = 0; i < n; ++i) {
            const V v1(static_cast<Real>((i + 0.5) / n)), v2(static_cast<Real>(0.37));
            LitSample<Real> sample{};
            sample_background(tables, Mask<Real>::from_bits(~0u), v1, v2, sample);
            const double y = std::clamp(static_cast<double>(sample.direction.y[0]), -1.0, 1.0);
            counts[static_cast<std::size_t>(std::min(19.0, (y + 1) * 10))] += 1.0;
            const auto back = background_density(tables, sample.direction, Mask<Real>::from_bits(~0u));
            worst =
                std::max(worst, std::abs(static_cast<double>(back[0]) / static_cast<double>(sample.density[0]) - 1.0));
        }
        for (std::size_t b = 0; b < 20; ++b) {
            const double a = (static_cast<double>(b) + 0.5) / 20.0;
            expected[b] = n * (down + (up - down) * a) / (down + up) / 20.0 * 2.0;
        }
        CHECK(test::chi_squared_excess(counts, expected) < 4.0);
        CHECK(worst < (sizeof(Real) == 4 ? 1e-3 : 1e-8));
    }
}
