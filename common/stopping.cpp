#include "common/stopping.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "common/statistics/distributions.h"

namespace tandem {

namespace {

using Clock = std::chrono::steady_clock;

// Requests a stop of `source` at a time, unless it is destroyed before.
class Deadline {
public:
    Deadline(std::stop_source source, std::optional<Clock::time_point> when) {
        if (!when) return;
        thread_ = std::jthread([source, when = *when](std::stop_token ending) mutable {
            std::mutex mutex;
            std::unique_lock lock(mutex);
            std::condition_variable_any wake;
            wake.wait_until(lock, ending, when, [] { return false; });
            if (!ending.stop_requested()) source.request_stop();
        });
    }

private:
    std::jthread thread_;
};

// So many black samples a pixel say that the image is black: it then has no relative error that could be met.
constexpr std::uint64_t black_samples = 1024;

// Samples to ask for next: without a target error all that are left; with one, a quarter of what there is, so that the
// error is looked at often but the overshoot stays small, and no more than the error is expected to need.
std::uint64_t next_end(const StoppingRule& rule, std::uint64_t done, std::optional<double> error) {
    const std::uint64_t last = rule.samples.value_or(std::uint64_t{1} << 40);
    std::uint64_t step = last - done;
    if (rule.relative_error || !rule.samples) {
        step = std::min(step, std::max(samples_per_block, done / 4));
        if (rule.relative_error && error) {
            const double needed = static_cast<double>(done) * std::pow(*error / *rule.relative_error, 2.0);
            const double left = std::max(1.0, std::ceil(needed - static_cast<double>(done)));
            if (left < static_cast<double>(step)) step = static_cast<std::uint64_t>(left);
        }
    }
    std::uint64_t end = done + step;
    if (end < last) end = (end + samples_per_block - 1) / samples_per_block * samples_per_block;
    return std::min(end, last);
}

double fraction_done(const StoppingRule& rule, double samples, double seconds, std::optional<double> error) {
    double fraction = 0.0;
    if (rule.samples) fraction = std::max(fraction, samples / static_cast<double>(*rule.samples));
    if (rule.seconds) fraction = std::max(fraction, seconds / *rule.seconds);
    if (rule.relative_error && error) fraction = std::max(fraction, std::pow(*rule.relative_error / *error, 2.0));
    return fraction;
}

// Samples of one part, and their variance, mean over pixels and channels.
struct PartVariance {
    double count = 0.0, variance = 0.0;
};

PartVariance part_variance(const Estimate& estimate) {
    const std::uint64_t count = estimate.count();
    const std::vector<double> variances = variance_of(estimate);
    double sum = 0.0;
    for (const double variance : variances) sum += variance;
    return {static_cast<double>(count), sum / static_cast<double>(variances.size())};
}

// Of the root of a mean of squared errors whose expectation is sum v_p / P: by how much such a mean itself scatters (a
// pixel's channels, which share paths, counting as one: 2 sum v_p^2 / (sum v_p)^2), and by how much the variances may
// be misjudged, which the parts of the render show.
std::optional<ErrorInterval> interval_of(
    const Estimate& estimate, double relative_error, const std::vector<PartVariance>& parts) {
    double count = 0.0, mean = 0.0, squares = 0.0;
    for (const PartVariance& part : parts) {
        count += part.count;
        mean += part.count * part.variance;
    }
    if (parts.size() < 2 || !(mean > 0.0)) return std::nullopt;
    mean /= count;
    for (const PartVariance& part : parts) squares += part.count * (part.variance - mean) * (part.variance - mean);
    const double degrees = static_cast<double>(parts.size()) - 1.0;
    const double misjudged = std::sqrt(squares / degrees / count) / mean;
    const std::vector<double> variances = variance_of(estimate);
    double sum = 0.0, of_squares = 0.0;
    for (std::size_t pixel = 0; pixel < variances.size(); pixel += channel_count) {
        double own = 0.0;
        for (std::size_t c = 0; c < channel_count; ++c) own += variances[pixel + c];
        sum += own;
        of_squares += own * own;
    }
    const double half = 0.5 * std::hypot(normal_quantile(0.975) * std::sqrt(2.0 * of_squares) / sum,
                                  student_quantile(0.975, degrees) * misjudged);
    return ErrorInterval{relative_error * std::exp(-half), relative_error * std::exp(half)};
}

}  // namespace

std::optional<double> relative_error_of(const Estimate& estimate) {
    const std::uint64_t count = estimate.count();
    if (count < 2) return std::nullopt;
    double mean = 0.0, variance = 0.0;
    for (const Moments& moments : estimate.totals()) {
        mean += mean_from(moments, count);
        variance += variance_from(moments, count) / static_cast<double>(count);
    }
    if (mean <= 0.0) return std::nullopt;
    const double values = static_cast<double>(estimate.pixel_count() * channel_count);
    return std::sqrt(variance / values) / (mean / values);
}

StoppedRender render_until(RenderJob& job, const StoppingRule& rule, std::stop_token stop,
    const std::function<void(const RenderProgress&)>& progress) {
    std::stop_source ending;
    const std::stop_callback forward(stop, [&] { ending.request_stop(); });
    const Clock::time_point start = Clock::now();
    std::optional<Clock::time_point> when;
    if (rule.seconds)
        when = start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(*rule.seconds));
    const Deadline deadline(ending, when);

    StoppedRender result;
    std::vector<PartVariance> parts;
    std::uint64_t done = 0;
    for (;;) {
        const std::uint64_t end = next_end(rule, done, result.relative_error);
        RenderControl control{.stop = ending.get_token(), .progress = {}};
        if (progress)
            control.progress = [&](double samples) {
                const double all = static_cast<double>(done) + samples;
                const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
                progress({all, fraction_done(rule, all, seconds, result.relative_error), result.relative_error});
            };
        RenderResult part = job.render({done, end}, control);
        if (done == 0 && part.estimate.count() == 0 && !stop.stop_requested()) {
            // The time was too short for anything: an image takes one sample a pixel at least.
            control.stop = stop;
            part = job.render({0, 1}, control);
        }
        const std::uint64_t count = part.estimate.count();
        result.seconds += part.seconds;
        if (rule.relative_error && count > 1) parts.push_back(part_variance(part.estimate));
        if (part.device_seconds) result.device_seconds = result.device_seconds.value_or(0.0) + *part.device_seconds;
        if (done == 0)
            result.estimate = std::move(part.estimate);
        else if (count > 0)
            result.estimate.merge(std::move(part.estimate));
        done += count;
        result.relative_error = relative_error_of(result.estimate);
        if (stop.stop_requested()) {
            result.complete = done == rule.samples;
            break;
        }
        if (ending.stop_requested() || done == rule.samples) break;
        if (!rule.relative_error) continue;
        if (result.relative_error && *result.relative_error <= *rule.relative_error) break;
        if (!result.relative_error && done >= black_samples && !rule.samples && !rule.seconds) {
            result.complete = false;
            break;
        }
    }
    if (result.relative_error)
        result.relative_error_interval = interval_of(result.estimate, *result.relative_error, parts);
    return result;
}

}  // namespace tandem
