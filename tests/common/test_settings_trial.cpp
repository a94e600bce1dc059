// What trials forecast of one another, from figures that are known.
#include <doctest/doctest.h>

#include <cmath>
#include <utility>

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

constexpr double many = 1e9;  // points: no error is forecast beyond them

TEST_CASE("Sobol points gain by their first ones, and little by those after them") {
    for (const double points : {4.0, 16.0, 128.0}) {
        CAPTURE(points);
        const ShortTrial trial = trial_with(1.0, 0.5, 1.0, points);
        const double early = std::max(points, 32.0), there = std::pow(early, -1.5);
        CHECK(trial.error_of(0.5 * early) == doctest::Approx(std::pow(0.5 * early, -1.5)));
        CHECK(trial.error_of(100.0 * early) == doctest::Approx(there * std::pow(100.0, -1.05)));
        for (const double some : {0.5 * early, early, 100.0 * early})
            CHECK(trial.samples_to(std::sqrt(0.5 * trial.error_of(some))) == doctest::Approx(2.0 * some).epsilon(1e-5));
    }
    // What they gain less than that late they gain everywhere.
    CHECK(trial_with(1.0, 0.02, 1.0, 4.0).error_of(1e4) == doctest::Approx(std::pow(1e4, -1.02)));
}

TEST_CASE("how far a forecast may be off grows with how far it goes on") {
    ShortTrial trial = trial_with(1.0, 0.5, 1.0, 16.0);
    trial.uncertainty = 0.1;
    double before = 0.0;
    for (const double points : {16.0, 32.0, 64.0, 1e4, 1e8}) {
        CAPTURE(points);
        const double now = trial.uncertainty_at(std::sqrt(0.5 * trial.error_of(points)));
        CHECK(now > before);
        before = now;
    }
    // A relative error of a tenth, and as much of the gain as its logarithm over that of the points.
    CHECK(trial.uncertainty_at(std::sqrt(0.5 * trial.error_of(32.0))) ==
          doctest::Approx(0.1 * (1.0 + std::log(2.0) / std::log(16.0)) / 1.05));
}

TEST_CASE("what it takes to foretell adaptive sampling is known before, and nothing once it is foretold") {
    const auto pilot_of = [](std::uint32_t width) {
        Estimate samples(width, 32);
        samples.add_block({0, 8}, Estimate::Plane(samples.pixel_count() * channel_count, {8.0, 9.0}));
        return Pilot(std::move(samples));
    };
    Pilot pilot = pilot_of(64);
    const double seconds = pilot.seconds_to_foretell();
    CHECK(seconds > 1e-5);
    CHECK(seconds < 1e-2);
    CHECK(pilot_of(128).seconds_to_foretell() == doctest::Approx(2.0 * seconds));
    CHECK(pilot.foretold() != nullptr);
    CHECK(pilot.seconds_to_foretell() == 0.0);
}

TEST_CASE("roulette that a scene has is held against none, as none is held against it") {
    const ShortTrial without = trial_with(1.0, 1.0, 1.0, many), with = trial_with(1.5, 0.7, 0.6, many);
    const ShortTrial known = with_roulette(with, without);
    CHECK(known.added == doctest::Approx(0.5));
    CHECK(known.seconds_to(0.001) > without.seconds_to(0.001));
    CHECK(compare_trials(without, known, 0.001).seconds == doctest::Approx(without.seconds_to(0.001)));
    // One more, which adds no noise to what the first does: it falls as that one.
    const ShortTrial third = with_roulette(trial_with(1.2, 0.9, 0.8, many), known);
    CHECK(third.added == doctest::Approx(0.2));
    CHECK(third.gain == doctest::Approx(1.0));
    CHECK(with_roulette(trial_with(0.9, 0.9, 0.8, many), known).added == doctest::Approx(0.0));
}

TEST_CASE("roulette of independent samples costs as much more as its noise and its time are") {
    const ShortTrial best = trial_with(1.0, 0.0, 1.0, 0.0), roulette = trial_with(1.5, 0.0, 0.6, 0.0);
    CHECK(compare_trials(with_roulette(roulette, best), best, 0.01).seconds == doctest::Approx(0.9 * 1e4));
}

TEST_CASE("noise that roulette adds is not averaged better by Sobol points") {
    // 1 / p^2 + 1/2 / p is twice the squared error of each scrambling's p points: a quadratic equation.
    const ShortTrial best = trial_with(1.0, 1.0, 1.0, many), roulette = trial_with(1.5, 1.0, 0.6, many);
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
    const ShortTrial best = trial_with(1.0, 1.0, 1.0, many);
    const ShortTrial late = with_roulette(trial_with(1.2, 0.4, 0.8, many), best);
    const ShortTrial early = with_roulette(trial_with(1.5, 0.3, 0.6, many), late);
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
