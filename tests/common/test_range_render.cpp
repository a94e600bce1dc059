// Renders that are kept on the way: what a kill at any moment would lose, and how often sums are kept.
#include <doctest/doctest.h>

#include <algorithm>

#include "common/distribution/range_render.h"

using namespace tandem;

namespace {

constexpr double speed = 40'000.0;  // samples a second

// Takes no time, but says that it did.
class PretendedJob final : public RenderJob {
public:
    RenderResult render(SampleRange range, const RenderControl&) override {
        RenderResult result{Estimate(1, 1), static_cast<double>(range.count()) / speed, std::nullopt};
        for (std::uint64_t at = range.begin; at < range.end; at += samples_per_block)
            result.estimate.add_block(
                {at, std::min(range.end, at + samples_per_block)}, Estimate::Plane(channel_count));
        return result;
    }
};

// The most that a kill would lose, and a call for every time that sums are kept.
struct Kept {
    std::uint64_t times = 0;
    double worst = 0.0;  // seconds lost beyond what is allowed; at most 0 where all is well
};

// `cost`: seconds that each keep pretends to take.
Kept render(double seconds, double most, double cost = 0.0) {
    Kept kept;
    double now = 0.0;
    PretendedJob job;
    Estimate sums;
    std::uint64_t safe = 0;
    RangeWork work;
    work.ranges = {{0, static_cast<std::uint64_t>(seconds * speed) / samples_per_block * samples_per_block}};
    work.keep_seconds = most;
    work.keep = [&](double) {
        ++kept.times;
        safe = sums.count();
        now += cost;
    };
    work.now = [&] { return now; };
    work.begun = [&](SampleRange step) {
        const double done = static_cast<double>(step.begin) / speed;
        const double lost = static_cast<double>(step.end - safe) / speed;
        kept.worst = std::max(kept.worst, lost - 1.2 * keep_interval(done, 0.0, most));
    };
    const RangeResult result = render_ranges(job, sums, work);
    CHECK(result.complete);
    CHECK(sums.count() == work.ranges.front().end);
    CHECK(safe == sums.count());
    return kept;
}

}  // namespace

TEST_CASE(
    "sums are kept after a quarter of a second, later after a twenty-fifth of the work, and at most so seldom as is "
    "asked") {
    CHECK(keep_interval(0.0, 0.0, 20.0) == 0.25);
    CHECK(keep_interval(100.0, 0.0, 20.0) == doctest::Approx(4.0));
    CHECK(keep_interval(10'000.0, 0.0, 20.0) == 20.0);
    CHECK(keep_interval(0.0, 0.0, 0.1) == 0.1);
    CHECK(keep_interval(0.0, 0.1, 20.0) == doctest::Approx(1.0));  // a tenth of the time
}

TEST_CASE("a kill at any moment loses an interval and a step, a twentieth of the work") {
    for (const double most : {20.0, 2.0, 0.2}) {
        const Kept kept = render(600.0, most);
        CHECK(kept.worst <= 0.0);
        CHECK(static_cast<double>(kept.times) >= 600.0 / (1.2 * most));
    }
}

TEST_CASE("sums that take long to keep are kept more seldom") {
    // 100 ms: once a second at most. Without that cost there would be one every quarter of a second, later every half.
    CHECK(render(12.0, 20.0, 0.1).times <= 14);
    CHECK(render(12.0, 20.0).times >= 24);
}
