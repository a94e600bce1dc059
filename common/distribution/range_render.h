// Rendering of a fixed range of samples, in steps that are kept: what a part, a resumed render and a farm work by.
#pragma once

#include <functional>

#include "common/render/renderer.h"

namespace tandem {

struct RangeWork {
    std::vector<SampleRange> ranges;  // to render, ascending, each beginning at a multiple of samples_per_block
    std::stop_token stop;
    std::function<void(double samples)> progress;  // a pixel, of these ranges
    // Called every keep_seconds and at the end, with the seconds of rendering since the call before; may be empty.
    std::function<void(double seconds)> keep;
    double keep_seconds = 20.0;
};

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
