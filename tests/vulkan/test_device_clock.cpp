// The device's clock in terms of the host's.
#include <doctest/doctest.h>

#include "common/error.h"
#include "tests/vulkan/machine.h"
#include "vulkan/bench/bench_device.h"
#include "vulkan/core/device_clock.h"

using namespace tandem;
using namespace tandem::testing;

TEST_CASE("a stamp lies on the straight line through two moments") {
    const ClockPair before{1000, 5.0, 0.0}, after{3000, 6.0, 0.0};
    CHECK(host_seconds(before, after, 2000, 64) == 5.5);
    CHECK(host_seconds(before, after, 3000, 64) == 6.0);
    CHECK(host_seconds(before, after, 500, 64) == 4.75);  // before both
}

TEST_CASE("a counter of few bits may wrap between the moments") {
    const ClockPair before{0xfffffff00u, 5.0, 0.0}, after{0x100, 6.0, 0.0};
    CHECK(host_seconds(before, after, 0, 36) == 5.5);
    CHECK(host_seconds(before, after, 0xfffffff80u, 36) == 5.25);
    CHECK(host_seconds(before, after, 0x80, 36) == 5.75);
    CHECK(host_seconds(before, after, 0xf00000000000000u, 36) == 5.5);  // bits that are not valid
}

TEST_CASE("spans overlap by what they have in common") {
    CHECK(overlap_of({}) == 0.0);
    CHECK(overlap_of({{0.0, 1.0}, {1.0, 2.0}}) == 0.0);
    CHECK(overlap_of({{0.5, 2.0}, {0.0, 1.0}}) == 0.5);
    CHECK(overlap_of({{0.0, 4.0}, {1.0, 2.0}, {1.5, 3.0}}) == 2.5);  // twice 1.5 to 2
}

TEST_CASE("a submission begins after it was handed over and ends before that is known") {
    Machine machine(false);
    if (!machine.device.features().calibrated_timestamps) {
        CHECK_THROWS_WITH_AS(static_cast<void>(DeviceClock(machine.device)),
            doctest::Contains("VK_EXT_calibrated_timestamps"), UnsupportedError);
        return;
    }
    const DeviceClock clock(machine.device);
    VulkanJob job = machine.job({}, full_scene(), settings_of(32, 4));
    for (int i = 0; i < 5; ++i) {
        const ClockPair before = clock.now();
        const SubmissionTimes times = job.frame(4);
        const ClockPair after = clock.now();
        REQUIRE(times.moments.has_value());
        const SubmissionTimes::Moments& at = *times.moments;
        const double deviation = std::max(before.deviation, after.deviation);
        const double start = host_seconds(before, after, at.first_stamp, at.stamp_bits);
        const double end = host_seconds(before, after, at.last_stamp, at.stamp_bits);
        CHECK(deviation < 1e-3);
        CHECK(start >= at.submitted - deviation);
        CHECK(end <= at.known + deviation);
        CHECK(end - start == doctest::Approx(*times.device).epsilon(1e-3));
    }
}
