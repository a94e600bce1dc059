// Patterns change how Vulkan is used and the tracer tuned, never the image, and none of them makes the validation layer
// speak.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/vulkan/machine.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

Scene lit_room() {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0);
    Material material = diffuse(glm::dvec3(0.7, 0.5, 0.3));
    material.radiance = glm::dvec3(0.25);
    builder.cuboid(builder.material(material), {-1.0, -1.0, -1.0}, {1.0, 1.5, 2.0});
    builder.sphere(builder.material(mirror(glm::dvec3(0.9))), {0.5, 0.2, 0.8}, 0.3);
    return builder.scene();
}

VulkanJob job_of(Machine& machine, const JobPatterns& patterns) {
    return machine.job(patterns, lit_room(), settings_of(24, 4));
}

JobPatterns with(const std::function<void(JobPatterns&)>& change) {
    JobPatterns patterns;
    change(patterns);
    return patterns;
}

// Patterns for about 24 x 18 pixels: so many invocations that claim them, in workgroups of 32.
JobPatterns claiming(std::uint32_t claimants) {
    return with([&](JobPatterns& p) {
        p.tracer.kernel = KernelShape::megakernel;
        p.tracer.pixels = PixelPattern::claimed;
        p.tracer.claimants = claimants;
        p.tracer.hit_data = HitDataPattern::shared;
        p.tracer.workgroup = 32;
    });
}

std::vector<JobPatterns> variants() {
    return {with([](JobPatterns& p) { p.vulkan.memory = MemoryLayout::per_buffer; }),
        with([](JobPatterns& p) { p.vulkan.memory = MemoryLayout::dedicated; }),
        with([](JobPatterns& p) { p.vulkan.memory = MemoryLayout::one_block; }),
        with([](JobPatterns& p) { p.vulkan.memory = MemoryLayout::one_buffer; }),
        with([](JobPatterns& p) { p.vulkan.memory = MemoryLayout::rays_per_set; }),
        with([](JobPatterns& p) { p.vulkan.memory = MemoryLayout::others_per_set; }),
        with([](JobPatterns& p) { p.vulkan.scene = BufferPlacement::mapped; }), with([](JobPatterns& p) {
            p.vulkan.scene = BufferPlacement::host_visible;
            p.vulkan.memory = MemoryLayout::one_block;
        }),
        with([](JobPatterns& p) { p.vulkan.rays = BufferPlacement::mapped; }), with([](JobPatterns& p) {
            p.vulkan.rays = BufferPlacement::host_visible;
            p.vulkan.memory = MemoryLayout::one_block;
        }),
        with([](JobPatterns& p) { p.tracer.workgroup = 32; }), with([](JobPatterns& p) { p.tracer.tile_pixels = 100; }),
        with([](JobPatterns& p) { p.vulkan.recording = RecordingPattern::pre_recorded; }),
        with([](JobPatterns& p) { p.vulkan.recording = RecordingPattern::secondary; }),
        with([](JobPatterns& p) { p.vulkan.reset = ResetPattern::buffer; }),
        with([](JobPatterns& p) { p.vulkan.reset = ResetPattern::free; }),
        with([](JobPatterns& p) { p.vulkan.one_time_submit = false; }),
        with([](JobPatterns& p) { p.vulkan.recording_threads = 3; }),
        with([](JobPatterns& p) { p.vulkan.recordings_per_buffer = 5; }),
        with([](JobPatterns& p) { p.vulkan.submission = SubmissionPattern::many_infos; }),
        with([](JobPatterns& p) { p.vulkan.submission = SubmissionPattern::many_submits; }),
        with([](JobPatterns& p) { p.vulkan.segments_per_submission = 1; }),
        with([](JobPatterns& p) { p.vulkan.wait = WaitPattern::queue_idle; }),
        with([](JobPatterns& p) { p.vulkan.barriers = BarrierPattern::buffer; }),
        with([](JobPatterns& p) { p.vulkan.barriers = BarrierPattern::buffer_apart; }),
        with([](JobPatterns& p) { p.vulkan.barriers = BarrierPattern::full; }),
        with([](JobPatterns& p) { p.vulkan.barriers = BarrierPattern::memory_v2; }),
        with([](JobPatterns& p) { p.vulkan.barriers = BarrierPattern::buffer_v2; }), with([](JobPatterns& p) {
            p.vulkan.barriers =
                BarrierPattern::event;  // the layer does not follow events from command buffer to command buffer
            p.vulkan.recordings_per_buffer = 1000;
        }),
        with([](JobPatterns& p) { p.vulkan.parameters = ParameterPattern::uniform; }),
        with([](JobPatterns& p) { p.vulkan.parameters = ParameterPattern::dynamic_uniform; }),
        with([](JobPatterns& p) { p.vulkan.parameters = ParameterPattern::device_address; }),
        with([](JobPatterns& p) { p.vulkan.parameters = ParameterPattern::specialisation; }),
        with([](JobPatterns& p) { p.vulkan.descriptors = DescriptorPattern::rewritten; }),
        with([](JobPatterns& p) { p.vulkan.descriptors = DescriptorPattern::templates; }),
        with([](JobPatterns& p) { p.vulkan.descriptors = DescriptorPattern::push; }), claiming(64), claiming(320),
        with([](JobPatterns& p) {
            p = claiming(64);
            p.vulkan.recording = RecordingPattern::pre_recorded;
        }),
        with([](JobPatterns& p) {
            p.tracer.kernel = KernelShape::megakernel;
            p.tracer.hit_data = HitDataPattern::shared;
        }),
        with([](JobPatterns& p) {
            p.vulkan.recording = RecordingPattern::secondary;
            p.vulkan.recording_threads = 2;
            p.vulkan.recordings_per_buffer = 2;
            p.vulkan.reset = ResetPattern::buffer;
        })};
}

// Frames in between, new and old, must leave later images as they are.
void check_pattern(Machine& machine, const JobPatterns& patterns, const Estimate& expected) {
    VulkanJob job = job_of(machine, patterns);
    CHECK(same_bits(job.render({0, 70}, {}).estimate, expected));
    CHECK(job.frame(3, true).submissions >= 1);
    (void)job.frame(2);
    CHECK(same_bits(job.render({0, 70}, {}).estimate, expected));
}

}  // namespace

TEST_CASE("no pattern changes the image, and the validation layer finds nothing in any") {
    Machine machine(true);
    const Estimate expected = job_of(machine, {}).render({0, 70}, {}).estimate;
    const std::vector<JobPatterns> all = variants();
    for (std::size_t number = 0; number < all.size(); ++number) {
        CAPTURE(number);
        check_pattern(machine, all[number], expected);
    }
}

// Devices that are no CPU render like this by themselves.
TEST_CASE("claimed pixels and shared copies leave every shipped scene as it is" * doctest::test_suite("full")) {
    Machine machine(true);
    int shared = 0;
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".json") continue;
        const Scene scene = load_scene(entry.path());
        RenderSettings settings = with_longer_side(default_settings(scene), 21);
        settings.bounces = std::min(settings.bounces, 6u);
        CAPTURE(scene.name);
        const auto image = [&](const JobPatterns& patterns) {
            return machine.job(patterns, scene, settings).render({0, 7}, {}).estimate;
        };
        const auto claimed = [&] {
            try {
                Estimate estimate = image(claiming(64));
                ++shared;
                return estimate;
            } catch (const UnsupportedError&) {  // a larger scene
                JobPatterns patterns = claiming(64);
                patterns.tracer.hit_data = HitDataPattern::automatic;
                return image(patterns);
            }
        };
        CHECK(same_bits(claimed(), image({})));
    }
    CHECK(shared >= 12);
}

// What the layer cannot judge, or what Vulkan does not promise: the device gives the image all the same, or has it not.
TEST_CASE("patterns beyond the layer leave the image as it is where the device has them") {
    Machine machine(false);
    const Estimate expected = job_of(machine, {}).render({0, 70}, {}).estimate;
    check_pattern(machine, with([](JobPatterns& p) { p.vulkan.barriers = BarrierPattern::execution; }), expected);
    const auto check_or_refused = [&](const std::function<void(JobPatterns&)>& change, const char* reason) {
        try {
            check_pattern(machine, with(change), expected);
        } catch (const UnsupportedError& refusal) {
            CHECK(std::string(refusal.what()).find(reason) != std::string::npos);
        }
    };
    check_or_refused([](JobPatterns& p) { p.vulkan.descriptors = DescriptorPattern::arrays; }, "DynamicIndexing");
    check_or_refused(
        [](JobPatterns& p) { p.vulkan.descriptors = DescriptorPattern::arrays_nonuniform; }, "NonUniformIndexing");
    check_or_refused(
        [](JobPatterns& p) { p.vulkan.parameters = ParameterPattern::storage; }, "storage buffers, this takes");
}

TEST_CASE("the layer sees that barriers of execution alone are none of memory") {
    Machine machine(true);
    VulkanJob job = job_of(machine, with([](JobPatterns& p) { p.vulkan.barriers = BarrierPattern::execution; }));
    CHECK_THROWS_WITH_AS(static_cast<void>(job.frame(1)), doctest::Contains("READ_AFTER_WRITE"), Error);
}

TEST_CASE("patterns that exclude each other are refused") {
    Machine machine(false);
    const auto refused = [&](const std::function<void(JobPatterns&)>& change) {
        CHECK_THROWS_AS(static_cast<void>(job_of(machine, with(change))), UnsupportedError);
    };
    refused([](JobPatterns& p) {
        p.vulkan.recording = RecordingPattern::pre_recorded;
        p.vulkan.parameters = ParameterPattern::uniform;
    });
    refused([](JobPatterns& p) {
        p.vulkan.recording = RecordingPattern::pre_recorded;
        p.vulkan.barriers = BarrierPattern::event;
    });
    refused([](JobPatterns& p) {
        p.vulkan.parameters = ParameterPattern::uniform;
        p.vulkan.descriptors = DescriptorPattern::arrays;
    });
    refused([](JobPatterns& p) { p.vulkan.queue = {QueueKind::rendering, 99}; });
    refused([](JobPatterns& p) { p.tracer.workgroup = 1u << 20; });
    refused([](JobPatterns& p) { p.tracer.pixels = PixelPattern::claimed; });
    refused([](JobPatterns& p) { p.tracer.hit_data = HitDataPattern::shared; });
    refused([](JobPatterns& p) {
        p.tracer.kernel = KernelShape::megakernel;
        p.vulkan.parameters = ParameterPattern::uniform;
    });
    refused([](JobPatterns& p) { p.tracer.part = 3, p.tracer.parts = 3; });
}

// Synchronisation validation (layer 1.3.239) does not see that the host waited for a timeline semaphore, and takes
// copies in two submissions for a hazard.
TEST_CASE("waiting for timeline semaphores leaves the image as it is") {
    Machine machine(false);
    const Estimate expected = job_of(machine, {}).render({0, 70}, {}).estimate;
    check_pattern(machine, with([](JobPatterns& p) { p.vulkan.wait = WaitPattern::timeline; }), expected);
}

TEST_CASE("a frame counts its submissions and command buffers") {
    Machine machine(false);
    const auto times = [&](const std::function<void(JobPatterns&)>& change) {
        return job_of(machine, with(change)).frame(4);
    };
    // Pre-processing, and sampling and post-processing of each sample.
    const SubmissionTimes plain = times([](JobPatterns&) {});
    CHECK(plain.submissions == 1);
    CHECK(plain.command_buffers == 9);
    CHECK(plain.record > 0.0);
    CHECK(plain.record_cpu > 0.0);
    CHECK(plain.submit > 0.0);
    CHECK(plain.wait > 0.0);
    CHECK(times([](JobPatterns& p) { p.vulkan.recordings_per_buffer = 9; }).command_buffers == 1);
    CHECK(times([](JobPatterns& p) { p.vulkan.segments_per_submission = 5; }).submissions == 4);
    CHECK(times([](JobPatterns& p) { p.vulkan.segments_per_submission = 1; }).submissions == 20);
}

TEST_CASE("pre-recorded frames record once") {
    Machine machine(false);
    VulkanJob job = job_of(machine, with([](JobPatterns& p) { p.vulkan.recording = RecordingPattern::pre_recorded; }));
    // One sample: pre- and post-processing turn the sums over twice, so that the second frame is the first again.
    const double first = job.frame(200).record;
    (void)job.frame(200);
    double again = first;
    for (int i = 0; i < 3; ++i) again = std::min(again, job.frame(200).record);
    CHECK(again < first / 2.0);
}
