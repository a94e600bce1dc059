// What trials forecast of one another, from figures that are known.
#include <doctest/doctest.h>

#include <cmath>

#include "common/cost/settings_trial.h"

namespace tandem {
namespace {

// `points`: Sobol points in each of two scramblings; 0: independent samples. `gain`: of the points.
ShortTrial trial_with(double noise, double gain, double seconds_a_sample, double points) {
    ShortTrial trial;
    trial.noise = trial.error_of_one = noise;
    trial.gain = gain;
    trial.seconds_a_sample = seconds_a_sample;
    trial.points = points;
    trial.scramblings = points > 0.0 ? 2 : 1;
    trial.pixels = 4096;
    return trial;
}

TEST_CASE("roulette of independent samples costs as much more as its noise and its time are") {
    const ShortTrial best = trial_with(1.0, 0.0, 1.0, 0.0), roulette = trial_with(1.5, 0.0, 0.6, 0.0);
    CHECK(compare_trials(with_roulette(roulette, best), best, 0.01).seconds == doctest::Approx(0.9 * 1e4));
}

TEST_CASE("noise that roulette adds is not averaged better by Sobol points") {
    // 1 / p^2 + 1/2 / p is twice the squared error of each scrambling's p points: a quadratic equation.
    const ShortTrial best = trial_with(1.0, 1.0, 1.0, 16.0), roulette = trial_with(1.5, 1.0, 0.6, 16.0);
    for (const double error : {0.1, 0.01, 0.001}) {
        CAPTURE(error);
        const double wanted = 2.0 * error * error;
        const double points = (0.5 + std::sqrt(0.25 + 4.0 * wanted)) / (2.0 * wanted);
        const ShortTrial tried = with_roulette(roulette, best);
        const ComparedTrials compared = compare_trials(tried, best, error);
        CHECK(compared.seconds == doctest::Approx(0.6 * 2.0 * points).epsilon(1e-5));
        CHECK(compared.seconds > best.seconds_to(error));
        CHECK(tried.error_of(points) == doctest::Approx(wanted));
    }
}

TEST_CASE("what one roulette adds stays added where another one comes after it") {
    const ShortTrial best = trial_with(1.0, 1.0, 1.0, 16.0);
    const ShortTrial late = with_roulette(trial_with(1.2, 0.4, 0.8, 16.0), best);
    const ShortTrial early = with_roulette(trial_with(1.5, 0.3, 0.6, 16.0), late);
    CHECK(late.added == doctest::Approx(0.2));
    CHECK(early.added == doctest::Approx(0.5));
    CHECK(early.error_of(100.0) == doctest::Approx(1e-4 + 0.5e-2));
    CHECK(early.independent().seconds_to(0.01) == doctest::Approx(0.6 * 1.5e4));
}

TEST_CASE("roulette that adds no noise, or removes some, is compared as any setting is") {
    const ShortTrial best = trial_with(1.0, 0.5, 1.0, 16.0);
    for (const double noise : {1.0, 0.8}) {
        const ShortTrial roulette = trial_with(noise, 0.5, 0.6, 16.0);
        CHECK(compare_trials(with_roulette(roulette, best), best, 0.01).seconds ==
              doctest::Approx(roulette.seconds_to(0.01)));
    }
}

}  // namespace
}  // namespace tandem
