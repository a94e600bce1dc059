#include "common/experiment/thesis.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/statistics/distributions.h"
#include "common/statistics/sample_moments.h"

namespace tandem {

namespace {

// The thesis's table: samples, threads, cohesive; first frame; ten fresh, mean and deviation; sixty steady, likewise.
struct ThesisRow {
    std::uint32_t samples;
    unsigned threads;
    bool cohesive;
    double first, fresh, fresh_sigma, steady, steady_sigma;
};
constexpr std::array<ThesisRow, 8> thesis_rows{{
    {1, 1, true, 235.832, 213.317, 34.637, 194.374, 41.221},
    {1, 1, false, 322.726, 191.893, 65.775, 197.070, 39.091},
    {1, 8, true, 293.860, 210.245, 48.042, 192.511, 39.689},
    {1, 8, false, 362.723, 200.385, 65.627, 185.313, 37.991},
    {12, 1, true, 1983.160, 2209.609, 122.975, 2293.231, 143.441},
    {12, 1, false, 2351.430, 2285.485, 127.072, 2297.726, 140.580},
    {12, 8, true, 2288.380, 2316.922, 137.874, 2342.429, 125.719},
    {12, 8, false, 2410.700, 2273.592, 154.999, 2302.966, 124.245},
}};
// Milliseconds a sample at two bounces.
constexpr std::array<std::pair<std::uint32_t, double>, 3> thesis_two_bounces{
    {{10, 52.494}, {30, 52.419}, {50, 52.450}}};
constexpr std::uint32_t sweep_end = 12;
constexpr unsigned sweep_threads = 8;

// Follows how many samples of how many are rendered; a stop request ends the run by an exception of its own.
class Steps {
public:
    struct Stopped {};
    Steps(const ThesisOptions& options, double all) : options_(options), all_(all) {}
    double milliseconds(ThesisJob& job, std::uint32_t samples, bool fresh, const char* text) {
        if (options_.stop.stop_requested()) throw Stopped();
        const double seconds = job.frame(samples, fresh);
        done_ += samples;
        if (options_.progress) options_.progress(std::min(1.0, done_ / all_), text);
        return 1e3 * seconds;
    }

private:
    const ThesisOptions& options_;
    double all_, done_ = 0.0;
};

ThesisCell measure_cell(const BenchTarget& target, const ThesisOptions& options, const ThesisRow& row, Steps& steps) {
    ThesisCell cell{.samples = row.samples,
        .threads = row.threads,
        .cohesive = row.cohesive,
        .first = {},
        .fresh = {},
        .steady = {},
        .thesis_first = row.first,
        .thesis_fresh = row.fresh,
        .thesis_fresh_sigma = row.fresh_sigma,
        .thesis_steady = row.steady,
        .thesis_steady_sigma = row.steady_sigma};
    ThesisSetup setup = options.setup;
    setup.threads = row.threads;
    setup.cohesive = row.cohesive;
    // The thesis has one first frame; several, each of a job of its own, give an interval.
    for (std::uint32_t i = 1; i < options.first_frames; ++i)
        cell.first.push_back(steps.milliseconds(*target.thesis_job(setup), row.samples, true, "first frames"));
    const std::unique_ptr<ThesisJob> job = target.thesis_job(setup);
    cell.first.push_back(steps.milliseconds(*job, row.samples, true, "first frames"));
    for (std::uint32_t i = 0; i < options.fresh_frames; ++i)
        cell.fresh.push_back(steps.milliseconds(*job, row.samples, true, "fresh frames"));
    for (std::uint32_t i = 0; i < options.steady_frames; ++i)
        cell.steady.push_back(steps.milliseconds(*job, row.samples, false, "steady frames"));
    return cell;
}

ThesisSweepPoint measure_point(
    ThesisJob& job, std::uint32_t samples, std::uint32_t frames, double thesis, Steps& steps) {
    ThesisSweepPoint point{samples, {}, thesis};
    (void)steps.milliseconds(job, samples, false, "sweep");
    for (std::uint32_t i = 0; i < frames; ++i)
        point.milliseconds.push_back(steps.milliseconds(job, samples, false, "sweep"));
    return point;
}

double samples_in_all(const ThesisOptions& options) {
    const double frames = options.first_frames + options.fresh_frames + options.steady_frames;
    double samples = 0.0;
    for (const ThesisRow& row : thesis_rows) samples += row.samples * frames;
    samples += sweep_end * (sweep_end + 1) / 2.0 * (options.sweep_frames + 1);
    for (const auto& [count, thesis] : thesis_two_bounces) samples += count * (options.sweep_frames + 1.0);
    return samples;
}

}  // namespace

std::optional<LogarithmicFit> fit_logarithm(const std::vector<ThesisSweepPoint>& points) {
    std::vector<std::pair<double, double>> values;
    for (const ThesisSweepPoint& point : points)
        for (const double milliseconds : point.milliseconds)
            values.emplace_back(std::log(point.samples), milliseconds / point.samples);
    LogarithmicFit fit;
    const double n = static_cast<double>(values.size());
    if (n < 3.0) return std::nullopt;
    double mean_x = 0.0, mean_y = 0.0, xx = 0.0, xy = 0.0, squares = 0.0;
    for (const auto& [x, y] : values) {
        mean_x += x / n;
        mean_y += y / n;
    }
    for (const auto& [x, y] : values) {
        xx += (x - mean_x) * (x - mean_x);
        xy += (x - mean_x) * (y - mean_y);
    }
    if (!(xx > 0.0)) return std::nullopt;
    fit.b = xy / xx;
    fit.a = mean_y - fit.b * mean_x;
    for (const auto& [x, y] : values) squares += (y - fit.a - fit.b * x) * (y - fit.a - fit.b * x);
    fit.residual = std::sqrt(squares / (n - 2.0));
    const double t = student_quantile(0.975, n - 2.0);
    const double half_b = t * fit.residual / std::sqrt(xx);
    const double half_a = t * fit.residual * std::sqrt(1.0 / n + mean_x * mean_x / xx);
    fit.a_interval = {fit.a - half_a, fit.a + half_a};
    fit.b_interval = {fit.b - half_b, fit.b + half_b};
    return fit;
}

namespace {

// Leaves in `run` what was measured when a stop ends it by an exception.
void measure_run(const BenchTarget& target, const ThesisOptions& options, ThesisRun& run, Steps& steps) {
    {
        const std::unique_ptr<ThesisJob> any = target.thesis_job(options.setup);
        run.frame = any->frame_text();
        run.clock = any->clock_text();
        (void)any->frame(1, true);  // not counted: drivers may finish a pipeline at its first dispatch
    }
    for (const ThesisRow& row : thesis_rows) run.cells.push_back(measure_cell(target, options, row, steps));
    ThesisSetup setup = options.setup;
    setup.threads = sweep_threads;
    const std::unique_ptr<ThesisJob> sweep = target.thesis_job(setup);
    for (std::uint32_t samples = 1; samples <= sweep_end; ++samples)
        run.sweep.push_back(measure_point(*sweep, samples, options.sweep_frames, 0.0, steps));
    setup.bounces = 2;
    const std::unique_ptr<ThesisJob> two = target.thesis_job(setup);
    for (const auto& [samples, thesis] : thesis_two_bounces)
        run.two_bounces.push_back(measure_point(*two, samples, options.sweep_frames, thesis, steps));
}

}  // namespace

ThesisReport run_thesis(const BenchTarget& target, const ThesisOptions& options) {
    ThesisReport report;
    report.setup = options.setup;
    report.protocol_size = options.setup.width == 1920 && options.setup.height == 1080 && options.setup.bounces == 12;
    report.not_presented = target.no_presentation(options.setup);
    const bool presents = report.not_presented.empty();
    Steps steps(options, (presents ? 2.0 : 1.0) * samples_in_all(options));
    try {
        measure_run(target, options, report.headless, steps);
        ThesisOptions in_window = options;
        in_window.setup.presented = true;
        if (presents) measure_run(target, in_window, report.presented.emplace(), steps);
    } catch (const Steps::Stopped&) {
        report.stopped = true;
    }
    report.headless.fit = fit_logarithm(report.headless.sweep);
    if (report.presented) report.presented->fit = fit_logarithm(report.presented->sweep);
    return report;
}

}  // namespace tandem
