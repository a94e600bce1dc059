#include "common/cost/settings_trial.h"

#include <cmath>
#include <numeric>
#include <vector>

#include "common/render/scrambled_film.h"
#include "common/render/stopping.h"

namespace tandem {

namespace {

constexpr std::uint64_t next_scrambling = std::uint64_t{1} << 32;  // MODEL.md section 3.2

double mean_of_all(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Pixels are independent, and the variance of an estimate is at most the mean of its square. So a sum of pixels'
// estimates is off by at most the root of the sum of their squares, for any distribution.
double uncertainty_of(const std::vector<double>& values) {
    double sum = 0.0, of_squares = 0.0;
    for (std::size_t i = 0; i < values.size(); i += channel_count) {
        const double own = values[i] + values[i + 1] + values[i + 2];
        sum += own;
        of_squares += own * own;
    }
    return sum > 0.0 ? std::sqrt(of_squares) / sum : 0.0;
}

}  // namespace

double ShortTrial::samples_to(double relative_error) const {
    const double wanted = scramblings * relative_error * relative_error;
    const double without = std::pow(error_of_one / wanted, 1.0 / (1.0 + gain));
    if (!(added > 0.0)) return scramblings * without;
    // By bisection: the error falls with the number of points.
    double few = without, many = without + std::max(1.0, (error_of_one + added) / wanted);
    while (many - few > 1e-6 * many) {
        const double between = 0.5 * (few + many);
        (error_of(between) > wanted ? few : many) = between;
    }
    return scramblings * many;
}

ShortTrial ShortTrial::independent() const {
    ShortTrial trial = *this;
    trial.error_of_one = noise;
    trial.uncertainty = noise_uncertainty;
    trial.gain = trial.added = trial.points = 0.0;
    trial.scramblings = 1;
    trial.least = least_judged(pixels, 1);
    return trial;
}

std::optional<ShortTrial> independent_trial(RenderJob& job, std::uint64_t samples, std::stop_token stop) {
    const RenderResult result = job.render({trial_begin, trial_begin + samples}, {.stop = stop, .progress = {}});
    if (result.estimate.count() < samples) return std::nullopt;
    const double mean = mean_of_all(mean_of(result.estimate));
    if (!(mean > 0.0)) return std::nullopt;
    const std::vector<double> variances = variance_of(result.estimate);
    ShortTrial trial;
    trial.noise = trial.error_of_one = mean_of_all(variances) / (mean * mean);
    trial.noise_uncertainty = trial.uncertainty = uncertainty_of(variances);
    trial.take_time(result.seconds, result.device_seconds.value_or(result.seconds), static_cast<double>(samples));
    trial.pixels = result.estimate.pixel_count();
    trial.least = least_judged(trial.pixels, 1);
    trial.adaptive = foretell(result.estimate);
    trial.samples = samples;
    return trial;
}

std::optional<ShortTrial> scrambled_trial(RenderJob& job, std::uint64_t samples, std::stop_token stop) {
    const std::uint64_t points = samples / 2;
    const auto render = [&](std::uint64_t begin) {
        return job.render({begin, begin + points}, {.stop = stop, .progress = {}});
    };
    RenderResult a = render(trial_begin);
    const RenderResult b = render(trial_begin + next_scrambling);
    if (a.estimate.count() < points || b.estimate.count() < points) return std::nullopt;
    const std::vector<double> means_a = mean_of(a.estimate), means_b = mean_of(b.estimate);
    std::vector<double> between(means_a.size());  // variance of a mean
    for (std::size_t i = 0; i < between.size(); ++i) between[i] = 0.5 * std::pow(means_a[i] - means_b[i], 2.0);
    const double mean = 0.5 * (mean_of_all(means_a) + mean_of_all(means_b));
    if (!(mean > 0.0)) return std::nullopt;
    const double error = mean_of_all(between), n = static_cast<double>(points);
    // Points differ more from their mean where that has less variance: E s^2 = n / (n - 1) (variance - error).
    const std::vector<double> within_a = variance_of(a.estimate), within_b = variance_of(b.estimate);
    std::vector<double> noises(between);
    for (std::size_t i = 0; i < noises.size(); ++i) noises[i] += (1.0 - 1.0 / n) * 0.5 * (within_a[i] + within_b[i]);
    const double noise = mean_of_all(noises);
    a.estimate.merge(b.estimate);
    constexpr double steepest = 1.0;  // a squared error of n^-2, which images with edges do not have
    ShortTrial trial;
    trial.noise = noise / (mean * mean);
    if (noise > 0.0 && error > 0.0) trial.gain = std::clamp(std::log(noise / (n * error)) / std::log(n), 0.0, steepest);
    trial.error_of_one = trial.gain > 0.0 ? error * std::pow(n, 1.0 + trial.gain) / (mean * mean) : trial.noise;
    trial.noise_uncertainty = uncertainty_of(noises);
    trial.uncertainty = uncertainty_of(between);
    trial.adaptive = foretell(a.estimate);
    trial.samples = samples;
    trial.points = n;
    const auto on_device = [](const RenderResult& one) { return one.device_seconds.value_or(one.seconds); };
    trial.take_time(0.5 * (a.seconds + b.seconds), 0.5 * (on_device(a) + on_device(b)), n);
    trial.pixels = a.estimate.pixel_count();
    trial.scramblings = scramblings_for(trial.pixels);
    trial.least = least_judged(trial.pixels, trial.scramblings);
    return trial;
}

ComparedTrials compare_trials(const ShortTrial& trial, const ShortTrial& best, double relative_error) {
    constexpr auto few = static_cast<double>(least_points);
    const double noises = std::hypot(trial.noise_uncertainty, best.noise_uncertainty);
    if (trial.added > 0.0) return {trial.seconds_to(relative_error), noises};
    const bool alike = (trial.points > 0.0) == (best.points > 0.0) && best.noise > 0.0;
    if (!alike || (trial.points >= few && best.points >= few))
        return {trial.seconds_to(relative_error),
            std::hypot(trial.uncertainty_at(relative_error), best.uncertainty_at(relative_error))};
    return {trial.seconds_of(best.samples_to(relative_error) * trial.noise / best.noise), noises};
}

ShortTrial with_roulette(ShortTrial trial, const ShortTrial& best) {
    const double added = best.added + trial.noise - best.noise;
    if (best.points == 0.0 || added <= 0.0) return trial;
    trial.fall_as(best);
    trial.added = added;
    return trial;
}

}  // namespace tandem
