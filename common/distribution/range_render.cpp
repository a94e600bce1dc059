#include "common/distribution/range_render.h"

#include <algorithm>

namespace tandem {

std::vector<SampleRange> cut(const std::vector<SampleRange>& ranges, std::uint64_t most) {
    std::vector<SampleRange> parts;
    for (const SampleRange& range : ranges)
        for (std::uint64_t at = range.begin; at < range.end;) {
            const std::uint64_t end = most >= range.end ? range.end : std::min(range.end, (at / most + 1) * most);
            parts.push_back({at, end});
            at = end;
        }
    return parts;
}

namespace {

// The whole blocks of what a stop left: one that was begun could never be completed.
Estimate whole_blocks(const Estimate& stopped) {
    Estimate whole(stopped.width(), stopped.height());
    for (const Estimate::Piece& piece : stopped.pieces())
        if (piece.range.count() % samples_per_block == 0) whole.add_block(piece.range, *piece.moments);
    whole.add_invalid(stopped.invalid());
    return whole;
}

// One step after the other, with what they took.
class Steps {
public:
    Steps(RenderJob& job, Estimate& sums, const RangeWork& work) : job_(job), sums_(sums), work_(work) {}

    // False: it was stopped within.
    bool render(SampleRange range) {
        if (work_.begun) work_.begun(range);
        RenderControl control{.stop = work_.stop, .progress = {}};
        if (work_.progress) control.progress = [&](double samples) { work_.progress(done_ + samples); };
        RenderResult part = job_.render(range, control);
        result_.seconds += part.seconds;
        if (part.device_seconds) result_.device_seconds = result_.device_seconds.value_or(0.0) + *part.device_seconds;
        const bool complete = part.estimate.count() == range.count();
        if (!complete) part.estimate = whole_blocks(part.estimate);
        const std::uint64_t count = part.estimate.count();
        if (count > 0 && sums_.pixel_count() == 0)
            sums_ = std::move(part.estimate);
        else if (count > 0)
            sums_.merge(std::move(part.estimate));
        done_ += static_cast<double>(count);
        const double interval = keep_interval(result_.seconds, keep_cost_, work_.keep_seconds);
        constexpr double share = 0.1;  // of the time between two keeps: what a kill may cost on top of it
        if (part.seconds < 0.5 * share * interval) step_ *= 2;
        if (part.seconds > share * interval) step_ = std::max(samples_per_block, step_ / 2);
        if (result_.seconds - seconds_kept_ >= interval) keep();
        return complete;
    }
    void keep() {
        const double start = work_.now();
        if (work_.keep) work_.keep(result_.seconds - seconds_kept_);
        keep_cost_ = work_.now() - start;
        seconds_kept_ = result_.seconds;
    }
    // How long a step takes is not known before the first, which is therefore short.
    [[nodiscard]] std::uint64_t step() const { return work_.keep ? step_ : std::uint64_t{1} << 62u; }
    [[nodiscard]] RangeResult result(bool complete) {
        keep();
        result_.complete = complete;
        return result_;
    }

private:
    RenderJob& job_;
    Estimate& sums_;
    const RangeWork& work_;
    RangeResult result_;
    double done_ = 0.0, seconds_kept_ = 0.0, keep_cost_ = 0.0;
    std::uint64_t step_ = samples_per_block;
};

}  // namespace

double keep_interval(double rendered, double cost, double most) {
    constexpr double least = 0.25;  // seconds: a start takes about as long
    constexpr double at_stake = 0.04, keeping = 0.1;
    return std::min(most, std::max({least, at_stake * rendered, cost / keeping}));
}

RangeResult render_ranges(RenderJob& job, Estimate& sums, const RangeWork& work) {
    Steps steps(job, sums, work);
    for (const SampleRange& range : work.ranges)
        for (std::uint64_t at = range.begin; at < range.end;) {
            const std::uint64_t end = at + std::min(range.end - at, steps.step());
            if (work.stop.stop_requested() || !steps.render({at, end})) return steps.result(false);
            at = end;
        }
    return steps.result(true);
}

}  // namespace tandem
