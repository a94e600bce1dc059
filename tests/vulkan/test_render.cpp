// The Vulkan renderer as a whole: closed forms, reproducible bits, partial results.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <vector>

#include "common/error.h"
#include "common/render/concurrent_renderer.h"
#include "tests/vulkan/scenes.h"
#include "vulkan/framework/shader_library.h"
#include "vulkan/renderer/kernels/constant_ids.h"
#include "vulkan/renderer/kernels/stages.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

// A closed room of one diffuse emitting material, seen from within; its walls are one cuboid seen from inside.
Scene furnace(double albedo, double radiance) {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0);
    Material material = diffuse(glm::dvec3(albedo));
    material.radiance = glm::dvec3(radiance);
    builder.cuboid(builder.material(material), {-1.0, -1.0, -1.0}, {1.0, 1.5, 2.0});
    return builder.scene();
}

double furnace_answer(double albedo, double radiance, int bounces) {
    return radiance * (1.0 - std::pow(albedo, bounces + 1)) / (1.0 - albedo);
}

}  // namespace

TEST_CASE("every sample of a furnace is the closed form of its depth") {
    constexpr double albedo = 0.8, radiance = 0.5;
    for (const int bounces : {0, 1, 5, 12}) {
        const RenderResult result =
            render(furnace(albedo, radiance), settings_of(16, static_cast<std::uint32_t>(bounces)), 8);
        const double answer = furnace_answer(albedo, radiance, bounces);
        CAPTURE(bounces);
        CHECK(result.estimate.invalid() == 0);
        // D + 1 sums and products of floats.
        const double bound = answer * (2.0 * bounces + 3.0) * 0x1p-23;
        for (const double mean : mean_of(result.estimate)) REQUIRE(std::abs(mean - answer) <= bound);
    }
}

TEST_CASE("jobs that several threads prepare at once render the bits of jobs prepared alone, and the layer is silent") {
    const Scene scene = furnace(0.8, 0.5);
    const auto settings_at = [](std::size_t i) {
        RenderSettings settings = settings_of(16, 5, i % 2 == 0 ? Integrator::path : Integrator::next_event);
        settings.generator = i < 4 ? Generator::philox : Generator::sobol;
        return settings;
    };
    BackendOptions options;
    options.validation = true;
    const auto renderer = vulkan_backend().create(options);
    CHECK(dynamic_cast<ConcurrentRenderer*>(renderer.get()) != nullptr);
    std::vector<std::future<std::unique_ptr<RenderJob>>> making;
    for (std::size_t i = 0; i < 8; ++i)
        making.push_back(std::async(std::launch::async, [&, i] { return renderer->prepare(scene, settings_at(i)); }));
    std::vector<std::unique_ptr<RenderJob>> jobs;
    for (auto& one : making) jobs.push_back(one.get());
    for (std::size_t i = 0; i < jobs.size(); ++i)
        CHECK(same_bits(jobs[i]->render({0, 4}, {}).estimate,
            default_renderer().prepare(scene, settings_at(i))->render({0, 4}).estimate));
}

TEST_CASE("next events leave the furnace as it is") {
    constexpr double albedo = 0.8, radiance = 0.5;
    const RenderResult result = render(furnace(albedo, radiance), settings_of(16, 5, Integrator::next_event), 256);
    const double answer = furnace_answer(albedo, radiance, 5);
    // Six standard errors: a false alarm in 10^8 runs; and the rounding of the closed form's sums.
    CHECK(std::abs(image_mean(result.estimate) - answer) <= 6.0 * standard_error(result.estimate) + answer * 0x1p-19);
}

TEST_CASE("a closed mirror box lets no light in") {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0);
    builder.cuboid(builder.material(mirror(glm::dvec3(0.9))), glm::dvec3(-1.0), glm::dvec3(1.0));
    builder.background(glm::dvec3(1.0), glm::dvec3(1.0));
    // No light inside and no way out: every path ends black after its last bounce.
    const RenderResult closed = render(builder.scene(), settings_of(16, 7), 4);
    for (const double mean : mean_of(closed.estimate)) REQUIRE(mean == 0.0);
}

TEST_CASE("a lamp seen in a mirror is dimmed by the mirror's colour") {
    SceneBuilder builder;
    builder.camera({0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 20.0);
    const std::uint32_t silver = builder.material(mirror({0.5, 0.9, 1.0}));
    builder.quad(silver, {glm::dvec3{-5, -5, -1}, {5, -5, -1}, {5, 5, -1}, {-5, 5, -1}});
    builder.sphere(builder.material(emitter(glm::dvec3(2.0))), {0.0, 0.0, 0.0}, 50.0);
    const RenderResult result = render(builder.scene(), settings_of(16, 3), 4);
    const std::vector<double> mean = mean_of(result.estimate);
    const glm::dvec3 colour{0.5, 0.9, 1.0};
    for (int i = 0; i < 16 * 16 * 3; ++i)
        REQUIRE(mean[static_cast<std::size_t>(i)] == doctest::Approx(2.0 * colour[i % 3]).epsilon(1e-6));
}

TEST_CASE("the same samples give the same bits, however the range is cut at blocks") {
    for (const Integrator integrator : {Integrator::path, Integrator::next_event}) {
        Renderer& renderer = default_renderer();
        const RenderSettings settings = settings_of(16, 6, integrator);
        const Estimate whole = renderer.prepare(full_scene(), settings)->render({0, 256}).estimate;
        const auto job = renderer.prepare(full_scene(), settings);
        Estimate late = job->render({128, 256}).estimate;
        late.merge(job->render({64, 128}).estimate);
        late.merge(job->render({0, 64}).estimate);
        CHECK(whole.count() == 256);
        CHECK(same_bits(whole, late));
    }
}

TEST_CASE("plain sums go on from call to call as within one, and begin anew after one that failed") {
    RenderSettings settings = settings_of(16, 6);
    settings.accumulation = Accumulation::plain;
    const auto new_job = [&] { return default_renderer().prepare(full_scene(), settings); };
    const auto job = new_job();
    std::stop_source stopped;
    stopped.request_stop();
    Estimate parts = job->render({0, 64}).estimate;
    CHECK(job->render({256, 320}, {.stop = stopped.get_token(), .progress = {}}).estimate.count() == 0);
    parts.merge(job->render({64, 192}).estimate);
    parts.merge(job->render({192, 256}).estimate);
    CHECK(same_bits(parts, new_job()->render({0, 256}).estimate));
    const RenderControl failing{.stop = {}, .progress = [](double done) {
                                    if (done > 64.0) throw Error("within the second block");
                                }};
    CHECK_THROWS_AS(static_cast<void>(job->render({256, 384}, failing)), Error);
    CHECK(same_bits(job->render({320, 384}).estimate, new_job()->render({320, 384}).estimate));
}

TEST_CASE("plain sums go on, or begin anew, after a stop as after a call that ended there") {
    RenderSettings settings = settings_of(16, 6);
    settings.accumulation = Accumulation::plain;
    for (const double stop_at : {64.0, 70.0}) {
        CAPTURE(stop_at);
        const auto job = default_renderer().prepare(full_scene(), settings);
        std::stop_source source;
        const RenderControl control{.stop = source.get_token(), .progress = [&](double done) {
                                        if (done >= stop_at) source.request_stop();
                                    }};
        const std::uint64_t count = job->render({0, 256}, control).estimate.count();
        REQUIRE(count >= 64);
        const SampleRange rest{count / 64 * 64, 256};
        const Estimate after_stop = job->render(rest).estimate;
        const auto other = default_renderer().prepare(full_scene(), settings);
        CHECK(other->render({0, count}).estimate.count() == count);
        CHECK(same_bits(after_stop, other->render(rest).estimate));
    }
}

TEST_CASE("another seed gives other samples") {
    const Estimate one = render(full_scene(), settings_of(8, 3), 4).estimate;
    const Estimate other = render(full_scene(), settings_of(8, 3, Integrator::path, 2), 4).estimate;
    CHECK(!same_bits(one, other));
}

TEST_CASE("a range that does not begin at a block is refused") {
    Renderer& renderer = default_renderer();
    const auto job = renderer.prepare(full_scene(), settings_of(4, 1));
    CHECK_THROWS_AS(static_cast<void>(job->render({1, 64})), Error);
}

TEST_CASE("a stop returns the samples finished until then, in the first block or a later one") {
    for (const double stop_at : {3.0, 150.0}) {
        CAPTURE(stop_at);
        const auto job = default_renderer().prepare(full_scene(), settings_of(64, 4));
        std::stop_source source;
        RenderControl control;
        control.stop = source.get_token();
        control.progress = [&](double done) {
            if (done >= stop_at) source.request_stop();
        };
        const Estimate partial = job->render({0, 1000}, control).estimate;
        CHECK(static_cast<double>(partial.count()) >= stop_at);
        CHECK(partial.count() < 1000);
        CHECK(same_bits(partial, job->render({0, partial.count()}).estimate));
    }
}

TEST_CASE("progress grows to the number of samples asked for") {
    Renderer& renderer = default_renderer();
    const auto job = renderer.prepare(full_scene(), settings_of(16, 2));
    double last = 0.0;
    bool grows = true;
    RenderControl control;
    control.progress = [&](double done) {
        grows = grows && done > last;
        last = done;
    };
    static_cast<void>(job->render({0, 100}, control));
    CHECK(grows);
    CHECK(last == 100.0);
}

TEST_CASE("scattering alone and next events have the same mean") {
    const Scene scene = full_scene();
    const Estimate path = render(scene, settings_of(24, 5, Integrator::path, 11), 1024).estimate;
    const Estimate next = render(scene, settings_of(24, 5, Integrator::next_event, 12), 1024).estimate;
    CHECK(path.invalid() + next.invalid() == 0);
    for (int channel = 0; channel < 3; ++channel) {
        const double error = std::hypot(standard_error(path, channel), standard_error(next, channel));
        CAPTURE(channel);
        // Five standard errors of the difference: three tests at 6e-7 each.
        CHECK(std::abs(image_mean(path, channel) - image_mean(next, channel)) <= 5.0 * error);
    }
}

TEST_CASE("roulette leaves the mean as it is") {
    const Scene scene = full_scene();
    RenderSettings settings = settings_of(24, 5, Integrator::next_event, 13);
    const Estimate without = render(scene, settings, 512).estimate;
    settings.roulette_start = 1;
    settings.seed = 14;
    const Estimate with = render(scene, settings, 512).estimate;
    const double error = std::hypot(standard_error(without), standard_error(with));
    CHECK(std::abs(image_mean(without) - image_mean(with)) <= 5.0 * error);
}

TEST_CASE("what the backend does not offer is refused with its reason") {
    BackendOptions options;
    for (const Precision precision : {Precision::double_precision, Precision::mixed}) {
        options.precision = precision;
        options.kernel = "stages";  // hand rays on in float
        const Scene scene = full_scene();
        const RenderSettings settings = settings_of(24, 5, Integrator::next_event, 13);
        CHECK_THROWS_AS(
            static_cast<void>(vulkan_backend().create(options)->prepare(scene, settings)), UnsupportedError);
    }
    options = {};
    options.planted_bug = PlantedBug::cosine_dropped;
    CHECK_THROWS_AS(vulkan_backend().create(options), UnsupportedError);
    options = {};
    options.threads = 3;
    CHECK_THROWS_AS(vulkan_backend().create(options), UnsupportedError);
    options = {};
    options.device = "no such device";
    CHECK_THROWS_AS(vulkan_backend().create(options), DeviceError);
}

namespace {

// Ids of the specialisation constants that a kernel declares.
std::vector<std::uint32_t> constant_ids(Stage stage) {
    constexpr std::uint32_t header_words = 5, decorate = 71, specialisation_id = 1;
    const std::span<const std::uint32_t> words = shader_code(stage);
    std::vector<std::uint32_t> ids;
    for (std::size_t at = header_words; at < words.size(); at += words[at] >> 16)
        if ((words[at] & 0xFFFFu) == decorate && words[at + 2] == specialisation_id) ids.push_back(words[at + 3]);
    return ids;
}

}  // namespace

TEST_CASE("the shaders that users get hold no planted bug") {
    CHECK_FALSE(shaders_hold_planted_bugs());
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        const std::vector<std::uint32_t> ids = constant_ids(static_cast<Stage>(stage));
        CHECK(!ids.empty());
        for (const ConstantId planted : {ConstantId::planted_amount, ConstantId::planted_bug})
            CHECK(std::ranges::count(ids, static_cast<std::uint32_t>(planted)) == 0);
    }
}

TEST_CASE("the host tells every constant that a kernel declares, once") {
    const std::vector<SpecialisationConstant> told = Specialisation{}.constants();
    for (std::size_t stage = 0; stage < stage_count; ++stage)
        for (const std::uint32_t id : constant_ids(static_cast<Stage>(stage))) {
            CAPTURE(stage_names[stage]);
            CAPTURE(id);
            CHECK(std::ranges::count(told, id, &SpecialisationConstant::id) == 1);
        }
}

TEST_CASE("a camera without a frame is refused") {
    Scene scene = full_scene();
    scene.camera.target = scene.camera.position;
    CHECK_THROWS_AS(static_cast<void>(render(scene, settings_of(4, 1), 1)), UnsupportedError);
}

TEST_CASE("specialised and general kernels give the same bits in every precision" * doctest::test_suite("full")) {
    const Scene scene = full_scene();
    RenderSettings settings = settings_of(8, 4, Integrator::next_event, 17);
    for (const Precision precision : {Precision::double_precision, Precision::mixed}) {
        BackendOptions options;
        options.precision = precision;
        const auto renderer = vulkan_backend().create(options);
        settings.effects.reset();
        const std::vector<double> lean = mean_of(renderer->prepare(scene, settings)->render({0, 4}).estimate);
        settings.effects = EffectSet::all();
        const std::vector<double> general = mean_of(renderer->prepare(scene, settings)->render({0, 4}).estimate);
        CHECK(lean == general);
    }
}

TEST_CASE("an empty scene shows its background") {
    SceneBuilder builder;
    builder.camera({0, 0, 0}, {0, 0, -1}).background({0.25, 0.5, 1.0}, {0.25, 0.5, 1.0});
    const std::vector<double> mean = mean_of(render(builder.scene(), settings_of(4, 3), 2).estimate);
    for (std::size_t i = 0; i < mean.size(); i += 3) {
        CHECK(mean[i] == 0.25);
        CHECK(mean[i + 1] == 0.5);
        CHECK(mean[i + 2] == 1.0);
    }
}
