#include "common/validation/explanation/scene_features.h"

#include <algorithm>
#include <glm/mat3x3.hpp>
#include <span>

#include "common/render/effects.h"

namespace tandem {

namespace {

using S = Subsystem;
using glm::dvec3;

bool black(const dvec3& colour) { return colour == dvec3(0.0); }

// Diffuse in the same colour, and as bright where it shines.
void make_diffuse(Material& material) {
    Material plain;
    plain.name = material.name;
    plain.kind = material.kind == MaterialKind::emissive ? MaterialKind::emissive : MaterialKind::diffuse;
    constexpr double grey = 0.5;
    plain.colour = material.kind == MaterialKind::conductor ? dvec3(grey) : material.colour;
    plain.colour_texture = material.colour_texture;
    plain.radiance = material.radiance;
    plain.sides = material.sides;
    material = plain;
}

template <typename Which>
void make_diffuse(EditedScene& edited, Which which) {
    for (Material& material : edited.scene.materials)
        if (which(material)) make_diffuse(material);
}

void drop_boundaries_of_nothing(Scene& scene) {
    for (Entity& entity : scene.entities) {
        const Material& material = scene.materials[entity.material];
        if (material.kind == MaterialKind::boundary && material.interior == no_index && !material.priority)
            entity.primitive_count = 0;
    }
}

void without_lens(EditedScene& e) { e.scene.camera.lens_radius = 0.0; }
void without_camera_motion(EditedScene& e) {
    e.scene.camera.position_motion = e.scene.camera.target_motion = dvec3(0.0);
}
void without_entity_motion(EditedScene& e) {
    for (Entity& entity : e.scene.entities) entity.motion = dvec3(0.0);
}

// What turns or shears it; how long its axes are stays.
bool is_turned(const Entity& entity) {
    const glm::dmat3 map(entity.object_to_world);
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            if (row != column && map[column][row] != 0.0) return true;
    return false;
}
void without_turns(EditedScene& e) {
    for (Entity& entity : e.scene.entities)
        for (int column = 0; column < 3; ++column) {
            const double length = glm::length(dvec3(entity.object_to_world[column]));
            entity.object_to_world[column] = glm::dvec4(0.0);
            entity.object_to_world[column][column] = length;
        }
}

template <PunctualKind kind>
void without_lights(EditedScene& e) {
    std::erase_if(e.scene.lights, [](const PunctualLight& light) { return light.kind == kind; });
}

// A texture's mean colour in its place.
template <TextureKind kind>
void without_textures(EditedScene& e) {
    for (Material& material : e.scene.materials) {
        if (material.colour_texture == no_index) continue;
        const Texture& texture = e.scene.textures[material.colour_texture];
        if (texture.kind != kind) continue;
        material.colour = 0.5 * (texture.first + texture.second);
        material.colour_texture = no_index;
    }
}

void without_phase(EditedScene& e) {
    for (Medium& medium : e.scene.media) medium.anisotropy = 0.0;
}
void without_media(EditedScene& e) {
    e.scene.medium = no_index;
    for (Material& material : e.scene.materials) material.interior = no_index;
    drop_boundaries_of_nothing(e.scene);
}
void without_interiors(EditedScene& e) {
    for (Material& material : e.scene.materials) {
        material.interior = no_index;
        material.priority.reset();
    }
    drop_boundaries_of_nothing(e.scene);
}
void without_nested_dielectrics(EditedScene& e) {
    for (Material& material : e.scene.materials) {
        if (!material.translucent) continue;
        material.interior = no_index;
        material.priority.reset();
    }
}

void without_frosted_glass(EditedScene& e) {
    for (Material& material : e.scene.materials)
        if (material.translucent) material.roughness = 0.0;
}
void without_schlick(EditedScene& e) {
    e.settings.fresnel.reset();
    for (Material& material : e.scene.materials) material.fresnel = Fresnel::exact;
}
void without_glass(EditedScene& e) {
    make_diffuse(e, [](const Material& m) { return m.translucent; });
}
template <bool rough>
void without_conductors(EditedScene& e) {
    make_diffuse(
        e, [](const Material& m) { return m.kind == MaterialKind::conductor && (m.roughness > 0.0) == rough; });
}
void without_rough_diffuse(EditedScene& e) {
    make_diffuse(e, [](const Material& m) { return m.kind == MaterialKind::rough_diffuse; });
}
void without_fuzz(EditedScene& e) {
    for (Material& material : e.scene.materials) material.fuzz = 0.0;
}
void without_mirrors(EditedScene& e) {
    make_diffuse(e, [](const Material& m) { return m.kind == MaterialKind::specular && !m.translucent; });
}

void without_normals(EditedScene& e) { e.scene.normals.clear(); }

// The image's mean radiance from all directions.
void without_background_image(EditedScene& e) {
    Background& background = e.scene.background;
    if (!background.image) return;
    dvec3 sum(0.0);
    const std::vector<float>& rgb = background.image->rgb;
    for (std::size_t i = 0; i < rgb.size(); ++i) sum[static_cast<int>(i % 3)] += rgb[i];
    background.down = background.up = background.image_scale / static_cast<double>(rgb.size() / 3) * sum;
    background.image = nullptr;
}
void without_gradient(EditedScene& e) {
    Background& background = e.scene.background;
    if (!background.image) background.down = background.up = 0.5 * (background.down + background.up);
}
void without_background(EditedScene& e) { e.scene.background = {}; }
void without_sampled_background(EditedScene& e) { e.scene.background.sampled = false; }

void without_one_sided_lights(EditedScene& e) {
    for (Material& material : e.scene.materials) material.sides = EmittingSides::both;
}

bool is_of(const Scene& scene, const Entity& entity, PrimitiveKind kind) {
    for (std::uint32_t i = 0; i < entity.primitive_count; ++i)
        if (scene.primitives[entity.first_primitive + i].kind != kind) return false;
    return entity.primitive_count > 0;
}
// Those that do not shine.
template <PrimitiveKind kind>
void without_shapes(EditedScene& e) {
    for (Entity& entity : e.scene.entities)
        if (black(e.scene.materials[entity.material].radiance) && is_of(e.scene, entity, kind))
            entity.primitive_count = 0;
}

void without_mis(EditedScene& e) {
    if (e.settings.integrator == Integrator::next_event) e.settings.mis = false;
}
void without_light_sampling(EditedScene& e) {
    e.settings.integrator = Integrator::path;
    e.settings.mis = true;
    e.settings.light_sampling = LightSampling::power;
}
void without_light_tree(EditedScene& e) { e.settings.light_sampling = LightSampling::power; }
void without_wide_filter(EditedScene& e) { e.settings.filter = PixelFilter::box; }
void without_roulette(EditedScene& e) { e.settings.roulette_start = no_roulette; }
void without_long_paths(EditedScene& e) { e.settings.bounces = std::min(e.settings.bounces, 1u); }
void without_philox(EditedScene& e) { e.settings.generator = Generator::hash; }

struct EffectFeature {
    Effect effect;
    SceneFeature feature;
};
// An effect that every second scene has is near the end.
constexpr EffectFeature effect_features[] = {
    {Effect::lens, {S::camera, "a lens", "4", without_lens}},
    {Effect::camera_motion, {S::camera, "a camera that moves", "4", without_camera_motion}},
    {Effect::entity_motion, {S::camera, "an entity that moves", "6", without_entity_motion}},
    {Effect::spot_lights, {S::light_sampling, "a spot", "8.3", without_lights<PunctualKind::spot>}},
    {Effect::point_lights, {S::light_sampling, "a point light", "8.3", without_lights<PunctualKind::point>}},
    {Effect::suns, {S::light_sampling, "a sun", "8.3", without_lights<PunctualKind::sun>}},
    {Effect::density_grid, {S::volumes, "a density grid", "10"}},
    {Effect::image_texture, {S::textures, "an image for a colour", "7.0", without_textures<TextureKind::image>, true}},
    {Effect::noise, {S::textures, "a noise texture", "7.0", without_textures<TextureKind::noise>, true}},
    {Effect::checker, {S::textures, "a checker", "7.0", without_textures<TextureKind::checker>, true}},
    {Effect::anisotropic_phase, {S::volumes, "a medium that scatters more to one side", "10", without_phase}},
    {Effect::medium_absorption, {S::volumes, "a medium", "10", without_media, true}},
    {Effect::nested_dielectrics, {S::dielectric, "bodies of glass with priorities", "9.4", without_nested_dielectrics}},
    {Effect::rough_translucent, {S::dielectric, "frosted glass", "7.7", without_frosted_glass}},
    {Effect::schlick, {S::dielectric, "Schlick's reflectance", "7.4", without_schlick}},
    {Effect::translucent, {S::dielectric, "glass", "7.4", without_glass, true}},
    {Effect::interiors, {S::volumes, "bodies with interiors", "9.4", without_interiors}},
    {Effect::rough_conductor, {S::bsdf, "a rough conductor", "7.6", without_conductors<true>}},
    {Effect::smooth_conductor, {S::bsdf, "a conductor", "7.6", without_conductors<false>}},
    {Effect::rough_diffuse, {S::bsdf, "a rough diffuse surface", "7.9", without_rough_diffuse}},
    {Effect::fuzz, {S::bsdf, "a fuzzy mirror", "7.3", without_fuzz}},
    {Effect::background_image, {S::emission, "an image as background", "8.1", without_background_image}},
    {Effect::shading_normals, {S::geometry, "normals of a model", "5.4", without_normals}},
};
constexpr EffectFeature plain_features[] = {
    {Effect::background_gradient, {S::emission, "a background that varies with height", "8.1", without_gradient}},
    {Effect::specular, {S::bsdf, "a mirror", "7.3", without_mirrors}},
    {Effect::light_sampling,
        {S::light_sampling, "lights that are sampled", "9.2", without_light_sampling, true, Naming::general, true}},
    {Effect::emission, {S::emission, "a surface that emits", "7.5"}},
    {Effect::diffuse, {S::bsdf, "a diffuse surface", "7.2"}},
    {Effect::background, {S::emission, "a background", "8.1", without_background, false, Naming::general}},
    {Effect::roulette, {S::roulette, "Russian roulette", "9.3", without_roulette, true, Naming::particular, true}},
};
// That no miss of a closed form is laid to.
constexpr EffectFeature finer_features[] = {
    {Effect::one_sided_emission, {S::emission, "a surface that emits to one side", "7.5", without_one_sided_lights}},
    {Effect::sampled_background, {S::light_sampling, "a background that is sampled", "8.2", without_sampled_background,
                                     false, Naming::general, true}},
};
// Walls and bodies keep paths in the scene, so what else is needed says more.
constexpr EffectFeature shape_features[] = {
    {Effect::spheres,
        {S::geometry, "spheres that do not emit", "5.2", without_shapes<PrimitiveKind::sphere>, false, Naming::shape}},
    {Effect::cuboids,
        {S::geometry, "cuboids that do not emit", "5.2", without_shapes<PrimitiveKind::cuboid>, false, Naming::shape}},
    {Effect::triangles, {S::geometry, "triangles that do not emit", "5.2", without_shapes<PrimitiveKind::triangle>,
                            false, Naming::shape}},
};
constexpr SceneFeature two_ways{
    S::mis_weights, "weights of two ways to a light", "9.2", without_mis, true, Naming::particular, true};
constexpr SceneFeature light_tree{
    S::light_sampling, "a choice of the light by a tree", "9.2", without_light_tree, false, Naming::particular, true};
constexpr SceneFeature wide_filter{S::camera, "a pixel filter wider than a pixel", "4.1", without_wide_filter};
constexpr SceneFeature turned_entities{
    S::scene_data, "an entity that is turned", "6", without_turns, false, Naming::general};
constexpr SceneFeature philox{
    S::random_numbers, "Philox's numbers", "3", without_philox, false, Naming::particular, true};
constexpr SceneFeature long_paths{
    S::roulette, "paths of several bounces", "9", without_long_paths, true, Naming::nobody};

void add_called(std::span<const EffectFeature> rows, EffectSet effects, std::vector<SceneFeature>& features) {
    for (const EffectFeature& row : rows)
        if (effects.has(row.effect)) features.push_back(row.feature);
}

bool turns_or_scales(const Entity& entity) { return glm::dmat3(entity.object_to_world) != glm::dmat3(1.0); }

}  // namespace

std::vector<SceneFeature> features_of(const Scene& scene, const RenderSettings& settings) {
    const EffectSet effects = needed_effects(scene, settings);
    std::vector<SceneFeature> features;
    add_called(effect_features, effects, features);
    const bool reads_image = effects.has(Effect::background_image) || effects.has(Effect::image_texture);
    if (reads_image) features.push_back({S::scene_data, "an image file", "7.0"});
    if (std::ranges::any_of(scene.entities, turns_or_scales))
        features.push_back({S::scene_data, "an entity that is turned or scaled", "6"});
    if (effects.has(Effect::triangles)) features.push_back({S::geometry, "quads or triangles", "5"});
    if (effects.has(Effect::ellipsoid_lights)) features.push_back({S::geometry, "an ellipsoid", "5"});
    add_called(plain_features, effects, features);
    features.push_back({S::scene_data, "anything else that the loader reads", ""});
    return features;
}

std::vector<SceneFeature> removable_features(const Scene& scene, const RenderSettings& settings) {
    const EffectSet effects = needed_effects(scene, settings);
    std::vector<SceneFeature> features;
    add_called(effect_features, effects, features);
    add_called(finer_features, effects, features);
    if (settings.light_sampling == LightSampling::tree) features.push_back(light_tree);
    if (settings.filter != PixelFilter::box) features.push_back(wide_filter);
    const bool two = settings.integrator == Integrator::next_event && settings.mis;
    if (two && effects.has(Effect::light_sampling)) features.push_back(two_ways);
    add_called(plain_features, effects, features);
    if (std::ranges::any_of(scene.entities, is_turned)) features.push_back(turned_entities);
    add_called(shape_features, effects, features);
    if (settings.generator == Generator::philox) features.push_back(philox);
    if (settings.bounces > 1) features.push_back(long_paths);
    std::erase_if(features, [](const SceneFeature& one) { return one.take_out == nullptr; });
    return features;
}

}  // namespace tandem
