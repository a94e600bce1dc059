// How samples are shared out over submissions of the six stages, on invented devices.
#include <doctest/doctest.h>

#include <algorithm>

#include "vulkan/renderer/kernels/megakernel_plan.h"
#include "vulkan/renderer/kernels/stage_plan.h"

using namespace tandem;

namespace {

// A device on which a ray of a segment takes so long, and a dispatch some time however few rays it has. Paths end after
// `depth` segments.
struct Device {
    double per_ray;
    std::uint32_t depth;

    [[nodiscard]] double seconds(const StageShare& share) const {
        constexpr double per_segment = 5e-6;
        const std::uint32_t alive = std::min(share.end_segment, depth) - std::min(share.first_segment, depth);
        return per_segment * (share.end_segment - share.first_segment) + per_ray * alive * share.places;
    }
};

DeviceDescription of_type(DeviceType type) {
    DeviceDescription description;
    description.type = type;
    return description;
}

struct Run {
    double longest = 0.0, all = 0.0;
    std::uint64_t submissions = 0;
};

// Follows a plan for so many samples or submissions, and checks that its shares cover all in order.
Run follow(StagePlan& plan, const Device& device, std::uint32_t places, std::uint32_t segments, std::uint64_t samples,
    std::uint64_t most_submissions = 2000) {
    plan.begin(places, samples);
    Run run;
    std::uint64_t sample = 0;
    std::uint32_t place = 0, in_run = 0, segment = 0;
    const auto end_run = [&] {
        place += in_run;
        segment = 0;
        if (place == places) {
            place = 0;
            ++sample;
        }
    };
    while (plan.done() < samples && run.submissions < most_submissions) {
        double seconds = 0.0;
        for (const StageShare& share : plan.next()) {
            REQUIRE(share.sample == sample);
            REQUIRE(share.first_place == place);
            REQUIRE(share.first_segment == segment);
            REQUIRE(share.end_segment > segment);
            if (segment == 0) in_run = share.places;
            REQUIRE(share.places == in_run);
            REQUIRE(place + in_run <= places);
            segment = share.end_segment;
            REQUIRE(segment <= segments);
            CHECK(share.completes == (segment == segments && place + in_run == places));
            if (segment == segments) end_run();
            seconds += device.seconds(share);
        }
        ++run.submissions;
        run.longest = std::max(run.longest, seconds);
        run.all += seconds;
        plan.took(seconds);
        if (plan.doubtful_segment() >= device.depth) {
            const bool completes = plan.leave_out_rest_of_run();
            end_run();
            CHECK(completes == (place == 0));
        }
        REQUIRE(plan.done() == sample);
    }
    return run;
}

}  // namespace

TEST_CASE("a submission of the stages is short, however long paths are, however many and whatever a ray takes") {
    for (const DeviceType type : {DeviceType::cpu, DeviceType::discrete})
        for (const std::uint32_t segments : {1u, 13u, 257u, 4097u, 1'000'001u})
            for (const std::uint32_t places : {1u, 200u, 262'144u, 3'000'000u})
                for (const double per_ray : {1e-9, 1e-7, 1e-5, 1e-4})
                    for (const std::uint32_t depth : {1u, 20u, segments}) {
                        if (type == DeviceType::discrete && per_ray > 1e-7) continue;  // no GPU is so slow
                        CAPTURE(segments);
                        CAPTURE(places);
                        CAPTURE(per_ray);
                        CAPTURE(depth);
                        StagePlan plan(of_type(type), segments, 0);
                        const Run run = follow(plan, {per_ray, depth}, places, segments, 64);
                        CHECK(run.longest < 1.0);
                    }
}

TEST_CASE("submissions of the stages are long enough to cost nothing") {
    for (const std::uint32_t segments : {1u, 13u, 4097u})
        for (const double per_ray : {1e-7, 1e-6}) {
            CAPTURE(segments);
            CAPTURE(per_ray);
            StagePlan plan(of_type(DeviceType::cpu), segments, 0);
            (void)follow(plan, {per_ray, segments}, 262'144, segments, 4, 60);  // until it knows the device
            const Run run = follow(plan, {per_ray, segments}, 262'144, segments, 64, 100);
            CHECK(run.all / static_cast<double>(run.submissions) > 0.5 * shortest_submission);
        }
}

TEST_CASE("paths that end early cost no more with a high bounce limit") {
    // A sample of 20 segments takes 2 ms; the empty dispatches of a million would take 5 s.
    StagePlan plan(of_type(DeviceType::cpu), 1'000'001, 0);
    const Device device{1e-7, 20};
    (void)follow(plan, device, 1024, 1'000'001, 64);
    const Run run = follow(plan, device, 1024, 1'000'001, 64);
    CHECK(run.all < 64 * 0.02);
}

TEST_CASE("another tile's samples are not foretold from a smaller one's") {
    StagePlan plan(of_type(DeviceType::cpu), 13, 0);
    const Device device{1e-6, 13};
    (void)follow(plan, device, 1000, 13, 64);
    CHECK(follow(plan, device, 3'000'000, 13, 2).longest < 1.0);
}

TEST_CASE("a fixed number of segments is kept to, over samples") {
    StagePlan plan(of_type(DeviceType::cpu), 5, 3);
    plan.begin(70, 2);
    const std::vector<StageShare> first = plan.next(), second = plan.next();
    REQUIRE(first.size() == 1);
    CHECK(first[0].places == 70);
    CHECK(first[0].end_segment == 3);
    REQUIRE(second.size() == 2);
    CHECK(second[0].completes);
    CHECK(second[1].sample == 1);
    CHECK(second[1].end_segment == 1);
    CHECK(plan.done() == 1);
    CHECK(plan.done_of_next() == doctest::Approx(0.2));
}
