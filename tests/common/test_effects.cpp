// What a scene calls for: every effect alone, every pair of ingredients, what no ray can meet, and what is refused.
#include <doctest/doctest.h>

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/render/effects.h"
#include "common/render/renderer.h"
#include "common/scene/loader/scene_loader.h"
#include "common/scene/scene.h"
#include "tests/refusal.h"

using namespace tandem;
using enum tandem::Effect;

namespace {

struct Setup {
    Scene scene;
    RenderSettings settings;
};

// One thing that a scene may have, the effects that it calls for by itself, and what it does for others. Light that can
// be sampled calls for its kind and for light_sampling wherever something receives it.
struct Ingredient {
    std::string name;
    std::function<void(Setup&)> add;
    EffectSet calls;
    EffectSet lights = {};
    bool receives = false;
};

std::uint32_t add_material(Scene& scene, Material material) {
    material.name = "m" + std::to_string(scene.materials.size());
    scene.materials.push_back(material);
    return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

Entity& add_entity(Scene& scene, std::uint32_t material, PrimitiveKind kind) {
    Entity entity;
    entity.material = material;
    entity.first_primitive = static_cast<std::uint32_t>(scene.primitives.size());
    entity.primitive_count = 1;
    scene.primitives.push_back({kind, {0, 0, 0}, 1.0});
    scene.entities.push_back(entity);
    return scene.entities.back();
}

// A mirror sphere calls for specular and spheres; each ingredient changes one thing of it.
Material mirror() {
    Material material;
    material.kind = MaterialKind::specular;
    return material;
}
Material glass() {
    Material material = mirror();
    material.translucent = true;
    return material;
}
Material conductor(double roughness) {
    Material material;
    material.kind = MaterialKind::conductor;
    material.roughness = roughness;
    return material;
}
Material dust(double roughness) {
    Material material;
    material.kind = MaterialKind::rough_diffuse;
    material.roughness = roughness;
    return material;
}
Material lamp() {
    Material material;
    material.kind = MaterialKind::emissive;
    material.radiance = glm::dvec3(1.0);
    return material;
}
std::uint32_t add_medium(Scene& scene, double absorption, double scattering, double anisotropy, bool grid) {
    Medium medium;
    medium.name = "medium";
    medium.absorption = glm::dvec3(absorption);
    medium.scattering = glm::dvec3(scattering);
    medium.anisotropy = anisotropy;
    if (grid) medium.grid = std::make_shared<DensityGrid>();
    scene.media.push_back(medium);
    return static_cast<std::uint32_t>(scene.media.size() - 1);
}
std::shared_ptr<const Pixels> pixel(float value) {
    return std::make_shared<Pixels>(Pixels{1, 1, {value, value, value}});
}

Ingredient surface(
    const std::string& name, const Material& material, EffectSet calls, bool receives = false, EffectSet lights = {}) {
    return {name, [material](Setup& s) { add_entity(s.scene, add_material(s.scene, material), PrimitiveKind::sphere); },
        calls.with(spheres), lights, receives};
}

Ingredient lit(const std::string& name, PrimitiveKind kind, EffectSet calls, Effect light) {
    return {name, [kind](Setup& s) { add_entity(s.scene, add_material(s.scene, lamp()), kind); }, calls.with(emission),
        {light}};
}

Ingredient textured(const std::string& name, TextureKind kind, TextureSpace space, EffectSet calls) {
    return {name,
        [kind, space](Setup& s) {
            Texture texture;
            texture.kind = kind;
            texture.space = space;
            texture.image = pixel(0.5F);
            s.scene.textures.push_back(texture);
            Material material = mirror();
            material.colour_texture = static_cast<std::uint32_t>(s.scene.textures.size() - 1);
            add_entity(s.scene, add_material(s.scene, material), PrimitiveKind::sphere);
        },
        calls.united({specular, spheres})};
}

Ingredient filled(
    const std::string& name, double absorption, double scattering, double anisotropy, bool grid, EffectSet calls) {
    return {name,
        [=](Setup& s) {
            Material material = glass();
            material.interior = add_medium(s.scene, absorption, scattering, anisotropy, grid);
            add_entity(s.scene, add_material(s.scene, material), PrimitiveKind::sphere);
        },
        calls.united({specular, spheres, translucent, interiors, nested_dielectrics}), {}, scattering > 0.0};
}

Ingredient punctual(const std::string& name, PunctualKind kind, EffectSet light) {
    return {name,
        [kind](Setup& s) {
            PunctualLight added;
            added.kind = kind;
            added.intensity = glm::dvec3(1.0);
            s.scene.lights.push_back(added);
        },
        {}, light};
}

std::vector<Ingredient> cameras_and_sky() {
    return {{"a lens", [](Setup& s) { s.scene.camera.lens_radius = 0.1; }, {lens}},
        {"a camera in motion", [](Setup& s) { s.scene.camera.position_motion.x = 1.0; }, {camera_motion}},
        {"a target in motion", [](Setup& s) { s.scene.camera.target_motion.x = 1.0; }, {camera_motion}},
        {"an even sky", [](Setup& s) { s.scene.background.down = s.scene.background.up = glm::dvec3(1.0); },
            {background}},
        {"a lens with roulette",
            [](Setup& s) {
                s.scene.camera.lens_radius = 0.1;
                s.settings.roulette_start = 3;
            },
            {lens, roulette}}};
}

std::vector<Ingredient> surfaces() {
    Material fuzzy = mirror(), schlick_glass = glass(), rough_glass = glass(), glowing = glass(), fuzzy_glass = glass();
    fuzzy.fuzz = fuzzy_glass.fuzz = 0.5;
    schlick_glass.fresnel = Fresnel::schlick;
    rough_glass.roughness = 0.5;
    glowing.kind = MaterialKind::emissive;
    glowing.radiance = glm::dvec3(1.0);
    Material one_sided = glowing, vacuum, ranked = glass();
    one_sided.sides = EmittingSides::front;
    vacuum.kind = MaterialKind::boundary;
    Material bubble = vacuum;
    bubble.priority = 0;
    ranked.priority = 1;
    Material glowing_ranked = glowing;
    glowing_ranked.priority = 1;
    return {surface("a diffuse sphere", Material{}, {diffuse}, true), surface("a mirror", mirror(), {specular}),
        surface("fuzz", fuzzy, {specular, fuzz}), surface("glass", glass(), {specular, translucent}),
        surface("fuzzy glass", fuzzy_glass, {specular, translucent, fuzz}),
        surface("Schlick's glass", schlick_glass, {specular, translucent, schlick}),
        surface("rough glass", rough_glass, {specular, translucent, rough_translucent}),
        surface("glowing glass", glowing, {emission, translucent, translucent_emission}, false, {sphere_lights}),
        surface("glowing glass of a priority, which is not sampled", glowing_ranked,
            {emission, translucent, translucent_emission, interiors, nested_dielectrics}),
        surface("glass that glows outwards", one_sided,
            {emission, translucent, translucent_emission, one_sided_emission}, false, {sphere_lights}),
        surface("a smooth conductor", conductor(0.0), {smooth_conductor}),
        surface("a rough conductor", conductor(0.5), {rough_conductor}, true),
        surface("a rough diffuse sphere", dust(0.5), {rough_diffuse}, true),
        surface("a rough diffuse sphere of roughness 0", dust(0.0), {rough_diffuse}, true),
        surface("a boundary of nothing", vacuum, {boundary}), surface("a bubble", bubble, {boundary, interiors}),
        surface("glass of a priority", ranked, {specular, translucent, interiors, nested_dielectrics}),
        {"a triangle", [](Setup& s) { add_entity(s.scene, add_material(s.scene, mirror()), PrimitiveKind::triangle); },
            {specular, triangles}},
        {"a cuboid", [](Setup& s) { add_entity(s.scene, add_material(s.scene, mirror()), PrimitiveKind::cuboid); },
            {specular, cuboids}},
        {"a mirror in motion",
            [](Setup& s) {
                add_entity(s.scene, add_material(s.scene, mirror()), PrimitiveKind::sphere).motion.y = 1.0;
            },
            {specular, spheres, entity_motion}},
        {"a lamp in motion",
            [](Setup& s) { add_entity(s.scene, add_material(s.scene, lamp()), PrimitiveKind::sphere).motion.y = 1.0; },
            {emission, spheres, entity_motion}, {sphere_lights}},
        {"a stretched lamp",
            [](Setup& s) {
                add_entity(s.scene, add_material(s.scene, lamp()), PrimitiveKind::sphere).object_to_world[1][1] = 2.0;
            },
            {emission, spheres}, {ellipsoid_lights}}};
}

std::vector<Ingredient> textures_and_media() {
    using enum TextureKind;
    using enum TextureSpace;
    return {textured("a checker", TextureKind::checker, object, {Effect::checker}),
        textured("a checker in coordinates", TextureKind::checker, coordinates, {Effect::checker, texture_coordinates}),
        textured("noise", TextureKind::noise, object, {Effect::noise}),
        textured("an image", image, object, {image_texture, texture_coordinates}),
        filled("coloured glass", 1.0, 0.0, 0.0, false, {medium_absorption}),
        filled("milky glass", 0.0, 1.0, 0.0, false, {medium_absorption, medium_scattering}),
        filled("forward milk", 0.0, 1.0, 0.5, false, {medium_absorption, medium_scattering, anisotropic_phase}),
        filled("a coloured cloud", 1.0, 0.0, 0.0, true, {medium_absorption, density_grid}),
        filled("a cloud", 0.0, 1.0, 0.0, true, {medium_absorption, medium_scattering, density_grid}),
        filled("glass filled with a medium that does nothing", 0.0, 0.0, 0.5, true, {}),
        {"fog around all", [](Setup& s) { s.scene.medium = add_medium(s.scene, 0.0, 1.0, 0.0, false); },
            {medium_absorption, medium_scattering}, {}, true}};
}

std::vector<Ingredient> lights() {
    return {lit("a triangle lamp", PrimitiveKind::triangle, {triangles}, triangle_lights),
        lit("a sphere lamp", PrimitiveKind::sphere, {spheres}, sphere_lights),
        lit("a cuboid lamp", PrimitiveKind::cuboid, {cuboids}, cuboid_lights),
        punctual("a point light", PunctualKind::point, {point_lights}),
        punctual("a spot", PunctualKind::spot, {point_lights, spot_lights}),
        punctual("a sun", PunctualKind::sun, {suns}),
        {"a sampled sky",
            [](Setup& s) {
                s.scene.background.down = s.scene.background.up = glm::dvec3(1.0);
                s.scene.background.sampled = true;
            },
            {background}, {sampled_background}},
        {"a sampled gradient",
            [](Setup& s) {
                s.scene.background.down = glm::dvec3(1.0);
                s.scene.background.up = glm::dvec3(2.0);
                s.scene.background.sampled = true;
            },
            {background, background_gradient}, {sampled_background}},
        {"a diffuse lamp",
            [](Setup& s) {
                Material material;
                material.radiance = glm::dvec3(1.0);
                material.sides = EmittingSides::front;
                add_entity(s.scene, add_material(s.scene, material), PrimitiveKind::sphere);
            },
            {emission, one_sided_emission, diffuse, spheres}, {sphere_lights}, true}};
}

// A triangle at vertex 1, which has a normal; that of others has none.
std::vector<Ingredient> meshes() {
    return {{"smooth mesh",
        [](Setup& s) {
            add_entity(s.scene, add_material(s.scene, mirror()), PrimitiveKind::triangle);
            s.scene.primitives.back().index = {1, 1, 1};
            s.scene.normals = {glm::dvec3(0.0), glm::dvec3(0.0, 1.0, 0.0)};
        },
        {triangles, specular, shading_normals}}};
}

std::vector<Ingredient> ingredients() {
    std::vector<Ingredient> all;
    for (const auto& some : {cameras_and_sky(), surfaces(), meshes(), textures_and_media(), lights()})
        all.insert(all.end(), some.begin(), some.end());
    return all;
}

EffectSet expected(const std::vector<Ingredient>& used, Integrator integrator) {
    EffectSet calls, lights;
    bool receives = false;
    for (const Ingredient& one : used) {
        calls = calls.united(one.calls);
        lights = lights.united(one.lights);
        receives = receives || one.receives;
    }
    if (integrator == Integrator::whitted) calls = calls.with(direct_only);
    if (integrator == Integrator::path || !receives || lights == EffectSet{}) return calls;
    return calls.united(lights).with(light_sampling);
}

EffectSet needed(const std::vector<Ingredient>& used, Integrator integrator) {
    Setup setup;
    setup.settings.integrator = integrator;
    for (const Ingredient& one : used) one.add(setup);
    return needed_effects(setup.scene, setup.settings);
}

Setup lit_floor() {
    Setup setup;
    setup.settings.integrator = Integrator::next_event;
    add_entity(setup.scene, add_material(setup.scene, Material{}), PrimitiveKind::triangle);
    PunctualLight light;
    light.intensity = glm::dvec3(1.0);
    setup.scene.lights.push_back(light);
    return setup;
}

std::string refusal(const Setup& setup, EffectSet supported = EffectSet::all()) {
    return tandem::refusal<UnsupportedError>(
        [&] { (void)effects_to_simulate(setup.scene, setup.settings, supported, "test"); });
}

}  // namespace

TEST_CASE("an empty scene calls for nothing") {
    const Setup setup;
    CHECK(needed_effects(setup.scene, setup.settings) == EffectSet{});
    for (const EffectFinding& finding : find_effects(setup.scene, setup.settings)) {
        CHECK_FALSE(finding.needed);
        CHECK_FALSE(finding.reason.empty());
    }
}

TEST_CASE("every ingredient calls for its effects and no others") {
    for (const Ingredient& one : ingredients())
        for (const Integrator integrator : {Integrator::path, Integrator::next_event, Integrator::whitted}) {
            CAPTURE(one.name);
            CHECK(effect_names(needed({one}, integrator)) == effect_names(expected({one}, integrator)));
        }
}

TEST_CASE("every pair of ingredients calls for the union, and for light sampling where one lights what the other has") {
    const std::vector<Ingredient> all = ingredients();
    for (const Ingredient& first : all)
        for (const Ingredient& second : all)
            for (const Integrator integrator : {Integrator::path, Integrator::next_event}) {
                if (first.calls.has(background) && second.calls.has(background)) continue;  // there is only one
                CAPTURE(first.name);
                CAPTURE(second.name);
                CHECK(effect_names(needed({first, second}, integrator)) ==
                      effect_names(expected({first, second}, integrator)));
            }
}

TEST_CASE("together the ingredients and an image of the sky call for every effect") {
    EffectSet found;
    for (const Ingredient& first : ingredients())
        found = found.united(needed({first, surfaces().front()}, Integrator::next_event));
    Setup sky;
    sky.scene.background.image = pixel(1.0F);
    sky.settings.integrator = Integrator::whitted;
    const EffectSet image = needed_effects(sky.scene, sky.settings);
    CHECK(effect_names(image) == effect_names({background, background_image, direct_only}));
    CHECK(effect_names(found.united(image)) == effect_names(EffectSet::all()));
}

TEST_CASE("what no ray can meet calls for nothing") {
    Setup setup;
    setup.settings.integrator = Integrator::next_event;
    Scene& scene = setup.scene;
    Material unused = glass();  // of no entity, with all that hangs on it
    unused.fuzz = 0.5;
    unused.interior = add_medium(scene, 1.0, 1.0, 0.5, true);
    scene.textures.emplace_back();
    unused.colour_texture = 0;
    add_material(scene, unused);
    Entity empty;  // of no primitive
    scene.entities.push_back(empty);
    PunctualLight dark;
    scene.lights.push_back(dark);
    scene.background.image = pixel(0.0F);
    scene.background.sampled = true;
    CHECK(effect_names(needed_effects(scene, setup.settings)).empty());
    Material off = lamp();
    off.radiance = glm::dvec3(0.0);
    off.sides = EmittingSides::front;
    add_entity(scene, add_material(scene, off), PrimitiveKind::cuboid);
    add_entity(scene, add_material(scene, Material{}), PrimitiveKind::cuboid);
    CHECK(effect_names(needed_effects(scene, setup.settings)) == effect_names({cuboids, diffuse}));
}

TEST_CASE("an opaque lamp has no use for a colour, a texture or fuzz") {
    Setup setup;
    Material material = lamp();
    material.fuzz = 0.5;
    material.colour_texture = 0;
    setup.scene.textures.emplace_back();
    add_entity(setup.scene, add_material(setup.scene, material), PrimitiveKind::sphere);
    CHECK(effect_names(needed_effects(setup.scene, setup.settings)) == effect_names({spheres, emission}));
}

TEST_CASE("without a bounce nothing is sampled, and roulette that starts later is none") {
    Setup setup = lit_floor();
    setup.settings.bounces = 0;
    setup.settings.roulette_start = 1;
    CHECK(effect_names(needed_effects(setup.scene, setup.settings)) == effect_names({triangles, diffuse}));
    setup.settings.bounces = 2;
    setup.settings.roulette_start = 3;
    CHECK_FALSE(needed_effects(setup.scene, setup.settings).has(roulette));
    setup.settings.roulette_start = 2;
    CHECK(needed_effects(setup.scene, setup.settings).has(roulette));
}

TEST_CASE("what is simulated is what is needed, or the choice that covers it, less what the renderer lacks") {
    Setup setup = lit_floor();
    const EffectSet needs{triangles, diffuse, light_sampling, point_lights};
    CHECK(effects_to_simulate(setup.scene, setup.settings, EffectSet::all(), "test") == needs);
    setup.settings.effects = needs.united({noise, lens});
    CHECK(effects_to_simulate(setup.scene, setup.settings, EffectSet::all(), "test") == needs.united({noise, lens}));
    CHECK(
        effects_to_simulate(setup.scene, setup.settings, EffectSet::all().without(noise), "test") == needs.with(lens));
    setup.settings.effects = needs.without(point_lights).without(diffuse);
    const std::string left_out = refusal(setup);
    CHECK(left_out.find("diffuse, point-lights") != std::string::npos);
    setup.settings.effects.reset();
    const std::string lacking = refusal(setup, EffectSet::all().without(point_lights));
    CHECK(lacking.find("the test backend does not simulate") != std::string::npos);
    CHECK(lacking.find("point-lights") != std::string::npos);
}

TEST_CASE("lights that cannot be found are refused, unless they are black") {
    Setup path = lit_floor();
    path.settings.integrator = Integrator::path;
    CHECK(refusal(path).find("path integrator cannot find point") != std::string::npos);
    path.scene.lights[0].intensity = glm::dvec3(0.0);
    CHECK(refusal(path).empty());
    Setup behind = lit_floor();
    Material skin;
    skin.kind = MaterialKind::boundary;
    add_entity(behind.scene, add_material(behind.scene, skin), PrimitiveKind::sphere);
    CHECK(refusal(behind).find("boundary surfaces block") != std::string::npos);
    behind.scene.lights[0].intensity = glm::dvec3(0.0);
    CHECK(refusal(behind).empty());
}

TEST_CASE("punctual lights with glass are refused by name where next events alone would find them") {
    Setup setup = lit_floor();
    Material pane = glass();
    setup.scene.lights[0].name = "bulb";
    add_entity(setup.scene, add_material(setup.scene, pane), PrimitiveKind::sphere);
    const std::string told = refusal(setup);
    CHECK(told.find("material \"" + setup.scene.materials.back().name + "\" is translucent") == 0);
    CHECK(told.find("light \"bulb\"") != std::string::npos);
    for (const Integrator integrator : {Integrator::whitted, Integrator::bidirectional}) {
        setup.settings.integrator = integrator;
        CHECK(refusal(setup).empty());
    }
    setup.settings.integrator = Integrator::next_event;
    setup.settings.bounces = 0;  // nothing is lit at all
    CHECK(refusal(setup).empty());
    setup.settings.bounces = 2;
    setup.scene.lights[0].kind = PunctualKind::sun;
    CHECK(refusal(setup).find("light \"bulb\"") != std::string::npos);
    setup.scene.lights[0].intensity = glm::dvec3(0.0);
    CHECK(refusal(setup).empty());
    setup.scene.lights[0].intensity = glm::dvec3(1.0);
    setup.scene.entities.pop_back();  // the glass stays in the file, and on no surface
    CHECK(refusal(setup).empty());
}

TEST_CASE("no shipped scene is refused at its own settings; each effect is needed by one, and one does without it") {
    std::size_t seen = 0;
    std::array<std::size_t, effect_count> needing{};  // of those that verify takes by default and the closed forms
    for (const char* folder : {"scenes", "scenes/closed-forms", "scenes/hard"})
        for (const auto& entry :
            std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / folder)) {
            if (entry.path().extension() != ".json" || entry.path().filename() == "catalogue.json") continue;
            CAPTURE(entry.path().string());
            const Scene scene = load_scene(entry.path());
            EffectSet simulated;
            CHECK_NOTHROW(simulated = effects_to_simulate(scene, default_settings(scene), EffectSet::all(), "test"));
            if (std::string(folder) == "scenes/hard") continue;
            ++seen;
            for (std::uint32_t i = 0; i < effect_count; ++i)
                if (simulated.has(static_cast<Effect>(i))) ++needing.at(i);
        }
    CHECK(seen >= 50);
    for (std::uint32_t i = 0; i < effect_count; ++i) {
        CAPTURE(effect_name(static_cast<Effect>(i)));
        CHECK(needing.at(i) > 0);
        // Its image is the same by kernels without the effect and by general ones: tests/vulkan/test_effects.cpp and
        // tests/cpu_ref/test_effects.cpp see to that for every shipped scene.
        CHECK(needing.at(i) < seen);
    }
}

TEST_CASE("every effect has a name of its own") {
    for (std::uint32_t i = 0; i < effect_count; ++i)
        for (std::uint32_t j = 0; j < i; ++j)
            CHECK(effect_name(static_cast<Effect>(i)) != effect_name(static_cast<Effect>(j)));
    CHECK(effect_names({lens, noise}) == "lens, noise");
}
