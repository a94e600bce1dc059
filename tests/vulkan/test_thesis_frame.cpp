// The thesis's frame: its recordings, the image that it ends in, and that its sums have the bits of every other shape.
#include <doctest/doctest.h>

#include <array>
#include <cstring>

#include "common/error.h"
#include "tests/thorough.h"
#include "tests/vulkan/machine.h"
#include "vulkan/command/barrier.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

JobPatterns thesis_patterns(
    BufferPlacement scene = BufferPlacement::host_visible, ParameterPattern parameters = ParameterPattern::uniform) {
    JobPatterns patterns;
    patterns.tracer.kernel = KernelShape::thesis;
    patterns.vulkan.scene = scene;
    patterns.vulkan.parameters = parameters;
    return patterns;
}

// An image of floats for frames to end in, and what they leave there.
class Screen {
public:
    Screen(const Device& device, const RenderSettings& settings)
        : device_(device),
          image_(device, {.size = {settings.width, settings.height},
                             .format = vk::Format::eR32G32B32A32Sfloat,
                             .usage = vk::ImageUsageFlagBits::eStorage | vk::ImageUsageFlagBits::eTransferSrc}) {}

    [[nodiscard]] FrameTarget target() const {
        return {image_.handle(), image_.view(), unused_image, copied_from, {}, {}};
    }
    // Three channels a pixel.
    [[nodiscard]] std::vector<float> pixels() const {
        const vk::Extent2D size = image_.spec().size;
        const std::size_t count = std::size_t{size.width} * size.height;
        const BufferSpec spec{count * 4 * sizeof(float), vk::BufferUsageFlagBits::eTransferDst};
        const BufferGroup host(device_, MemoryDomain::readback, std::span(&spec, 1));
        Submission submission(device_, {});
        submission.add({}, [&](const vk::raii::CommandBuffer& commands) {
            commands.copyImageToBuffer(image_.handle(), vk::ImageLayout::eTransferSrcOptimal, host[0],
                vk::BufferImageCopy(0, 0, 0, first_layer, {}, {size.width, size.height, 1}));
            barrier(commands, transfer_write, host_read);
        });
        (void)submission.run();
        std::vector<float> all(4 * count), colours;
        std::memcpy(all.data(), host.mapped(0), spec.bytes);
        for (std::size_t i = 0; i < all.size(); ++i)
            if (i % 4 < 3) colours.push_back(all[i]);
        return colours;
    }

private:
    const Device& device_;
    DeviceImage image_;
};

// Means are sums, rounded to float, and a division, which Vulkan rounds to 2.5 units in the last place.
void check_means(const std::vector<float>& pixels, const Estimate& expected) {
    const std::vector<double> means = mean_of(expected);
    REQUIRE(pixels.size() == means.size());
    double largest = 0.0;
    for (std::size_t i = 0; i < means.size(); ++i) {
        CHECK(double{pixels[i]} == doctest::Approx(means[i]).epsilon(4.0 * 0x1p-24));
        largest = std::max(largest, means[i]);
    }
    CHECK(largest > 0.0);
}

}  // namespace

TEST_CASE("the thesis's frame has a recording a sample and two more, and shows the mean of all samples of a scene") {
    Machine machine(true);
    const RenderSettings settings = settings_of(13, 4, Integrator::next_event);
    const auto expected = [&](std::uint64_t samples) {
        return machine.job({}, foggy_scene(), settings).render({0, samples}, {}).estimate;
    };
    for (const ParameterPattern parameters : {ParameterPattern::push_constants, ParameterPattern::uniform})
        for (const unsigned threads : {1u, 8u}) {
            JobPatterns patterns = thesis_patterns(BufferPlacement::host_visible, parameters);
            patterns.vulkan.recording_threads = threads;
            VulkanJob job = machine.job(patterns, foggy_scene(), settings);
            const Screen screen(machine.device, settings);
            job.show_in(screen.target());
            CHECK(job.frame(3, true).command_buffers == 5);
            check_means(screen.pixels(), expected(3));
            CHECK(job.frame(2).command_buffers == 4);  // of the same scene
            check_means(screen.pixels(), expected(5));
            CHECK(job.frame(4, true).command_buffers == 6);  // of a new one
            check_means(screen.pixels(), expected(4));
            // A render leaves other sums.
            CHECK(same_bits(job.render({0, 2}, {}).estimate, expected(2)));
            (void)job.frame(2);
            check_means(screen.pixels(), expected(2));
        }
}

TEST_CASE("pre-recorded, the thesis's frame shows the same samples each time, in any image") {
    Machine machine(true);
    const RenderSettings settings = settings_of(13, 4);
    JobPatterns patterns = thesis_patterns(BufferPlacement::host_visible, ParameterPattern::push_constants);
    patterns.vulkan.recording = RecordingPattern::pre_recorded;
    VulkanJob job = machine.job(patterns, full_scene(), settings);
    const Estimate expected = machine.job({}, full_scene(), settings).render({0, 3}, {}).estimate;
    const Screen one(machine.device, settings), other(machine.device, settings);
    for (const Screen* screen : {&one, &other, &one}) {
        job.show_in(screen->target());
        (void)job.frame(3);
        check_means(screen->pixels(), expected);
    }
}

TEST_CASE("wherever scene and settings lie, the thesis's frame has the bits of the other shapes" *
          doctest::test_suite("full")) {
    Machine machine(true);
    for (const Accumulation accumulation : {Accumulation::compensated, Accumulation::in_double, Accumulation::plain}) {
        RenderSettings settings = settings_of(13, 4, Integrator::next_event);
        settings.accumulation = accumulation;
        settings.roulette_start = 2;
        const Estimate expected = machine.job({}, foggy_scene(), settings).render({0, 70}, {}).estimate;
        constexpr std::array placements{
            BufferPlacement::host_visible, BufferPlacement::mapped, BufferPlacement::device_local};
        constexpr std::array ways{
            ParameterPattern::push_constants, ParameterPattern::uniform, ParameterPattern::dynamic_uniform};
        for (std::size_t i = 0; i < placements.size(); ++i)
            for (std::size_t j = 0; j < ways.size(); ++j) {
                if (i != j && !test::thorough()) continue;
                VulkanJob job = machine.job(thesis_patterns(placements[i], ways[j]), foggy_scene(), settings);
                CHECK(same_bits(job.render({0, 70}, {}).estimate, expected));
            }
    }
}

TEST_CASE("a stop leaves the thesis's frame whole samples, though its paths add to the sums as they end") {
    Machine machine(true);
    const RenderSettings settings = settings_of(96, 6);  // more pixels than a first submission has
    VulkanJob job = machine.job(thesis_patterns(), full_scene(), settings);
    std::stop_source source;
    const RenderControl control{.stop = source.get_token(), .progress = [&](double) { source.request_stop(); }};
    const Estimate estimate = job.render({0, 64}, control).estimate;
    CHECK(estimate.count() == 1);
    CHECK(same_bits(estimate, machine.job({}, full_scene(), settings).render({0, 1}, {}).estimate));
}

TEST_CASE("tiles of the thesis's frame, and images for other shapes, are refused") {
    Machine machine(false);
    const RenderSettings settings = settings_of(16, 2);
    JobPatterns tiles = thesis_patterns();
    tiles.tracer.tile_pixels = 100;
    VulkanJob tiled = machine.job(tiles, full_scene(), settings);
    CHECK_THROWS_WITH_AS(
        static_cast<void>(tiled.frame(1)), doctest::Contains("the whole image at once"), UnsupportedError);
    const Screen screen(machine.device, settings);
    CHECK_THROWS_WITH_AS(machine.job({}, full_scene(), settings).show_in(screen.target()),
        doctest::Contains("use the thesis's"), UnsupportedError);
}
