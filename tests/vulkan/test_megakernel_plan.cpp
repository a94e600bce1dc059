// How samples are shared out over submissions of the megakernel, on invented devices.
#include <doctest/doctest.h>

#include <array>

#include "vulkan/renderer/kernels/megakernel_plan.h"

using namespace tandem;

namespace {

DeviceDescription device(DeviceType type, std::uint32_t resident_invocations = 0) {
    DeviceDescription result;
    result.type = type;
    result.abilities.resident_invocations = resident_invocations;
    return result;
}

constexpr std::uint32_t of_h200 = 132 * 64 * 32;
constexpr std::uint32_t pixels = 1200 * 800;

// Samples of single pixels.
std::uint64_t size_of(const MegakernelShare& share) { return share.samples * share.invocations; }

// Submissions that `samples` samples of every pixel take where a sample of a pixel takes so long.
std::size_t submissions(const DeviceDescription& device, std::uint64_t samples, double seconds) {
    MegakernelPlan plan(device);
    plan.begin(pixels, samples);
    std::size_t count = 0;
    for (; plan.done() < samples; ++count) {
        const MegakernelShare share = plan.next();
        plan.took(seconds * static_cast<double>(size_of(share)));
    }
    return count;
}

}  // namespace

TEST_CASE("ten samples are one submission of a device that tells how large it is, and two of one that does not") {
    constexpr double measured = 0.4e-9;  // seconds for a sample of a pixel of one-weekend on an H200
    CHECK(submissions(device(DeviceType::discrete, of_h200), 10, measured) == 1);
    CHECK(submissions(device(DeviceType::discrete), 10, measured) == 2);
}

TEST_CASE("a first submission is short on every device that tells how large it is") {
    // Where a sample occupies an invocation for 1 ms, longer than any that was measured on an H200.
    for (const std::uint32_t resident : {1024u, 6144u, 24'576u, of_h200, 16u * of_h200}) {
        CAPTURE(resident);
        MegakernelPlan plan(device(DeviceType::discrete, resident));
        plan.begin(16384 * 16384, 64);
        CHECK(1e-3 * static_cast<double>(size_of(plan.next())) / resident <= longest_submission);
    }
}

TEST_CASE("a CPU begins with a few pixels, whatever it tells") {
    for (const std::uint32_t resident : {0u, of_h200}) {
        MegakernelPlan plan(device(DeviceType::cpu, resident));
        plan.begin(pixels, 64);
        const MegakernelShare share = plan.next();
        CHECK(share.samples == 1);
        CHECK(share.invocations == 4096);
    }
}

TEST_CASE("shares cover every sample of every pixel once, in order, however long they take") {
    const std::array devices{device(DeviceType::cpu), device(DeviceType::discrete), device(DeviceType::discrete, 6144),
        device(DeviceType::discrete, of_h200)};
    for (const DeviceDescription& each : devices)
        for (const double seconds : {0.4e-9, 1e-7, 1e-5}) {
            MegakernelPlan plan(each);
            plan.begin(pixels, 20);
            std::uint64_t sample = 0, pixel = 0;
            while (plan.done() < 20) {
                const MegakernelShare share = plan.next();
                REQUIRE(share.first_sample == sample);
                REQUIRE(share.first_invocation == pixel);
                REQUIRE(size_of(share) > 0);
                pixel += share.invocations;
                REQUIRE(pixel <= pixels);
                CHECK(share.completes == (pixel == pixels));
                if (share.completes) {
                    sample += share.samples;
                    pixel = 0;
                }
                plan.took(seconds * static_cast<double>(size_of(share)));
            }
            CHECK(sample == 20);
        }
}

TEST_CASE("submissions settle between a tenth and three tenths of a second, on a slow device too") {
    for (const double seconds : {1e-7, 1e-6}) {
        CAPTURE(seconds);
        MegakernelPlan plan(device(DeviceType::discrete));
        plan.begin(pixels, 64);
        double last = 0.0;
        for (int i = 0; i < 12; ++i) {
            last = seconds * static_cast<double>(size_of(plan.next()));
            plan.took(last);
        }
        // A remainder of less than half a share goes with it.
        CHECK(last <= 1.5 * longest_submission);
        CHECK(last >= 0.5 * shortest_submission);
    }
}
