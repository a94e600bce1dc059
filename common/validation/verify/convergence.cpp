#include "common/validation/verify/convergence.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "common/statistics/distributions.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

namespace {

using Pixels = std::vector<double>;  // [(y * width + x) * 3 + channel]

constexpr std::size_t group_count = 16;
constexpr std::size_t least_levels = 3, most_levels = 9;  // n = 64, 128, 256 ...
constexpr std::uint64_t reference_groups = 8;             // the long reference, in groups' worth of samples

struct Stopped {};

using Figures = std::vector<double>;  // of one group: squared errors by level, then the variance of one sample
using Statistic = std::function<double(const Figures& mean_of_groups)>;

// A statistic of the groups' mean figures. The jackknife takes its bias out and gives its interval [Efron, Tibshirani,
// An introduction to the bootstrap, 1993, chapter 11]. Ratios and logarithms of noisy means are not unbiased, and their
// noise is not that of their parts. `common`: the standard error of what is added to the squared errors of all groups
// alike, known by nine degrees of freedom.
Estimated jackknifed(const std::vector<Figures>& groups, const Statistic& statistic, double common = 0.0) {
    const auto count = static_cast<double>(groups.size());
    Figures sum(groups.front().size(), 0.0);
    for (const Figures& group : groups)
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += group[i];
    const auto mean_without = [&](const Figures* left_out) {
        Figures mean(sum);
        for (std::size_t i = 0; i < mean.size(); ++i)
            mean[i] =
                (sum[i] - (left_out != nullptr ? (*left_out)[i] : 0.0)) / (left_out != nullptr ? count - 1.0 : count);
        return mean;
    };
    std::vector<double> partial;
    for (const Figures& group : groups) partial.push_back(statistic(mean_without(&group)));
    const SampleMoments moments = moments_of(partial);
    Figures shifted = mean_without(nullptr);
    const double whole = statistic(shifted), value = count * whole - (count - 1.0) * moments.mean;
    for (std::size_t i = 0; i + 1 < shifted.size(); ++i) shifted[i] += common;
    const double of_groups =
        student_quantile(0.975, count - 1.0) * std::sqrt((count - 1.0) * (count - 1.0) * moments.variance_of_mean());
    const double half = std::hypot(of_groups, student_quantile(0.975, 9.0) * (statistic(shifted) - whole));
    return {value, value - half, value + half};
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

Pixels combined(std::span<const Pixels> images, std::span<const double> weights) {
    Pixels result(images.front().size(), 0.0);
    for (std::size_t k = 0; k < weights.size(); ++k)
        for (std::size_t i = 0; i < result.size(); ++i) result[i] += weights[k] * images[k][i];
    return result;
}

// A half of the reference from its parts, and combinations of them that have a part's noise and no mean (Helmert's).
using Parts = std::array<Pixels, reference_groups / 2>;
Pixels mean_of_parts(const Parts& parts) { return combined(parts, std::array{0.25, 0.25, 0.25, 0.25}); }
std::array<Pixels, 3> contrasts(const Parts& parts) {
    const double a = std::sqrt(0.5), b = std::sqrt(1.0 / 6.0), c = std::sqrt(1.0 / 12.0);
    return {combined(parts, std::array{a, -a}), combined(parts, std::array{b, b, -2.0 * b}),
        combined(parts, std::array{c, c, c, -3.0 * c})};
}

// The mean of (m - r1)(m - r2) is that of sixteen uncorrelated products of the noise of two parts. Each of them is like
// a product of contrasts.
double product_error(const std::array<Pixels, 3>& first, const std::array<Pixels, 3>& second) {
    double squares = 0.0;
    for (const Pixels& a : first)
        for (const Pixels& b : second) {
            double product = 0.0;
            for (std::size_t i = 0; i < a.size(); ++i) product += a[i] * b[i] / static_cast<double>(a.size());
            squares += product * product;
        }
    return std::sqrt(squares / 9.0 / 16.0);
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
        std::vector<Figures> groups;
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
        const double start = options_.now();
        (void)render(job, {0, samples_per_block});
        return (options_.now() - start) / samples_per_block;
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
    std::vector<Figures> between_;    // of each group: mean of |A - B|^2 by level, then both variances
    double reference_product_ = 0.0;  // standard error of the mean of (m - r1)(m - r2), m being the truth
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
    const std::uint64_t each = report_.samples.back();
    std::array<std::array<Pixels, reference_groups / 2>, 2> parts;  // of the two halves
    for (std::uint64_t k = 0; k < reference_groups; ++k)
        parts[k / (reference_groups / 2)][k % (reference_groups / 2)] =
            mean_of(render(*long_job, {k * each, (k + 1) * each}));
    first_half_ = mean_of_parts(parts[0]);
    second_half_ = mean_of_parts(parts[1]);
    mean_ = 0.5 * (mean(first_half_) + mean(second_half_));
    report_.reference_samples = reference_groups * each;
    reference_product_ = product_error(contrasts(parts[0]), contrasts(parts[1]));
    // Half of the halves' difference is the error of their mean.
    report_.reference_relative_error = 0.5 * std::sqrt(mean_square_difference(first_half_, second_half_)) / mean_;
}

void Convergence::measure_group() {
    const std::uint64_t blocks = std::uint64_t{1} << (levels_ - 1), first = between_.size() * blocks;
    std::array<Ladder, 2> ladders{Ladder(levels_, size_), Ladder(levels_, size_)};
    std::array<std::vector<double>, 2> errors{std::vector<double>(levels_, 0.0), std::vector<double>(levels_, 0.0)};
    Figures between(levels_ + 1, 0.0);
    std::array<double, 2> variance{};
    for (std::uint64_t block = first; block < first + blocks; ++block) {
        for (std::size_t s = 0; s < 2; ++s) {
            const Estimate estimate =
                render(*sides_[s].job, {block * samples_per_block, (block + 1) * samples_per_block});
            ladders[s].add(mean_of(estimate));
            variance[s] += mean(variance_of(estimate)) / static_cast<double>(blocks);
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
    for (std::size_t s = 0; s < 2; ++s) {
        errors[s].push_back(variance[s]);
        sides_[s].groups.push_back(errors[s]);
        between.back() += variance[s];
    }
    between_.push_back(between);
}

ConvergenceSide Convergence::conclude(const Side& side) const {
    ConvergenceSide result;
    const double scale = 1.0 / (mean_ * mean_);
    const auto figure = [&](const Statistic& statistic) {
        return jackknifed(side.groups, statistic, reference_product_);
    };
    const auto fitted = [&](const Figures& figures) { return fit(report_.samples, figures); };
    for (std::size_t level = 0; level < levels_; ++level)
        result.squared_errors.push_back(figure([&](const Figures& mean) { return scale * mean[level]; }));
    if (std::ranges::all_of(side.groups, [](const Figures& group) { return !(group.back() > 0.0); })) {
        result.slope = result.variance_ratio = {NAN, NAN, NAN};  // nothing converges
        result.squared_bias = result.squared_errors.back();
        return result;
    }
    result.slope = figure([&](const Figures& mean) { return fitted(mean).slope; });
    result.squared_bias = figure([&](const Figures& mean) { return scale * fitted(mean).squared_bias; });
    result.variance_ratio = figure([&](const Figures& mean) { return fitted(mean).variance / mean.back(); });
    return result;
}

void Convergence::conclude() {
    report_.reference = conclude(sides_[0]);
    report_.candidate = conclude(sides_[1]);
    for (std::size_t level = 0; level < levels_; ++level)
        report_.between.push_back(jackknifed(between_, [&](const Figures& mean) {
            const double expected = mean.back() / static_cast<double>(report_.samples[level]);
            return expected > 0.0 ? mean[level] / expected : 1.0;
        }));
}

std::optional<ConvergenceReport> Convergence::run() {
    const double start = options_.now();
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
    report_.seconds = options_.now() - start;
    return std::move(report_);
}

}  // namespace

std::optional<ConvergenceReport> measure_convergence(const Scene& scene, const RenderSettings& settings,
    Renderer& reference, Renderer& candidate, const ConvergenceOptions& options) {
    return Convergence(scene, settings, reference, candidate, options).run();
}

}  // namespace tandem
