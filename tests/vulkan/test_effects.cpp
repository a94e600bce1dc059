// Kernels specialised to what a scene calls for against general ones: the same bits. And the words of effects that host
// and shaders read alike.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <regex>

#include "common/effects.h"
#include "common/error.h"
#include "common/scene_loader.h"
#include "tests/vulkan/scene_builder.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

Estimate image(const Scene& scene, RenderSettings settings, EffectSet effects) {
    settings.effects = effects;
    return default_renderer().prepare(scene, settings)->render({0, 4}).estimate;
}

// Whether the image of the scene's own effects, of those with one more, and of all have the same bits.
bool specialised_is_general(const Scene& scene, const RenderSettings& settings) {
    const EffectSet needed = needed_effects(scene, settings);
    return same_bits(image(scene, settings, needed), image(scene, settings, EffectSet::all()));
}

}  // namespace

TEST_CASE("bit i of the shaders' words of effects is effect i") {
    std::ifstream file(std::filesystem::path(TANDEM_SOURCE_DIR) / "shaders/effects.glsl");
    const std::regex declaration(R"(const bool has_(\w+) = \(effects_(low|high) & \(1u << (\d+)\)\) != 0u;)");
    std::uint32_t count = 0;
    for (std::string line; std::getline(file, line);) {
        std::smatch match;
        if (!std::regex_match(line, match, declaration)) continue;
        std::string name(effect_name(static_cast<Effect>(count)));
        for (char& c : name) c = c == '-' ? '_' : c;
        CHECK(match[1] == name);
        CHECK(std::stoul(match[3]) + (match[2] == "high" ? 32 : 0) == count);
        ++count;
    }
    CHECK(count == effect_count);
}

TEST_CASE("general kernels render the shipped scenes to the same bits as specialised ones") {
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".json") continue;
        const Scene scene = load_scene(entry.path());
        RenderSettings settings = with_longer_side(default_settings(scene), 24);
        settings.bounces = std::min(settings.bounces, 6u);
        CAPTURE(scene.name);
        CHECK(specialised_is_general(scene, settings));
    }
}

TEST_CASE("general kernels render scenes of every effect to the same bits by every integrator") {
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

TEST_CASE("effects that the scene calls for cannot be left out") {
    RenderSettings settings = settings_of(4, 1);
    settings.effects = needed_effects(full_scene(), settings).without(Effect::lens);
    CHECK_THROWS_AS(static_cast<void>(render(full_scene(), settings, 1)), InputError);
}

TEST_CASE("the bidirectional integrator is refused") {
    CHECK_THROWS_AS(
        static_cast<void>(render(full_scene(), settings_of(4, 1, Integrator::bidirectional), 1)), UnsupportedError);
}
