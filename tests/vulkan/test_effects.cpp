// Kernels specialised to what a scene calls for against general ones: the same bits.
#include <doctest/doctest.h>

#include <filesystem>
#include <map>

#include "common/error.h"
#include "common/render/effects.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/thorough.h"
#include "tests/vulkan/scenes.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

Estimate image(const Scene& scene, RenderSettings settings, EffectSet effects) {
    settings.effects = effects;
    return default_renderer().prepare(scene, settings)->render({0, 4}).estimate;
}

// Whether the images of the scene's own effects and of all have the same bits.
bool specialised_is_general(const Scene& scene, const RenderSettings& settings) {
    return same_bits(image(scene, settings, needed_effects(scene, settings)), image(scene, settings, EffectSet::all()));
}

}  // namespace

TEST_CASE(
    "general kernels render the shipped scenes to the same bits as specialised ones" * doctest::test_suite("full")) {
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".json") continue;
        const Scene scene = load_scene(entry.path());
        RenderSettings settings = with_longer_side(default_settings(scene), 24);
        settings.bounces = std::min(settings.bounces, 6u);
        CAPTURE(scene.name);
        CHECK(specialised_is_general(scene, settings));
    }
}

TEST_CASE("general kernels render scenes of every effect to the same bits by every integrator" *
          doctest::test_suite("full")) {
    EffectSet seen;
    for (const Integrator integrator : {Integrator::path, Integrator::next_event, Integrator::whitted})
        for (const Scene& scene : {full_scene(), outdoor_scene(integrator != Integrator::path), foggy_scene()}) {
            RenderSettings settings = settings_of(16, 5, integrator);
            settings.roulette_start = integrator == Integrator::next_event ? 2u : no_roulette;
            CHECK(specialised_is_general(scene, settings));
            seen = seen.united(needed_effects(scene, settings));
        }
    CHECK(effect_names(EffectSet::all().without(seen)) == "");
}

TEST_CASE("kernels of one effect more than a scene needs, whichever, render it to the same bits") {
    const Scene scene = full_scene();
    const RenderSettings settings = settings_of(8, 3);
    const EffectSet needed = needed_effects(scene, settings);
    const Estimate own = image(scene, settings, needed);
    for (const Effect more : {Effect::entity_motion, Effect::rough_conductor, Effect::noise, Effect::medium_scattering,
             Effect::interiors, Effect::roulette}) {
        CAPTURE(effect_name(more));
        REQUIRE(!needed.has(more));
        CHECK(same_bits(own, image(scene, settings, needed.with(more))));
    }
}

TEST_CASE("what no path of a scene can come to is not dispatched") {
    const auto dispatched = [](const Scene& scene, const RenderSettings& settings) {
        std::map<std::string, std::uint64_t> counts;
        for (const JobFacts::Part& part : renderer_with_kernel("stages").prepare(scene, settings)->facts().dispatches)
            counts[part.name] = part.amount;
        return counts;
    };
    const auto agree = [](const Scene& scene, RenderSettings settings) {
        const Estimate own = renderer_with_kernel("stages").prepare(scene, settings)->render({0, 2}).estimate;
        CHECK(image_mean(own) > 0.0);
        CHECK(same_bits(own, renderer_with_kernel("megakernel").prepare(scene, settings)->render({0, 2}).estimate));
        if (!test::thorough()) return;
        settings.effects = EffectSet::all();
        CHECK(same_bits(own, renderer_with_kernel("stages").prepare(scene, settings)->render({0, 2}).estimate));
    };
    RenderSettings settings = settings_of(5, 4, Integrator::next_event);
    SceneBuilder sky;
    sky.camera({0, 1, 4}, {0, 0, 0}).background(glm::dvec3(0.2), glm::dvec3(1.0));
    const std::string intersect = "intersect", vertex = "vertex", scatter = "scatter";
    CHECK(!dispatched(sky.scene(), settings).contains(intersect));
    CHECK(!dispatched(sky.scene(), settings).contains(vertex));
    CHECK(dispatched(sky.scene(), settings)[scatter] == 1);
    agree(sky.scene(), settings);
    SceneBuilder fog = sky;  // scattered again and again, and still nothing to meet
    fog.scene().media.emplace_back().scattering = glm::dvec3(0.3);
    fog.scene().medium = 0;
    settings.ray_max = 5.0;
    CHECK(!dispatched(fog.scene(), settings).contains(intersect));
    CHECK(dispatched(fog.scene(), settings)[scatter] == 5);
    agree(fog.scene(), settings);
    fog.scene().background.sampled = true;  // now with shadow rays, which the stage follows
    CHECK(dispatched(fog.scene(), settings)[intersect] == 5);
    agree(fog.scene(), settings);
    settings.integrator = Integrator::whitted;
    CHECK(dispatched(fog.scene(), settings)[scatter] == 2);
    agree(fog.scene(), settings);
    settings = settings_of(5, 4, Integrator::next_event);
    SceneBuilder lamp = sky;
    lamp.sphere(lamp.material(emitter(glm::dvec3(2.0))), {0, 0, 0}, 1.0);
    CHECK(dispatched(lamp.scene(), settings)[intersect] == 1);
    CHECK(dispatched(lamp.scene(), settings)[vertex] == 1);
    agree(lamp.scene(), settings);
    SceneBuilder floor = lamp;
    floor.cuboid(floor.material(diffuse(glm::dvec3(0.5))), {-3, -1.5, -3}, {3, -1.2, 3});
    CHECK(dispatched(floor.scene(), settings)[intersect] == 5);
    settings.integrator = Integrator::whitted;
    CHECK(dispatched(floor.scene(), settings)[intersect] == 2);
    agree(floor.scene(), settings);
    settings.bounces = 0;
    CHECK(dispatched(floor.scene(), settings)[intersect] == 1);
    agree(floor.scene(), settings);
}

TEST_CASE("effects that the scene calls for cannot be left out") {
    RenderSettings settings = settings_of(4, 1);
    settings.effects = needed_effects(full_scene(), settings).without(Effect::lens);
    CHECK_THROWS_AS(static_cast<void>(render(full_scene(), settings, 1)), UnsupportedError);
}

TEST_CASE("the bidirectional integrator is refused") {
    CHECK_THROWS_AS(
        static_cast<void>(render(full_scene(), settings_of(4, 1, Integrator::bidirectional), 1)), UnsupportedError);
}
