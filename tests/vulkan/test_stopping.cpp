// Work between two looks at a wish to stop: how large it is, and that cutting work up changes no bit.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>

#include "common/error.h"
#include "common/stopwatch.h"
#include "tests/vulkan/machine.h"
#include "vulkan/renderer/kernels/megakernel_plan.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

// No way out and nothing absorbed: every path has as many segments as it may have.
Scene closed_box() {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0);
    builder.cuboid(builder.material(diffuse(glm::dvec3(1.0))), glm::dvec3(-1.0), glm::dvec3(1.0));
    return builder.scene();
}

JobPatterns with_kernel(KernelShape kernel) {
    JobPatterns patterns;
    patterns.tracer.kernel = kernel;
    return patterns;
}

// Whether it ends within so many seconds, one time of two: the machine may be away during the other.
bool ends_within(double seconds, const std::function<void()>& run) {
    for (int i = 0; i < 2; ++i) {
        const Stopwatch watch;
        run();
        if (watch.seconds() < seconds) return true;
    }
    return false;
}

// Sums of samples [0, samples), each block's paths segment by segment in one submission.
Estimate in_whole_samples(
    Machine& machine, KernelShape kernel, const Scene& scene, const RenderSettings& settings, std::uint64_t samples) {
    JobPatterns patterns = with_kernel(kernel);
    patterns.vulkan.segments_per_submission = settings.bounces + 1;
    return machine.job(patterns, scene, settings).render({0, samples}, {}).estimate;
}

}  // namespace

TEST_CASE("a stop is heeded within the first sample, however long its paths are") {
    Machine machine(false);
    for (const KernelShape kernel : {KernelShape::stages, KernelShape::image_stages}) {
        VulkanJob job = machine.job(with_kernel(kernel), closed_box(), settings_of(128, 1'000'000));
        CHECK(ends_within(10.0, [&] {
            std::stop_source source;
            unsigned looks = 0;
            const RenderControl control{.stop = source.get_token(), .progress = [&](double done) {
                                            CHECK(done < 1e-3);
                                            if (++looks == 3) source.request_stop();
                                        }};
            CHECK(job.render({0, 64}, control).estimate.count() == 0);
            CHECK(looks == 3);  // nothing is submitted after the wish
        }));
        // What was dropped leaves nothing behind.
        const RenderSettings few = settings_of(128, 3);  // the first of several runs is dropped
        VulkanJob other = machine.job(with_kernel(kernel), full_scene(), few);
        std::stop_source at_once;
        const RenderControl stopped{.stop = at_once.get_token(), .progress = [&](double) { at_once.request_stop(); }};
        (void)other.render({0, 64}, stopped);
        CHECK(same_bits(other.render({0, 8}, {}).estimate, in_whole_samples(machine, kernel, full_scene(), few, 8)));
    }
}

TEST_CASE("a sample that is cut into runs of pixels has the bits of one that is not") {
    Machine machine(true);
    for (const KernelShape kernel : {KernelShape::stages, KernelShape::image_stages})
        for (const bool moves : {false, true}) {
            // More pixels than a first run has.
            const RenderSettings settings = settings_of(96, 6, Integrator::next_event);
            const Scene scene = moves ? outdoor_scene(true) : foggy_scene();
            VulkanJob job = machine.job(with_kernel(kernel), scene, settings);
            unsigned within_sample = 0;
            const RenderControl control{.stop = {}, .progress = [&](double done) { within_sample += done < 1.0; }};
            const Estimate cut = job.render({0, 3}, control).estimate;
            CHECK(within_sample >= 2);
            CHECK(same_bits(cut, in_whole_samples(machine, kernel, scene, settings, 3)));
        }
}

TEST_CASE("paths that have all ended leave the rest of a high bounce limit out, and the bits as they are") {
    Machine machine(true);
    // 257 segments are asked about. All light is gathered on the way.
    const RenderSettings settings = settings_of(24, 700, Integrator::next_event);
    VulkanJob job = machine.job(with_kernel(KernelShape::stages), full_scene(), settings);
    CHECK(same_bits(
        job.render({0, 5}, {}).estimate, in_whole_samples(machine, KernelShape::stages, full_scene(), settings, 5)));

    VulkanJob open = machine.job(with_kernel(KernelShape::stages), full_scene(), settings_of(24, 1'000'000));
    // Sixteen million empty dispatches took minutes.
    CHECK(ends_within(60.0, [&] { CHECK(open.render({0, 16}, {}).estimate.count() == 16); }));
}

TEST_CASE("invalid samples of what a stop drops are not counted") {
    Machine machine(true);
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0);
    Material dazzling = diffuse(glm::dvec3(1.0));
    dazzling.radiance = glm::dvec3(3e38);  // twice that is infinite
    builder.cuboid(builder.material(dazzling), glm::dvec3(-1.0), glm::dvec3(1.0));
    const Scene scene = builder.scene();
    for (const KernelShape kernel : {KernelShape::stages, KernelShape::megakernel, KernelShape::fragment})
        for (const double stop_at : {1e-9, 1.01})
            for (const std::uint32_t tile : {0u, 10'000u}) {
                CAPTURE(static_cast<int>(kernel));
                CAPTURE(stop_at);
                CAPTURE(tile);
                JobPatterns patterns = with_kernel(kernel);
                patterns.tracer.tile_pixels = tile;
                if (tile > 0 && kernel == KernelShape::fragment) continue;
                VulkanJob job = machine.job(patterns, scene, settings_of(128, 300));
                std::stop_source source;
                bool within = false;
                const RenderControl control{.stop = source.get_token(), .progress = [&](double done) {
                                                if (done < stop_at) return;
                                                within = within || done != std::floor(done);
                                                source.request_stop();
                                            }};
                const Estimate cut = job.render({0, 64}, control).estimate;
                CHECK((within || stop_at > 1.0));  // later shares may be whole samples; else nothing was dropped
                CHECK(cut.invalid() == cut.count() * 128 * 128);
                CHECK(job.render({0, 1}, {}).estimate.invalid() == 128 * 128);
            }
}

TEST_CASE("invalid samples of a render that failed are not counted by the next one") {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0);
    Material dazzling = diffuse(glm::dvec3(1.0));
    dazzling.radiance = glm::dvec3(3e38);  // twice that is infinite
    builder.cuboid(builder.material(dazzling), glm::dvec3(-1.0), glm::dvec3(1.0));
    Machine machine(true);
    VulkanJob job = machine.job({}, builder.scene(), settings_of(16, 300));
    const RenderControl failing{.stop = {}, .progress = [](double done) {
                                    if (done > 1.0) throw Error("after a whole sample");
                                }};
    CHECK_THROWS_AS(static_cast<void>(job.render({0, 128}, failing)), Error);
    CHECK(job.render({0, 1}, {}).estimate.invalid() == 16 * 16);
}

TEST_CASE("tiles that share buffers keep what every pixel has at a stop") {
    Machine machine(true);
    for (const KernelShape kernel : {KernelShape::stages, KernelShape::megakernel, KernelShape::image_stages})
        for (const Accumulation accumulation : {Accumulation::compensated, Accumulation::in_double})
            for (const RecordingPattern recording : {RecordingPattern::on_the_fly, RecordingPattern::pre_recorded}) {
                JobPatterns patterns = with_kernel(kernel);
                patterns.tracer.tile_pixels = 100;
                patterns.vulkan.recording = recording;
                RenderSettings settings = settings_of(20, 3);
                settings.accumulation = accumulation;
                VulkanJob job = machine.job(patterns, full_scene(), settings);
                std::stop_source source;
                const RenderControl control{.stop = source.get_token(), .progress = [&](double done) {
                                                if (done >= 9.5) source.request_stop();
                                            }};
                const Estimate estimate = job.render({0, 64}, control).estimate;
                CHECK(estimate.count() == 8);
                VulkanJob whole = machine.job(with_kernel(kernel), full_scene(), settings);
                CHECK(same_bits(estimate, whole.render({0, 8}, {}).estimate));
                const Estimate expected = whole.render({0, 70}, {}).estimate;
                CHECK(same_bits(job.render({0, 70}, {}).estimate, expected));
                // Also where it goes on from there, and after stops between two tiles, which bring no more.
                Estimate begun = estimate;
                const bool goes_on = accumulation == Accumulation::in_double;
                for (int stops = 0; stops < 3; ++stops) {
                    source = std::stop_source();
                    const RenderControl stopped{.stop = source.get_token(),
                        .progress =
                            [&](double done) {
                                CHECK((done > 8.0 || !goes_on));
                                if (done >= 10.0) source.request_stop();
                            },
                        .begun = &begun};
                    CHECK(job.render({0, 70}, stopped).estimate.count() == (goes_on ? 0 : 8));
                }
                const RenderControl going_on{.stop = {}, .progress = {}, .begun = &begun};
                CHECK(same_bits(job.render({0, 70}, going_on).estimate, expected));
                // A job that has rendered nothing yet renders all of them.
                begun = estimate;
                VulkanJob other = machine.job(patterns, full_scene(), settings);
                CHECK(same_bits(other.render({0, 70}, going_on).estimate, expected));
                CHECK(begun.count() == 8);
            }
}

TEST_CASE("the first dispatch of whole paths is the smaller the longer they may be") {
    for (const DeviceType type : {DeviceType::cpu, DeviceType::discrete}) {
        DeviceDescription device;
        device.type = type;
        device.abilities.resident_invocations = type == DeviceType::discrete ? 270'336 : 0;
        const auto first = [&](std::uint32_t segments) {
            MegakernelPlan plan(device, segments);
            plan.begin(1u << 30, 64);
            return std::uint64_t{plan.next().invocations};
        };
        CHECK(first(13) == first(1));
        CHECK(first(130) * 130 <= first(13) * 13);
        CHECK(first(1'000'001) < 1000);
    }
}
