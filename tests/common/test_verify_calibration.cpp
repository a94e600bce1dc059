// How often equal renderers are called different: the observed rate against the declared one.
#include <doctest/doctest.h>

#include "common/statistics/distributions.h"
#include "common/validation/verify/verify.h"
#include "tests/common/synthetic_renderer.h"

using namespace tandem;

namespace {

// A binomial tail below this speaks against the rate that is claimed: 99.8 % confidence, both sides together.
constexpr double unlikely = 0.001;

SceneVerdict a_against_a(std::uint64_t seed, double false_alarm, std::uint64_t samples) {
    SyntheticRenderer a(mixed, "cpu"), b(mixed, "vulkan");
    Scene scene;
    VerifyOptions options;
    RenderSettings settings;
    settings.width = 24;
    settings.height = 16;
    options.settings = settings;
    options.max_samples = samples;
    options.seed = seed;
    options.paired = false;
    options.criteria.false_alarm = false_alarm;
    options.criteria.margins.image = 1e-6;  // agreement is out of reach: every look is taken
    return verify_scene(scene, a, b, options);
}

}  // namespace

TEST_CASE(
    "600 A/A verdicts raise no more alarms than declared, over all looks and levels" * doctest::test_suite("full")) {
    constexpr unsigned runs = 600;
    constexpr double declared = 0.05;
    unsigned alarms = 0;
    for (unsigned run = 0; run < runs; ++run)
        if (a_against_a(1000 + 2 * run, declared, 512).verdict == Verdict::disagree) ++alarms;
    MESSAGE(alarms << " alarms in " << runs);
    // The procedure is conservative (Holm, Bonferroni over looks), so only an excess is a fault.
    CHECK(binomial_upper_tail(alarms, runs, declared) >= unlikely);
}

TEST_CASE("the level of the image is calibrated: its p is seldom small, but not never") {
    // With one look and no negligible difference, Welch's p of a channel is uniform, and the bound costs it a factor.
    constexpr unsigned runs = 400;
    unsigned below = 0;
    for (unsigned run = 0; run < runs; ++run) {
        const SceneVerdict verdict = a_against_a(5000 + 2 * run, 0.05, 128);
        const RegionComparison& red = verdict.judgement.level("image").regions.front();
        if (red.statistic > 1.6449) ++below;  // two-sided 10 %
    }
    CHECK(binomial_upper_tail(below, runs, 0.1) >= unlikely);
    CHECK(binomial_upper_tail(below + 1, runs, 0.08) <=
          1.0 - unlikely);  // the negligible 1e-4 and the slack of the variances take little
}
