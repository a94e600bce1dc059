#include <doctest/doctest.h>

#include <cmath>

#include "common/validation/verify/convergence.h"
#include "tests/common/synthetic_renderer.h"

namespace tandem {
namespace {

// Noise of variance 1 about `level`, off by `bias` in every other column.
Sampler noise(double bias) {
    return [=](std::uint32_t x, std::uint32_t, SampleRandom& random) {
        const double value = 4.0 + random.triangular() + (x % 2 == 0 ? bias : -bias);
        return Radiance{value, value, value};
    };
}

// A sample of a pixel takes 50 ns of the budget, on whatever machine: there is time for four values of n.
ConvergenceReport measure(const Sampler& reference, const Sampler& candidate) {
    std::uint64_t drawn = 0;
    const auto counted = [&](const Sampler& sampler) {
        return [&drawn, sampler](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
            ++drawn;
            return sampler(x, y, random);
        };
    };
    SyntheticRenderer a(counted(reference)), b(counted(candidate));
    RenderSettings settings;
    settings.width = settings.height = 16;
    ConvergenceOptions options;
    options.budget_seconds = 0.5;
    options.now = [&drawn] { return 50e-9 * static_cast<double>(drawn); };
    const auto report = measure_convergence(Scene{}, settings, a, b, options);
    REQUIRE(report.has_value());
    return *report;
}

// Three times the 95 % interval.
bool holds(const Estimated& figure, double truth) {
    return std::abs(truth - figure.value) <= 3.0 * (figure.high - figure.value);
}

TEST_CASE("convergence: without bias the error falls as the root of the samples") {
    const ConvergenceReport report = measure(noise(0.0), noise(0.0));
    REQUIRE(report.samples.size() == 4);
    for (const ConvergenceSide* side : {&report.reference, &report.candidate}) {
        CHECK(holds(side->slope, -0.5));
        CHECK(holds(side->variance_ratio, 1.0));
        CHECK(holds(side->squared_bias, 0.0));
        // The variance of one sample is 1, of the image's mean squared 16.
        for (std::size_t i = 0; i < report.samples.size(); ++i)
            CHECK(side->squared_errors[i].value ==
                  doctest::Approx(1.0 / 16.0 / static_cast<double>(report.samples[i])).epsilon(0.15));
    }
    for (const Estimated& ratio : report.between) CHECK(ratio.value == doctest::Approx(1.0).epsilon(0.1));
}

TEST_CASE("convergence: a local bias that leaves every mean as it is shows as a floor of its size") {
    const double bias = 0.1;
    const ConvergenceReport report = measure(noise(0.0), noise(bias));
    CHECK(report.candidate.squared_bias.low > 0.0);
    CHECK(holds(report.candidate.squared_bias, bias * bias / 16.0));
    CHECK(report.candidate.slope.low > -0.5);
    CHECK(holds(report.reference.squared_bias, 0.0));
    const double n = static_cast<double>(report.samples.back());
    CHECK(report.between.back().value == doctest::Approx(1.0 + n * bias * bias / 2.0).epsilon(0.1));
}

TEST_CASE("convergence: rare bright samples neither bend the slope nor escape the intervals") {
    // One sample in 2000 is 500 times as bright: in a pixel, most blocks of 64 have none.
    const Sampler rare = [](std::uint32_t, std::uint32_t, SampleRandom& random) {
        const double value = random.uniform() < 5e-4 ? 500.0 : 1.0;
        return Radiance{value, value, value};
    };
    const ConvergenceReport report = measure(rare, rare);
    for (const ConvergenceSide* side : {&report.reference, &report.candidate}) {
        CHECK(holds(side->slope, -0.5));
        CHECK(side->slope.value == doctest::Approx(-0.5).epsilon(0.1));
        CHECK(holds(side->variance_ratio, 1.0));
        CHECK(holds(side->squared_bias, 0.0));
    }
    for (const Estimated& ratio : report.between) CHECK(holds(ratio, 1.0));
}

TEST_CASE("convergence: a black image and a stop give no report") {
    SyntheticRenderer black([](std::uint32_t, std::uint32_t, SampleRandom&) { return Radiance{}; });
    RenderSettings settings;
    settings.width = settings.height = 8;
    ConvergenceOptions options;
    options.budget_seconds = 0.5;
    CHECK_FALSE(measure_convergence(Scene{}, settings, black, black, options).has_value());
    SyntheticRenderer grey(noise(0.0));
    std::stop_source stop;
    stop.request_stop();
    options.stop = stop.get_token();
    CHECK_FALSE(measure_convergence(Scene{}, settings, grey, grey, options).has_value());
}

}  // namespace
}  // namespace tandem
