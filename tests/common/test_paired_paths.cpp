// The level that compares samples, not means: two sides that draw the same numbers must take the same short paths.
#include <doctest/doctest.h>

#include <cmath>

#include "common/scene/loader/scene_loader.h"
#include "common/statistics/distributions.h"
#include "common/validation/verdict/paired.h"
#include "common/validation/verify/verify.h"
#include "tests/common/synthetic_renderer.h"

using namespace tandem;

namespace {

constexpr double rounding = 1e-6;

Radiance noise(std::uint32_t, std::uint32_t, SampleRandom& random) {
    const double value = random.exponential();
    return {value, 0.5 * value, 0.0};
}

Estimate estimate_of(const Sampler& sampler, std::uint64_t seed) {
    RenderSettings settings;
    settings.width = settings.height = 32;
    settings.seed = seed;
    return SyntheticJob(settings, sampler).render({0, 64}, {}).estimate;
}

}  // namespace

TEST_CASE("the tail of a binomial distribution") {
    CHECK(binomial_upper_tail(0, 10, 0.3) == 1.0);
    CHECK(binomial_upper_tail(10, 10, 0.5) == doctest::Approx(std::pow(0.5, 10)));
    CHECK(binomial_upper_tail(2, 3, 0.25) == doctest::Approx(3 * 0.0625 * 0.75 + 0.015625));
    CHECK(binomial_upper_tail(11, 10, 0.5) == 0.0);
}

TEST_CASE("the same numbers give the same samples, others do not") {
    const Estimate reference = estimate_of(noise, 1);
    CHECK(compare_paths(reference, estimate_of(noise, 1), rounding).p == 1.0);
    CHECK(compare_paths(reference, estimate_of(noise, 2), rounding).p < 1e-50);
}

TEST_CASE("a tile with other numbers is found, a brighter image is left to the other levels") {
    const Estimate reference = estimate_of(noise, 1);
    const auto other_numbers_in_a_tile = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        if (x >= 16 && y < 16) random.uniform();
        return noise(x, y, random);
    };
    const LevelResult level = compare_paths(reference, estimate_of(other_numbers_in_a_tile, 1), rounding);
    CHECK(level.p < 1e-50);
    CHECK(level.worst.region.x0 == 16);
    CHECK(level.worst.region.y0 == 0);
    const auto brighter = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        Radiance value = noise(x, y, random);
        for (double& channel : value) channel *= 1.01;
        return value;
    };
    CHECK(compare_paths(reference, estimate_of(brighter, 1), rounding).p == 1.0);
}

TEST_CASE("a few parted paths and constant pixels are no fault") {
    const auto seldom_other = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        const Radiance value = noise(x, y, random);
        return random.uniform() < 1e-3 ? noise(x, y, random) : value;
    };
    CHECK(compare_paths(estimate_of(noise, 1), estimate_of(seldom_other, 1), rounding).p > 0.5);
    const auto constant = [](double value) {
        return [value](std::uint32_t, std::uint32_t, SampleRandom&) { return Radiance{value, value, value}; };
    };
    CHECK(compare_paths(estimate_of(constant(1.0), 1), estimate_of(constant(2.0), 1), rounding).p == 1.0);
}

TEST_CASE("paths may part where faces coincide, and nowhere else") {
    const auto other_numbers = [](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
        random.uniform();
        return noise(x, y, random);
    };
    for (const auto& [name, may_part] : {std::pair{"hard/media-on-floor.json", true}, {"glass.json", false}}) {
        CAPTURE(name);
        const Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / name);
        SyntheticRenderer a(noise, "cpu", Strays{}), b(other_numbers, "vulkan", Strays{});
        VerifyOptions options;
        RenderSettings settings;
        settings.width = settings.height = 32;
        options.settings = settings;
        options.max_samples = 4096;
        const SceneVerdict verdict = verify_scene(scene, a, b, options);
        CHECK(verdict.paired.done);
        CHECK(verdict.paired.paths.has_value() != may_part);
        CHECK((verdict.verdict == Verdict::disagree) != may_part);
    }
}
