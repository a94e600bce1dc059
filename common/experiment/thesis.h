// The thesis's experiment by its own protocol (Ferreira 2019, tables 4.3 to 4.5 and the sampling sweep). The thesis's
// figures are shown beside ours.
#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "common/experiment/bench.h"
#include "common/statistics/interval.h"

namespace tandem {

struct ThesisOptions {
    ThesisSetup setup;  // size and bounces; threads and cohesion vary
    std::uint32_t fresh_frames = 10, steady_frames = 60, first_frames = 5, sweep_frames = 10;
    std::stop_token stop;
    std::function<void(double fraction, const std::string& text)> progress;
};

// One of the eight configurations.
struct ThesisCell {
    std::uint32_t samples = 1;
    unsigned threads = 1;
    bool cohesive = true;
    std::vector<double> first, fresh, steady;  // milliseconds a frame
    // The thesis's: its first frame, and means and deviations. GTX 860M, i7-4700HQ.
    double thesis_first = 0.0, thesis_fresh = 0.0, thesis_fresh_sigma = 0.0, thesis_steady = 0.0,
           thesis_steady_sigma = 0.0;
};

struct ThesisSweepPoint {
    std::uint32_t samples = 1;
    std::vector<double> milliseconds;  // a frame
    double thesis_sample = 0.0;        // milliseconds a sample there; 0: not told
};

// t(n) = a + b ln n, milliseconds a sample, least squares over frames, with 95 % intervals.
struct LogarithmicFit {
    double a = 0.0, b = 0.0;
    Interval a_interval, b_interval;
    double residual = 0.0;  // standard deviation
};
// Nothing: there are fewer than three frames, or all of one number of samples.
[[nodiscard]] std::optional<LogarithmicFit> fit_logarithm(const std::vector<ThesisSweepPoint>& points);

// The whole protocol, with frames in a window or without one.
struct ThesisRun {
    std::string frame, clock;  // ThesisJob's texts
    std::vector<ThesisCell> cells;
    std::vector<ThesisSweepPoint> sweep;        // 1 … 12 samples, 8 threads, cohesive
    std::vector<ThesisSweepPoint> two_bounces;  // 10, 30, 50 samples
    std::optional<LogarithmicFit> fit;          // of the sweep
};

struct ThesisReport {
    ThesisSetup setup;
    bool protocol_size = true;  // 1920x1080 at 12 bounces; else figures do not compare with the thesis's
    ThesisRun headless;
    std::optional<ThesisRun> presented;
    std::string not_presented;  // why there is no such run
    bool stopped = false;
};

// Without a window, and in one where there is one. Throws what making jobs throws. A stop leaves out what was not
// measured.
[[nodiscard]] ThesisReport run_thesis(const BenchTarget& target, const ThesisOptions& options);

[[nodiscard]] nlohmann::json to_json(const ThesisReport& report);
[[nodiscard]] std::string to_text(const ThesisReport& report);

}  // namespace tandem
