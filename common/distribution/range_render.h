// Renders a fixed range of samples in steps, and stores the sums at intervals. Parts, resumed renders and farms use it.
#pragma once

#include <functional>

#include "common/render/renderer.h"
#include "common/stopwatch.h"

namespace tandem {

struct RangeWork {
    std::vector<SampleRange> ranges;  // to render, ascending, each beginning at a multiple of samples_per_block
    std::stop_token stop;
    std::function<void(double samples)> progress;  // a pixel, of these ranges
    // Called before each step: samples that a kill on the way loses; may be empty.
    std::function<void(SampleRange step)> begun;
    // Called at the end and whenever keep_interval() of rendering has passed, with the seconds since the call before;
    // may be empty.
    std::function<void(double seconds)> keep;
    double keep_seconds = 20.0;                    // between two calls, at most
    std::function<double()> now = steady_seconds;  // the clock of what `keep` takes
};

// Seconds of rendering until sums are kept again. The process has rendered for `rendered` seconds, and keeping its sums
// last took `cost` seconds. A kill loses at most this interval, a twenty-fifth of the process's work once that is
// longer than 6.25 s. Keeping takes at most a tenth of the time, unless `most` wants it more often.
[[nodiscard]] double keep_interval(double rendered, double cost, double most);

struct RangeResult {
    double seconds = 0.0;  // of rendering
    std::optional<double> device_seconds;
    bool complete = false;  // false: stopped
};

// Adds the samples to `sums`, whose ranges they are not. A stop leaves the blocks that were finished of every pixel.
[[nodiscard]] RangeResult render_ranges(RenderJob& job, Estimate& sums, const RangeWork& work);

// The parts of `ranges` of at most `most` samples, which is a multiple of samples_per_block, cut at its multiples.
[[nodiscard]] std::vector<SampleRange> cut(const std::vector<SampleRange>& ranges, std::uint64_t most);

}  // namespace tandem
