#include "common/cost/settings_trial.h"

#include <cmath>
#include <utility>

#include "common/render/scrambled_film.h"
#include "common/render/stopping.h"

namespace tandem {

namespace {

constexpr std::uint64_t next_scrambling = std::uint64_t{1} << 32;  // MODEL.md section 3.2

// Estimates of pixels, whose channels are added up.
struct PixelTotal {
    double sum = 0.0, of_squares = 0.0;
    void add(double pixel) {
        sum += pixel;
        of_squares += pixel * pixel;
    }
    [[nodiscard]] double mean(std::uint64_t pixels) const { return sum / static_cast<double>(channel_count * pixels); }
    // Pixels are independent, and the variance of an estimate is at most the mean of its square. So a sum of pixels'
    // estimates is off by at most the root of the sum of their squares, for any distribution.
    [[nodiscard]] double uncertainty() const { return sum > 0.0 ? std::sqrt(of_squares) / sum : 0.0; }
};

// Those of one piece where they are.
const Estimate::Plane& totals_of(const Estimate& estimate, Estimate::Plane& room) {
    const std::vector<Estimate::Piece> all = estimate.pieces();
    if (all.size() == 1) return *all.front().moments;
    return room = estimate.totals();
}

}  // namespace

const Foretold* Pilot::foretold() {
    if (samples_) foretold_ = foretell(*samples_);
    samples_.reset();
    return foretold_ ? &*foretold_ : nullptr;
}

double Pilot::seconds_to_foretell() const {
    constexpr double of_pixel = 1e-7;  // as measured on a core of an EPYC, by images of 2^15 to 2^18 pixels
    return samples_ ? of_pixel * static_cast<double>(samples_->pixel_count()) : 0.0;
}

double ShortTrial::uncertainty_at(double relative_error) const {
    if (points == 0.0) return uncertainty;
    const double wanted = scramblings * relative_error * relative_error, early = early_points();
    const auto further = [&](double squared) { return std::log(std::max(1.0, squared / wanted)); };
    const double followed = std::min(further(error_of(points)) / (1.0 + gain), std::log(early / points));
    const double late = further(error_of(early)) / (1.0 + late_gain()), of_gain = uncertainty / std::log(points);
    return (uncertainty + of_gain * followed + std::min(of_gain, most_late_gain) * late) / (1.0 + late_gain());
}

double ShortTrial::samples_to(double relative_error) const {
    const double wanted = scramblings * relative_error * relative_error;
    double without = std::pow(error_of_one / wanted, 1.0 / (1.0 + gain));
    if (const double early = early_points(); points > 0.0 && without > early)
        without = early * std::pow(error_of_one / std::pow(early, 1.0 + gain) / wanted, 1.0 / (1.0 + late_gain()));
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
    RenderResult result = job.render({trial_begin, trial_begin + samples}, {.stop = stop, .progress = {}});
    if (result.estimate.count() < samples) return std::nullopt;
    const Estimate::Plane sums = result.estimate.totals();
    PixelTotal means, variances;
    for (std::size_t i = 0; i < sums.size(); i += channel_count) {
        double mean = 0.0, variance = 0.0;
        for (std::size_t c = i; c < i + channel_count; ++c) {
            mean += mean_from(sums[c], samples);
            variance += variance_from(sums[c], samples);
        }
        means.add(mean);
        variances.add(variance);
    }
    ShortTrial trial;
    trial.pixels = result.estimate.pixel_count();
    const double mean = means.mean(trial.pixels);
    if (!(mean > 0.0)) return std::nullopt;
    trial.noise = trial.error_of_one = variances.mean(trial.pixels) / (mean * mean);
    trial.noise_uncertainty = trial.uncertainty = variances.uncertainty();
    trial.take_time(result.seconds, result.device_seconds.value_or(result.seconds), static_cast<double>(samples));
    trial.least = least_judged(trial.pixels, 1);
    trial.pilot = std::make_shared<Pilot>(std::move(result.estimate));
    trial.samples = samples;
    return trial;
}

std::optional<ShortTrial> scrambled_trial(RenderJob& job, std::uint64_t samples, bool is_warm, std::stop_token stop) {
    const std::uint64_t points = samples / 2;
    const auto render = [&](std::uint64_t begin) {
        return job.render({begin, begin + points}, {.stop = stop, .progress = {}});
    };
    RenderResult a = render(trial_begin);
    RenderResult b = render(trial_begin + next_scrambling);
    if (a.estimate.count() < points || b.estimate.count() < points) return std::nullopt;
    Estimate::Plane room_a, room_b;
    const Estimate::Plane &sums_a = totals_of(a.estimate, room_a), &sums_b = totals_of(b.estimate, room_b);
    const auto n = static_cast<double>(points);
    const double per_point = 1.0 / n;
    PixelTotal means, between, noises;  // `between`: variances of a mean
    for (std::size_t i = 0; i < sums_a.size(); i += channel_count) {
        double mean = 0.0, of_mean = 0.0, deviations = 0.0;
        for (std::size_t c = i; c < i + channel_count; ++c) {
            const double mean_a = per_point * sums_a[c].sum, mean_b = per_point * sums_b[c].sum;
            mean += 0.5 * (mean_a + mean_b);
            of_mean += 0.5 * (mean_a - mean_b) * (mean_a - mean_b);
            // As variance_from() has them, without its divisions: there are many values, and a GPU waits.
            deviations += std::max(0.0, sums_a[c].sum_of_squares - mean_a * sums_a[c].sum) +
                          std::max(0.0, sums_b[c].sum_of_squares - mean_b * sums_b[c].sum);
        }
        means.add(mean);
        between.add(of_mean);
        // Points differ more from their mean where that has less variance: the mean of their squared deviations is
        // variance - error.
        noises.add(of_mean + 0.5 * per_point * deviations);
    }
    ShortTrial trial;
    trial.pixels = a.estimate.pixel_count();
    const double mean = means.mean(trial.pixels), error = between.mean(trial.pixels), noise = noises.mean(trial.pixels);
    if (!(mean > 0.0)) return std::nullopt;
    a.estimate.merge(std::move(b.estimate));
    constexpr double steepest = 1.0;  // a squared error of n^-2, which images with edges do not have
    trial.noise = noise / (mean * mean);
    if (noise > 0.0 && error > 0.0) trial.gain = std::clamp(std::log(noise / (n * error)) / std::log(n), 0.0, steepest);
    trial.error_of_one = trial.gain > 0.0 ? error * std::pow(n, 1.0 + trial.gain) / (mean * mean) : trial.noise;
    trial.noise_uncertainty = noises.uncertainty();
    trial.uncertainty = between.uncertainty();
    trial.pilot = std::make_shared<Pilot>(std::move(a.estimate));
    trial.samples = samples;
    trial.points = n;
    const auto on_device = [](const RenderResult& one) { return one.device_seconds.value_or(one.seconds); };
    const RenderResult& sooner = on_device(a) < on_device(b) ? a : b;
    if (is_warm)
        trial.take_time(0.5 * (a.seconds + b.seconds), 0.5 * (on_device(a) + on_device(b)), n);
    else
        trial.take_time(sooner.seconds, on_device(sooner), n);
    trial.scramblings = scramblings_for(trial.pixels);
    trial.least = least_judged(trial.pixels, trial.scramblings);
    return trial;
}

ComparedTrials compare_trials(const ShortTrial& trial, const ShortTrial& best, double relative_error) {
    constexpr auto few = static_cast<double>(least_points);
    const double noises = std::hypot(trial.noise_uncertainty, best.noise_uncertainty);
    if (trial.added > 0.0 || best.added > 0.0) return {trial.seconds_to(relative_error), noises};
    const bool alike = (trial.points > 0.0) == (best.points > 0.0) && best.noise > 0.0;
    if (!alike || (trial.points >= few && best.points >= few))
        return {trial.seconds_to(relative_error),
            std::hypot(trial.uncertainty_at(relative_error), best.uncertainty_at(relative_error))};
    return {trial.seconds_of(best.samples_to(relative_error) * trial.noise / best.noise), noises};
}

ShortTrial with_roulette(ShortTrial more, const ShortTrial& less) {
    const double added = less.added + more.noise - less.noise;
    if (less.points == 0.0 || (added <= 0.0 && less.added == 0.0)) return more;
    more.fall_as(less);
    more.added = std::max(0.0, added);
    return more;
}

}  // namespace tandem
