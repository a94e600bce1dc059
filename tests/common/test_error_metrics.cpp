#include <doctest/doctest.h>

#include <cmath>

#include "common/validation/verdict/error_metrics.h"

namespace tandem {
namespace {

SampledImage even(double mean, double variance) {
    SampledImage image;
    image.width = image.height = 20;
    image.pixels.assign(1200, {mean, variance, 64.0});
    return image;
}

TEST_CASE("error metrics: those of even images are known, with the epsilon that they name") {
    const ErrorMetrics m = error_metrics(even(0.5, 0.2), even(0.6, 0.12));
    CHECK(m.mse == doctest::Approx(0.01));
    CHECK(m.rmse == doctest::Approx(0.1));
    CHECK(m.relative_mse == doctest::Approx(0.01 / 0.26));
    CHECK(m.trimmed_relative_mse == doctest::Approx(0.01 / 0.26));
    CHECK(m.noise_mse == doctest::Approx(0.32 / 64.0));
}

TEST_CASE("error metrics: black pixels count by epsilon, and one firefly is trimmed away") {
    SampledImage bright = even(0.0, 0.0);
    bright.pixels[77].mean = 100.0;
    const ErrorMetrics m = error_metrics(even(0.0, 0.0), bright);
    CHECK(m.relative_mse == doctest::Approx(1e4 / 1e-2 / 1200.0));
    CHECK(m.trimmed_relative_mse == 0.0);
    CHECK(error_metrics(bright, bright).mse == 0.0);
}

}  // namespace
}  // namespace tandem
