// What trials forecast of one another, from figures that are known.
#include <doctest/doctest.h>

#include <cmath>

#include "common/cost/settings_trial.h"

namespace tandem {
namespace {

// Of so many Sobol points in each of two scramblings; 0: of independent samples. `gain`: of the points.
Trial trial_with(double noise, double gain, double seconds_a_sample, double points) {
    Trial trial;
    trial.noise = trial.error_of_one = noise;
    trial.gain = gain;
    trial.seconds_a_sample = seconds_a_sample;
    trial.points = points;
    trial.scramblings = points > 0.0 ? 2 : 1;
    trial.pixels = 4096;
    return trial;
}

TEST_CASE("roulette of independent samples costs as much more as its noise and its time are") {
    const Trial best = trial_with(1.0, 0.0, 1.0, 0.0), roulette = trial_with(1.5, 0.0, 0.6, 0.0);
    CHECK(compare_roulette(roulette, best, 0.01).seconds == doctest::Approx(0.9 * 1e4));
}

TEST_CASE("noise that roulette adds is not averaged better by Sobol points") {
    // 1 / p^2 + 1/2 / p is twice the squared error of each scrambling's p points: a quadratic equation.
    const Trial best = trial_with(1.0, 1.0, 1.0, 16.0), roulette = trial_with(1.5, 1.0, 0.6, 16.0);
    for (const double error : {0.1, 0.01, 0.001}) {
        CAPTURE(error);
        const double wanted = 2.0 * error * error;
        const double points = (0.5 + std::sqrt(0.25 + 4.0 * wanted)) / (2.0 * wanted);
        const Compared compared = compare_roulette(roulette, best, error);
        CHECK(compared.seconds == doctest::Approx(0.6 * 2.0 * points).epsilon(1e-5));
        CHECK(compared.seconds > best.seconds_to(error));
    }
}

TEST_CASE("roulette that adds no noise, or removes some, is compared as any setting is") {
    const Trial best = trial_with(1.0, 0.5, 1.0, 16.0);
    for (const double noise : {1.0, 0.8}) {
        const Trial roulette = trial_with(noise, 0.5, 0.6, 16.0);
        CHECK(compare_roulette(roulette, best, 0.01).seconds == doctest::Approx(roulette.seconds_to(0.01)));
    }
}

}  // namespace
}  // namespace tandem
