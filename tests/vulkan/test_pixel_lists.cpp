// Passes of adaptive sampling: lists of pixels (RenderJob::render_pixels).
#include <doctest/doctest.h>

#include "common/error.h"
#include "tests/vulkan/machine.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

std::vector<std::uint32_t> some_pixels(std::uint32_t count) {
    std::vector<std::uint32_t> list;
    for (std::uint32_t pixel = 1; pixel < count; pixel += 1 + pixel % 5) list.push_back(pixel);
    return list;
}

bool has_bits_of(const Estimate& list, const std::vector<std::uint32_t>& pixels, const Estimate& image) {
    const Estimate::Plane some = list.totals(), all = image.totals();
    bool same = list.width() == pixels.size() && list.height() == 1 && list.ranges() == image.ranges();
    for (std::size_t i = 0; i < some.size(); ++i) {
        const Moments& of_image = all[std::size_t{pixels[i / channel_count]} * channel_count + i % channel_count];
        same = same && some[i].sum == of_image.sum && some[i].sum_of_squares == of_image.sum_of_squares;
    }
    return same;
}

RenderSettings adaptive(const Scene& scene) {
    RenderSettings settings = settings_of(13, 4, scene.lights.empty() ? Integrator::path : Integrator::next_event);
    settings.sampling = Sampling::adaptive;
    return settings;
}

}  // namespace

TEST_CASE("a list of pixels has the bits that the image has there, in every shape of kernel and between images" *
          doctest::test_suite("full")) {
    const std::vector<std::uint32_t> pixels = some_pixels(13 * 13), last{13 * 13 - 1};
    const auto check = [&](const Scene& scene, std::initializer_list<const char*> kernels) {
        RenderSettings uniform = adaptive(scene);
        uniform.sampling = Sampling::uniform;
        const Estimate image = renderer_with_kernel("stages").prepare(scene, uniform)->render({64, 131}).estimate;
        for (const char* kernel : kernels) {
            CAPTURE(kernel);
            const auto job = renderer_with_kernel(kernel).prepare(scene, adaptive(scene));
            CHECK(has_bits_of(job->render_pixels({64, 131}, pixels).estimate, pixels, image));
            CHECK(same_bits(job->render({64, 131}).estimate, image));
            CHECK(has_bits_of(job->render_pixels({64, 131}, last).estimate, last, image));
        }
    };
    check(outdoor_scene(true),
        {"stages", "image-stages", "megakernel", "thesis"});  // where intersection depends on the pixel's time
    check(foggy_scene(), {"stages"});
}

TEST_CASE("lists are cut into tiles like images, and the layers find nothing") {
    Machine machine(true);
    JobPatterns patterns;
    patterns.tracer.tile_pixels = 20;
    const Scene scene = full_scene();
    VulkanJob whole = machine.job({}, scene, adaptive(scene)), cut = machine.job(patterns, scene, adaptive(scene));
    const std::vector<std::uint32_t> pixels = some_pixels(13 * 13);
    REQUIRE(pixels.size() > 2 * patterns.tracer.tile_pixels);
    const Estimate image = whole.render({0, 67}, {}).estimate;
    CHECK(has_bits_of(whole.render_pixels({0, 67}, pixels, {}).estimate, pixels, image));
    CHECK(has_bits_of(cut.render_pixels({0, 67}, pixels, {}).estimate, pixels, image));
}

TEST_CASE("blocks of a short list are rendered side by side, with the bits of one after the other") {
    Machine machine(true);
    const Scene scene = full_scene();
    const std::vector<std::uint32_t> pixels{3, 17, 80, 81, 168};
    const auto check = [&](const JobPatterns& patterns, SampleRange range) {
        RenderSettings settings = adaptive(scene);
        const Estimate image = machine.job({}, scene, settings).render(range, {}).estimate;
        VulkanJob job = machine.job(patterns, scene, settings);
        CHECK(has_bits_of(job.render_pixels(range, pixels, {}).estimate, pixels, image));
    };
    JobPatterns wide;
    wide.tracer.kernel = KernelShape::megakernel;
    check(wide, {64, 7 * 64 + 3});
    JobPatterns narrow = wide;
    narrow.tracer.tile_pixels = 13;  // two blocks at once
    check(narrow, {0, 3 * 64});
    // After a stop, of blocks side by side the first alone is left where they are not whole.
    for (const double stop_at : {1.0, 66.0}) {
        VulkanJob job = machine.job(wide, scene, adaptive(scene));
        std::stop_source source;
        const RenderControl control{.stop = source.get_token(), .progress = [&](double done) {
                                        if (done >= stop_at) source.request_stop();
                                    }};
        const Estimate cut = job.render_pixels({0, 7 * 64 + 3}, pixels, control).estimate;
        REQUIRE(cut.count() > 0);
        CHECK(cut.ranges() == std::vector<SampleRange>{{0, cut.count()}});
        CHECK(has_bits_of(cut, pixels, machine.job({}, scene, adaptive(scene)).render({0, cut.count()}, {}).estimate));
    }
    // Where the low words of the samples' numbers are over.
    constexpr std::uint64_t over = std::uint64_t{1} << 32;
    check(wide, {over - 2 * 64, over + 2 * 64});
}

TEST_CASE("jobs for uniform sampling have no room for lists, and say so") {
    RenderSettings settings = settings_of(8, 2);
    const auto job = default_renderer().prepare(full_scene(), settings);
    const std::vector<std::uint32_t> pixels{1, 2};
    CHECK_THROWS_AS(static_cast<void>(job->render_pixels({0, 1}, pixels)), UnsupportedError);
    const auto has_list = [](const JobFacts& facts) {
        return std::ranges::any_of(facts.buffers, [](const JobFacts::Part& part) { return part.name == "pixel-list"; });
    };
    CHECK_FALSE(has_list(job->facts()));
    settings.sampling = Sampling::adaptive;
    CHECK(has_list(default_renderer().prepare(full_scene(), settings)->facts()));
    CHECK_THROWS_WITH_AS(static_cast<void>(renderer_with_kernel("fragment").prepare(full_scene(), settings)),
        doctest::Contains("--kernel"), UnsupportedError);
    settings.generator = Generator::sobol;
    CHECK_THROWS_WITH_AS(static_cast<void>(default_renderer().prepare(full_scene(), settings)),
        doctest::Contains("Sobol"), UnsupportedError);
}
