#include "common/validation/convergence.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "common/statistics/distributions.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

namespace {

using Clock = std::chrono::steady_clock;
using Pixels = std::vector<double>;  // [(y * width + x) * 3 + channel]

constexpr std::size_t group_count = 16;
constexpr std::size_t least_levels = 3, most_levels = 9;  // n = 64, 128, 256 ...
constexpr std::uint64_t reference_groups = 8;             // the long reference, in groups' worth of samples

struct Stopped {};

Estimated estimated(const std::vector<double>& of_groups) {
    const SampleMoments moments = moments_of(of_groups);
    const double half = student_quantile(0.975, moments.count - 1.0) * std::sqrt(moments.variance_of_mean());
    return {moments.mean, moments.mean - half, moments.mean + half};
}

double mean_square_product(const Pixels& x, const Pixels& r1, const Pixels& r2) {
    double sum = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - r1[i]) * (x[i] - r2[i]);
    return sum / static_cast<double>(x.size());
}

double mean_square_difference(const Pixels& a, const Pixels& b) { return mean_square_product(a, b, b); }

double mean(const Pixels& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// MSE at each level of one group, fitted.
struct Fit {
    double squared_bias = 0.0, variance = 0.0, slope = 0.0;
};
Fit fit(const std::vector<std::uint64_t>& samples, const std::vector<double>& squared_errors) {
    // y = b^2 + s^2 u, u = 1/n; weights n^2, as y scatters in proportion to u.
    double w = 0.0, wu = 0.0, wuu = 0.0, wy = 0.0, wuy = 0.0;
    double l = 0.0, ll = 0.0, m = 0.0, lm = 0.0;  // of log n and log y
    const auto count = static_cast<double>(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const double n = static_cast<double>(samples[i]), u = 1.0 / n, y = squared_errors[i];
        w += n * n;
        wu += n;
        wuu += 1.0;
        wy += n * n * y;
        wuy += n * n * u * y;
        const double log_n = std::log(n), log_y = std::log(std::max(y, 1e-300));
        l += log_n;
        ll += log_n * log_n;
        m += log_y;
        lm += log_n * log_y;
    }
    const double variance = (w * wuy - wu * wy) / (w * wuu - wu * wu);
    return {(wy - variance * wu) / w, variance, 0.5 * (count * lm - l * m) / (count * ll - l * l)};
}

// One side's image at n samples, for every n at once: level l is full whenever 2^l blocks are.
class Ladder {
public:
    Ladder(std::size_t levels, std::size_t size) : sums_(levels, Pixels(size, 0.0)) {}

    void add(const Pixels& block) {
        for (Pixels& sum : sums_)
            for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += block[i];
        ++blocks_;
    }
    [[nodiscard]] bool full(std::size_t level) const { return blocks_ % (std::uint64_t{1} << level) == 0; }
    // The mean image of a full level, which starts anew.
    [[nodiscard]] Pixels take(std::size_t level) {
        Pixels image(sums_[level].size(), 0.0);
        std::swap(image, sums_[level]);
        for (double& value : image) value /= static_cast<double>(std::uint64_t{1} << level);
        return image;
    }

private:
    std::vector<Pixels> sums_;
    std::uint64_t blocks_ = 0;
};

class Convergence {
public:
    Convergence(const Scene& scene, const RenderSettings& settings, Renderer& reference, Renderer& candidate,
        const ConvergenceOptions& options)
        : scene_(scene),
          settings_(settings),
          renderers_{reference, candidate},
          options_(options),
          size_(std::size_t{settings.width} * settings.height * channel_count) {}

    std::optional<ConvergenceReport> run();

private:
    // Groups' figures of one side, and the variance of one sample.
    struct Side {
        std::unique_ptr<RenderJob> job;
        std::vector<std::vector<double>> squared_errors;  // [group][level]
        SampleMoments variance;                           // mean over the image, a block each
    };

    [[nodiscard]] std::unique_ptr<RenderJob> job(std::size_t side, std::uint64_t seed_offset) const {
        RenderSettings settings = settings_;
        settings.seed = options_.seed + seed_offset;
        return renderers_[side].get().prepare(scene_, settings);
    }
    Estimate render(RenderJob& job, SampleRange range) {
        RenderControl control;
        control.stop = options_.stop;
        RenderResult result = job.render(range, control);
        if (result.estimate.count() != range.count()) throw Stopped{};
        done_ += result.seconds;
        if (options_.progress) options_.progress(std::min(1.0, done_ / planned_));
        return std::move(result.estimate);
    }
    double speed(RenderJob& job) {
        const Clock::time_point start = Clock::now();
        (void)render(job, {0, samples_per_block});
        return std::chrono::duration<double>(Clock::now() - start).count() / samples_per_block;
    }
    bool choose_levels();
    void render_reference();
    void measure_group();
    void conclude();
    [[nodiscard]] ConvergenceSide conclude(const Side& side) const;

    const Scene& scene_;
    const RenderSettings& settings_;
    std::array<std::reference_wrapper<Renderer>, 2> renderers_;
    const ConvergenceOptions& options_;
    std::size_t size_, levels_ = 0;
    std::array<Side, 2> sides_;
    Pixels first_half_, second_half_;
    std::vector<std::vector<double>> between_;  // [group][level]: mean of |A - B|^2
    double mean_ = 0.0, done_ = 0.0, planned_ = 1.0;
    ConvergenceReport report_;
};

// As many as the budget allows; every group is as long as the greatest n.
bool Convergence::choose_levels() {
    planned_ = options_.budget_seconds;
    const double a = speed(*sides_[0].job), b = speed(*sides_[1].job);
    for (levels_ = most_levels; levels_ >= least_levels; --levels_) {
        const double longest = static_cast<double>(samples_per_block << (levels_ - 1));
        planned_ = longest * ((group_count + reference_groups) * a + group_count * b);
        if (planned_ <= options_.budget_seconds) break;
    }
    for (std::size_t level = 0; level < levels_; ++level) report_.samples.push_back(samples_per_block << level);
    return levels_ >= least_levels;
}

void Convergence::render_reference() {
    const auto long_job = job(0, 2);
    const std::uint64_t half = report_.samples.back() * reference_groups / 2;
    const Estimate first = render(*long_job, {0, half}), second = render(*long_job, {half, 2 * half});
    first_half_ = mean_of(first);
    second_half_ = mean_of(second);
    mean_ = 0.5 * (mean(first_half_) + mean(second_half_));
    report_.reference_samples = 2 * half;
    // Half of the halves' difference is the error of their mean.
    report_.reference_relative_error = 0.5 * std::sqrt(mean_square_difference(first_half_, second_half_)) / mean_;
}

void Convergence::measure_group() {
    const std::uint64_t blocks = std::uint64_t{1} << (levels_ - 1), first = between_.size() * blocks;
    std::array<Ladder, 2> ladders{Ladder(levels_, size_), Ladder(levels_, size_)};
    std::array<std::vector<double>, 2> errors{std::vector<double>(levels_, 0.0), std::vector<double>(levels_, 0.0)};
    std::vector<double> between(levels_, 0.0);
    for (std::uint64_t block = first; block < first + blocks; ++block) {
        for (std::size_t s = 0; s < 2; ++s) {
            const Estimate estimate =
                render(*sides_[s].job, {block * samples_per_block, (block + 1) * samples_per_block});
            ladders[s].add(mean_of(estimate));
            sides_[s].variance.add(mean(variance_of(estimate)));
        }
        for (std::size_t level = 0; level < levels_; ++level) {
            if (!ladders[0].full(level)) continue;
            const double share = static_cast<double>(std::uint64_t{1} << level) / static_cast<double>(blocks);
            const Pixels a = ladders[0].take(level), b = ladders[1].take(level);
            errors[0][level] += share * mean_square_product(a, first_half_, second_half_);
            errors[1][level] += share * mean_square_product(b, first_half_, second_half_);
            between[level] += share * mean_square_difference(a, b);
        }
    }
    for (std::size_t s = 0; s < 2; ++s) sides_[s].squared_errors.push_back(errors[s]);
    between_.push_back(between);
}

ConvergenceSide Convergence::conclude(const Side& side) const {
    ConvergenceSide result;
    const double scale = 1.0 / (mean_ * mean_);
    for (std::size_t level = 0; level < levels_; ++level) {
        std::vector<double> errors;
        for (const std::vector<double>& group : side.squared_errors) errors.push_back(scale * group[level]);
        result.squared_errors.push_back(estimated(errors));
    }
    if (!(side.variance.mean > 0.0)) {  // nothing converges
        result.slope = result.variance_ratio = {NAN, NAN, NAN};
        result.squared_bias = result.squared_errors.back();
        return result;
    }
    std::vector<double> slopes, biases, ratios;
    for (const std::vector<double>& group : side.squared_errors) {
        const Fit fitted = fit(report_.samples, group);
        slopes.push_back(fitted.slope);
        biases.push_back(scale * fitted.squared_bias);
        ratios.push_back(side.variance.mean > 0.0 ? fitted.variance / side.variance.mean : 1.0);
    }
    result.slope = estimated(slopes);
    result.squared_bias = estimated(biases);
    result.variance_ratio = estimated(ratios);
    return result;
}

void Convergence::conclude() {
    report_.reference = conclude(sides_[0]);
    report_.candidate = conclude(sides_[1]);
    const double variance = sides_[0].variance.mean + sides_[1].variance.mean;
    for (std::size_t level = 0; level < levels_; ++level) {
        std::vector<double> ratios;
        const double expected = variance / static_cast<double>(report_.samples[level]);
        for (const std::vector<double>& group : between_)
            ratios.push_back(expected > 0.0 ? group[level] / expected : 1.0);
        report_.between.push_back(estimated(ratios));
    }
}

std::optional<ConvergenceReport> Convergence::run() {
    const Clock::time_point start = Clock::now();
    try {
        sides_[0].job = job(0, 0);
        sides_[1].job = job(1, 1);
        if (!choose_levels()) return std::nullopt;
        render_reference();
        if (!(mean_ > 0.0)) return std::nullopt;
        while (between_.size() < group_count) measure_group();
    } catch (const Stopped&) {
        return std::nullopt;
    }
    conclude();
    report_.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    return std::move(report_);
}

}  // namespace

std::optional<ConvergenceReport> measure_convergence(const Scene& scene, const RenderSettings& settings,
    Renderer& reference, Renderer& candidate, const ConvergenceOptions& options) {
    return Convergence(scene, settings, reference, candidate, options).run();
}

}  // namespace tandem
