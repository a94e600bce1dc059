// The shapes of the kernels: every one gives the bits of the six stages, in one go or cut into pieces.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/vulkan/scenes.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

Estimate image(const std::string& kernel, const Scene& scene, const RenderSettings& settings, SampleRange range) {
    return renderer_with_kernel(kernel).prepare(scene, settings)->render(range).estimate;
}

bool shapes_agree(const Scene& scene, const RenderSettings& settings, SampleRange range) {
    return same_bits(image("stages", scene, settings, range), image("megakernel", scene, settings, range));
}

JobFacts facts(const std::string& kernel) {
    return renderer_with_kernel(kernel).prepare(foggy_scene(), settings_of(8, 2, Integrator::next_event))->facts();
}

}  // namespace

TEST_CASE("the megakernel, its own for a scene and the general one, renders shipped scenes to the bits of six stages" *
          doctest::test_suite("full")) {
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".json") continue;
        const Scene scene = load_scene(entry.path());
        RenderSettings settings = with_longer_side(default_settings(scene), 21);  // no multiple of the pixel blocks
        settings.bounces = std::min(settings.bounces, 6u);
        CAPTURE(scene.name);
        const Estimate stages = image("stages", scene, settings, {0, 7});
        CHECK(same_bits(stages, image("megakernel", scene, settings, {0, 7})));
        settings.effects = EffectSet::all();
        CHECK(same_bits(stages, image("megakernel", scene, settings, {0, 7})));
    }
}

TEST_CASE("the megakernel renders every effect by every integrator to the bits of the six stages" *
          doctest::test_suite("full")) {
    for (const Integrator integrator : {Integrator::path, Integrator::next_event, Integrator::whitted})
        for (const Scene& scene : {full_scene(), outdoor_scene(integrator != Integrator::path), foggy_scene()}) {
            RenderSettings settings = settings_of(13, 5, integrator);
            settings.roulette_start = integrator == Integrator::next_event ? 2u : no_roulette;
            // Beyond 2^32 samples, over the end of a block and into a ragged one.
            constexpr std::uint64_t far = std::uint64_t{5} << 32;
            CHECK(shapes_agree(scene, settings, {far + 64, far + 133}));
        }
    RenderSettings settings = settings_of(13, 5, Integrator::next_event);
    settings.effects = EffectSet::all();
    CHECK(shapes_agree(full_scene(), settings, {0, 3}));
}

TEST_CASE("dispatches over the whole image, and fragments, give the bits of the wavefront") {
    RenderSettings settings = settings_of(13, 4, Integrator::next_event);
    settings.roulette_start = 2;
    const Scene scene = foggy_scene();  // everything that a path can carry
    const Estimate expected = image("stages", scene, settings, {0, 70});
    for (const char* kernel : {"image-stages", "fragment", "thesis"}) {
        CAPTURE(kernel);
        CHECK(same_bits(image(kernel, scene, settings, {0, 70}), expected));
    }
}

TEST_CASE("every shape of kernel gives the bits of the stages through a pixel filter" * doctest::test_suite("full")) {
    for (const PixelFilter filter : {PixelFilter::tent, PixelFilter::gaussian}) {
        CAPTURE(pixel_filter_names[static_cast<std::size_t>(filter)]);
        RenderSettings settings = settings_of(9, 3, Integrator::next_event);
        settings.filter = filter;
        const Scene scene = full_scene();
        const Estimate expected = image("stages", scene, settings, {0, 20});
        for (const char* kernel : {"megakernel", "image-stages", "fragment", "thesis"}) {
            CAPTURE(kernel);
            CHECK(same_bits(image(kernel, scene, settings, {0, 20}), expected));
        }
        settings.filter = PixelFilter::box;
        CHECK_FALSE(same_bits(image("stages", scene, settings, {0, 20}), expected));
    }
}

TEST_CASE("a stop leaves the megakernel's whole samples") {
    const auto job = renderer_with_kernel("megakernel").prepare(full_scene(), settings_of(200, 4));
    std::stop_source source;
    RenderControl control;
    control.stop = source.get_token();
    double last = 0.0;
    bool grows = true;
    control.progress = [&](double done) {
        grows = grows && done > last;
        last = done;
        if (done >= 3.0) source.request_stop();
    };
    const Estimate partial = job->render({0, 1000}, control).estimate;
    CHECK(grows);
    CHECK(partial.count() >= 3);
    CHECK(partial.count() < 1000);
    CHECK(static_cast<double>(partial.count()) == last);
    CHECK(same_bits(partial, image("stages", full_scene(), settings_of(200, 4), {0, partial.count()})));
}

TEST_CASE("the megakernel keeps no path in buffers") {
    const JobFacts stages = facts("stages"), megakernel = facts("megakernel");
    CHECK(stages.kernels.size() == 6);
    CHECK(megakernel.kernels.size() == 2);
    CHECK(stages.bytes_per_path == 6 * 16 + 16);  // six vectors, and eight bodies of 16 bits
    CHECK(megakernel.bytes_per_path == 0);
    const std::set<std::string> of_paths{"ray-origins", "ray-directions", "throughputs", "gathered-radiances",
        "next-event-contributions", "hits", "shadow-rays", "samples", "interiors", "ray-queues"};
    const auto kept = [&](const JobFacts& facts) {
        return std::ranges::count_if(
            facts.buffers, [&](const JobFacts::Part& part) { return of_paths.contains(part.name); });
    };
    CHECK(kept(stages) == static_cast<std::ptrdiff_t>(of_paths.size()));
    CHECK(kept(megakernel) == 0);
}

TEST_CASE("a job tells of the kernels that it dispatches: its shape's, and its way's of adding samples up" *
          doctest::test_suite("full")) {
    const auto instructions = [](const std::string& shape, Accumulation accumulation, const std::string& kernel) {
        RenderSettings settings = settings_of(8, 2, Integrator::next_event);
        settings.accumulation = accumulation;
        const JobFacts facts = renderer_with_kernel(shape).prepare(foggy_scene(), settings)->facts();
        const auto found = std::ranges::find(facts.kernels, kernel, &JobFacts::Part::name);
        REQUIRE(found != facts.kernels.end());
        return found->amount;
    };
    for (const auto& [shape, kernel] :
        {std::pair{"stages", "post-process"}, {"megakernel", "megakernel"}, {"fragment", "fragment"}}) {
        CAPTURE(shape);
        const std::uint64_t pairs = instructions(shape, Accumulation::compensated, kernel);
        // Neither has rests to keep, and one of them adds in another type.
        CHECK(instructions(shape, Accumulation::in_double, kernel) < pairs);
        CHECK(instructions(shape, Accumulation::plain, kernel) < pairs);
        CHECK(instructions(shape, Accumulation::in_double, kernel) != instructions(shape, Accumulation::plain, kernel));
    }
    // Rays that stay in their places need no queue.
    CHECK(instructions("image-stages", Accumulation::compensated, "scatter") !=
          instructions("stages", Accumulation::compensated, "scatter"));
}

// Lavapipe leaves loops after 65535 turns: such paths are refused, and never come out short.
TEST_CASE("paths of so many segments that no kernel could stop within them are refused, or go by stages") {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0);
    Material white = diffuse(glm::dvec3(1.0));
    white.radiance = glm::dvec3(0.5);
    builder.cuboid(builder.material(white), glm::dvec3(-1.0), glm::dvec3(1.0));
    for (const char* kernel : {"megakernel", "fragment"}) {
        Renderer& renderer = renderer_with_kernel(kernel);
        CHECK_THROWS_WITH_AS(static_cast<void>(renderer.prepare(builder.scene(), settings_of(2, 99'999))),
            doctest::Contains("use --kernel stages or at most 16382 bounces"), UnsupportedError);
        const auto job = renderer.prepare(builder.scene(), settings_of(2, 16'382));
        for (const double mean : mean_of(job->render({0, 1}).estimate)) CHECK(mean == 8191.5);  // sums of 0.5 are exact
        RenderSettings roulette = settings_of(2, 99'999);  // ends no path where nothing is absorbed
        roulette.roulette_start = 2;
        CHECK_THROWS_AS(static_cast<void>(renderer.prepare(builder.scene(), roulette)), UnsupportedError);
    }
    const auto usual = vulkan_backend().create({});
    const auto job = usual->prepare(builder.scene(), settings_of(2, 19'999));
    for (const double mean : mean_of(job->render({0, 1}).estimate)) CHECK(mean == 10'000.0);
}

TEST_CASE("an unknown kernel shape is refused, naming those there are") {
    BackendOptions options;
    options.kernel = "octopus";
    CHECK_THROWS_WITH_AS(static_cast<void>(vulkan_backend().create(options)),
        "--kernel: no kernel shape 'octopus'; choose one of stages, megakernel, image-stages, fragment, ray-tracing, "
        "thesis, ray-tracing-triangles, ray-query, ray-query-triangles",
        InputError);
}
