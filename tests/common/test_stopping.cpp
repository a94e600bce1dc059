// Rendering until enough: which of samples, error, time and stop request ends a render.
#include <doctest/doctest.h>

#include "common/stopping.h"
#include "tests/common/synthetic_renderer.h"

using namespace tandem;

namespace {

StoppedRender stopped(const StoppingRule& rule, const Sampler& sampler, std::stop_token stop = {}) {
    RenderSettings settings;
    settings.width = settings.height = 4;
    SyntheticJob job(settings, sampler);
    return render_until(job, rule, stop, {});
}

Radiance noisy(std::uint32_t, std::uint32_t, SampleRandom& random) {
    const double value = random.exponential();
    return {value, value, value};
}
Radiance black(std::uint32_t, std::uint32_t, SampleRandom&) { return {0.0, 0.0, 0.0}; }

}  // namespace

TEST_CASE("a render by samples has just so many") {
    const StoppedRender result = stopped({.samples = 100, .seconds = {}, .relative_error = {}}, noisy);
    CHECK(result.estimate.count() == 100);
    CHECK(result.complete);
}

TEST_CASE("a render by error ends at the samples that the error needs") {
    // The standard deviation is the mean, so 2 % takes 2500 samples; the step overshoots by a quarter and a block at
    // most.
    const StoppedRender result = stopped({.samples = {}, .seconds = {}, .relative_error = 0.02}, noisy);
    CHECK(*result.relative_error <= 0.02);
    CHECK(result.estimate.count() > 2000);
    CHECK(result.estimate.count() < 3800);
    CHECK(result.complete);
}

TEST_CASE("a black image has no relative error, and a render by error gives it up") {
    const StoppedRender result = stopped({.samples = {}, .seconds = {}, .relative_error = 0.02}, black);
    CHECK_FALSE(result.relative_error.has_value());
    CHECK_FALSE(result.complete);
}

TEST_CASE("a black image is rendered to its end where samples are asked for too") {
    const StoppedRender result = stopped({.samples = 5000, .seconds = {}, .relative_error = 0.02}, black);
    CHECK(result.estimate.count() == 5000);
    CHECK(result.complete);
}

TEST_CASE("a stop request ends a render that nothing else would end soon") {
    std::stop_source source;
    std::uint64_t samples = 0;
    const StoppedRender result = stopped(
        {.samples = std::uint64_t{1} << 40, .seconds = {}, .relative_error = {}},
        [&](std::uint32_t x, std::uint32_t y, SampleRandom& random) {
            if (++samples == 1000) source.request_stop();
            return noisy(x, y, random);
        },
        source.get_token());
    CHECK_FALSE(result.complete);
    CHECK(result.estimate.count() > 0);
}

TEST_CASE("a render by time has one sample at least") {
    const StoppedRender result = stopped({.samples = {}, .seconds = 1e-9, .relative_error = {}}, noisy);
    CHECK(result.estimate.count() > 0);
}

TEST_CASE("a render by time ends") {
    const StoppedRender result = stopped({.samples = {}, .seconds = 0.01, .relative_error = {}}, noisy);
    CHECK(result.estimate.count() > 0);
    CHECK(result.complete);
}
