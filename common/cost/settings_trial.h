// A short trial of render settings, and what it forecasts of a render: samples and seconds to an error.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>

#include "common/render/adaptive_sampling.h"
#include "common/render/renderer.h"

namespace tandem {

inline constexpr std::uint64_t trial_begin = std::uint64_t{1} << 62;  // first sample of a trial: no render gets there
inline constexpr std::uint64_t least_points = 16;                     // fewer do not tell how even Sobol points are

// The samples of a trial. What adaptive sampling would make of them is foretold when it is asked for the first time: on
// a fast device that takes longer than the samples.
class Pilot {
public:
    explicit Pilot(Estimate samples) : samples_(std::move(samples)) {}
    [[nodiscard]] const Foretold* foretold();          // null: without noise
    [[nodiscard]] double seconds_to_foretell() const;  // about; 0 once it is done

private:
    std::optional<Estimate> samples_;  // until it is foretold
    std::optional<Foretold> foretold_;
};

// What a trial showed of settings. Errors are squared, and relative to the image's mean. That of n Sobol points falls
// as error_of_one n^-(1 + gain) + added / n, up to early_points.
struct ShortTrial {
    double noise = 0.0;         // error of one independent sample
    double error_of_one = 0.0;  // where errors fall so from there; of independent samples the noise
    double gain = 0.0;
    double added = 0.0;             // part of the noise, by roulette
    double seconds_a_sample = 0.0;  // of all pixels, by the device's clock where there is one
    double seconds_a_call = 0.0;    // beside that: trials are short, so it would seem to grow with their samples
    std::uint64_t pixels = 0;
    double noise_uncertainty = 0.0, uncertainty = 0.0;  // of noise and error_of_one, relative: standard errors, at most
    std::uint64_t least = 0;                            // samples that a render has at least
    unsigned scramblings = 1;
    std::shared_ptr<Pilot> pilot;
    std::uint64_t samples = 0;  // of all scramblings
    double points = 0.0;        // of each scrambling; 0: of independent samples

    [[nodiscard]] const Foretold* adaptive() const { return pilot ? pilot->foretold() : nullptr; }
    [[nodiscard]] double seconds_to_adaptive() const { return pilot ? pilot->seconds_to_foretell() : 0.0; }
    [[nodiscard]] double share_of(std::size_t some) const {
        return static_cast<double>(some) / static_cast<double>(pixels);
    }
    // What Sobol points gain on independent samples they gain by their first ones. Until the 32nd, or the trial's last,
    // they fall as those of the trial did. Then no more than late_gain is left. Both are from the scenes of
    // tests/records/accuracy/ACCURACY.md, where the gain after the 32nd is 0.03 to 0.08 in the middle.
    static constexpr double most_late_gain = 0.05;
    [[nodiscard]] double early_points() const { return std::max(points, 32.0); }
    [[nodiscard]] double late_gain() const { return std::min(gain, most_late_gain); }
    // Relative standard error of seconds_to, at most. How even Sobol points are follows from the same error. So the
    // further its fall is followed, the less it is known.
    [[nodiscard]] double uncertainty_at(double relative_error) const;
    [[nodiscard]] bool sees_noise() const { return error_of_one > 0.0 || added > 0.0; }
    [[nodiscard]] double error_of(double some_points) const {
        const double early = points > 0.0 ? std::min(some_points, early_points()) : some_points;
        return error_of_one / std::pow(early, 1.0 + gain) / std::pow(some_points / early, 1.0 + late_gain()) +
               added / some_points;
    }
    [[nodiscard]] double samples_to(double relative_error) const;
    [[nodiscard]] double seconds_of(double wanted) const {
        return seconds_a_call + std::max(static_cast<double>(least), wanted) * seconds_a_sample;
    }
    // With a standard error more, so that few renders miss the error there. It is a bound, so no more than half is
    // added: a block may be less. Between powers of two Sobol points' errors lie up to 3.5 % above their fall, as
    // measured on two scenes. Nothing without noise, which may be rare.
    [[nodiscard]] std::optional<double> samples_surely_to(double relative_error) const {
        constexpr double most_added = 0.5, uneven = 0.07;
        if (!sees_noise()) return std::nullopt;
        const double margin = std::min(most_added, uncertainty_at(relative_error) + (points > 0.0 ? uneven : 0.0));
        return std::max(static_cast<double>(least), (1.0 + margin) * samples_to(relative_error));
    }
    void take_time(double seconds, double on_device, double taken) {
        seconds_a_sample = std::max(on_device / taken, 1e-12);
        seconds_a_call = std::max(0.0, seconds - on_device);
    }
    // By a trial with so many samples, with the first one that warms up where they are independent.
    [[nodiscard]] double seconds_taken(std::uint64_t trial_samples) const {
        return 2.0 * seconds_a_call + static_cast<double>(trial_samples) * seconds_a_sample;
    }
    [[nodiscard]] double seconds_to(double relative_error) const {
        return sees_noise() ? seconds_of(samples_to(relative_error)) : 0.0;
    }
    // With independent samples in place of Sobol points.
    [[nodiscard]] ShortTrial independent() const;
    void fall_as(const ShortTrial& other) {
        error_of_one = other.error_of_one;
        gain = other.gain;
        added = other.added;
    }
};

// So many samples. Nothing after a stop, and of a black image.
[[nodiscard]] std::optional<ShortTrial> independent_trial(RenderJob& job, std::uint64_t samples, std::stop_token stop);

// Two scramblings with half of the samples each. How even the points are shows in how much closer their means are
// than those of as many independent samples. Sobol points are no less even than those. Where the job is not warm, the
// sooner of the two tells the time.
[[nodiscard]] std::optional<ShortTrial> scrambled_trial(
    RenderJob& job, std::uint64_t samples, bool is_warm, std::stop_token stop);

// A trial beside the best one so far.
struct ComparedTrials {
    double seconds = 0.0;      // to the error
    double uncertainty = 0.0;  // of how many times those of the best they are, relative: a standard error
};

// Trials of one generator are compared by their noise until it is known how even points are. Few points do not tell.
[[nodiscard]] ComparedTrials compare_trials(const ShortTrial& trial, const ShortTrial& best, double relative_error);

// The trial of settings with more roulette, beside one with less on the same random numbers. Its decisions multiply
// what other dimensions give, and Sobol points are even in pairs of them alone (MODEL.md section 3.2). So noise that
// roulette adds falls about as 1/n, which is taken for a bound. The rest falls as that of the other does.
[[nodiscard]] ShortTrial with_roulette(ShortTrial more, const ShortTrial& less);

}  // namespace tandem
