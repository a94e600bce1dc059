// A small scene for every effect of common/render/effects.h, made so that two of them go together. What a sample adds
// stands at a place of its own, and changes nothing of what another has added.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/render/effects.h"
#include "common/render/renderer.h"
#include "common/scene/scene.h"

namespace tandem::test {

// Under construction: a grey sky, and what samples have added.
class SampledScene {
public:
    SampledScene() {
        scene.name = "sample";
        scene.camera.position = {0.1, 0.6, 4.2};
        scene.camera.target = {0.0, 0.1, 0.0};
        scene.background.down = scene.background.up = glm::dvec3(0.5, 0.6, 0.7);
        settings.width = settings.height = 6;
        settings.bounces = 3;
        settings.ray_max = 12.0;  // an end to the fog before the sky
        settings.integrator = Integrator::next_event;
    }

    Scene scene;
    RenderSettings settings;
    double place = 0.0;  // along x, of what is added next

    Entity& sphere(const Material& material, glm::dvec3 centre = glm::dvec3(0.0), double radius = 0.55) {
        return add(material, {PrimitiveKind::sphere, {}, radius}, {centre});
    }
    Entity& cuboid(const Material& material, glm::dvec3 low, glm::dvec3 high) {
        return add(material, {PrimitiveKind::cuboid, {}, 0.0}, {low, high});
    }
    Entity& triangle(const Material& material, const std::array<glm::dvec3, 3>& corners) {
        return add(material, {PrimitiveKind::triangle, {}, 0.0}, {corners[0], corners[1], corners[2]});
    }
    // Its normals turn from corner to corner.
    void smooth_triangle(const Material& material, const std::array<glm::dvec3, 3>& corners) {
        triangle(material, corners);
        scene.normals.resize(scene.vertices.size() - 3, glm::dvec3(0.0));  // what stood before is flat
        const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
        for (const glm::dvec3& corner : corners)
            scene.normals.push_back(glm::normalize(glm::normalize(normal) + 0.8 * glm::normalize(corner)));
    }
    // A diffuse ball whose colour is the texture's.
    void textured_sphere(const Texture& texture) {
        Material material;
        material.colour_texture = static_cast<std::uint32_t>(scene.textures.size());
        scene.textures.push_back(texture);
        sphere(material);
    }
    // The medium around everything.
    Medium& fog() {
        if (scene.media.empty()) scene.media.emplace_back().name = "fog";
        scene.medium = 0;
        return scene.media[0];
    }
    void light(PunctualKind kind) {
        PunctualLight added;
        added.name = "light";
        added.kind = kind;
        added.position = {place + 0.9, 2.1, 1.3};
        added.direction = glm::dvec3(-0.48, -0.8, -0.36);
        added.intensity = kind == PunctualKind::sun ? glm::dvec3(0.9, 0.8, 0.6) : glm::dvec3(5.0, 4.0, 3.0);
        added.inner_degrees = 12.0;
        added.outer_degrees = 38.0;
        scene.lights.push_back(added);
    }

private:
    Entity& add(const Material& material, Primitive primitive, const std::vector<glm::dvec3>& points) {
        for (std::size_t i = 0; i < points.size(); ++i) {
            primitive.index.at(i) = static_cast<std::uint32_t>(scene.vertices.size());
            scene.vertices.push_back(points[i] + glm::dvec3(place, 0.0, 0.0));
            if (!scene.normals.empty()) scene.normals.emplace_back(0.0);
        }
        Entity entity;
        entity.name = "entity " + std::to_string(scene.entities.size());
        entity.material = static_cast<std::uint32_t>(scene.materials.size());
        entity.first_primitive = static_cast<std::uint32_t>(scene.primitives.size());
        entity.primitive_count = 1;
        scene.materials.push_back(material);
        scene.materials.back().name = "material " + std::to_string(entity.material);
        scene.primitives.push_back(primitive);
        scene.entities.push_back(entity);
        return scene.entities.back();
    }
};

namespace sample_parts {

inline Material silver() {
    Material material;
    material.kind = MaterialKind::specular;
    material.colour = {0.8, 0.85, 0.9};
    return material;
}
inline Material clay() {
    Material material;
    material.colour = {0.7, 0.5, 0.4};
    return material;
}
inline Material dust() {
    Material material = clay();
    material.kind = MaterialKind::rough_diffuse;
    material.roughness = 0.6;
    return material;
}
inline Material pane() {
    Material material = silver();
    material.translucent = true;
    material.alpha = 0.6;
    return material;
}
inline Material copper(double roughness) {
    Material material;
    material.kind = MaterialKind::conductor;
    material.eta = {0.2, 0.92, 1.1};
    material.k = {3.9, 2.45, 2.14};
    material.roughness = roughness;
    return material;
}
inline Material lamp(EmittingSides sides = EmittingSides::both) {
    Material material;
    material.kind = MaterialKind::emissive;
    material.radiance = {4.0, 3.0, 2.0};
    material.sides = sides;
    return material;
}
inline Material glowing() {
    Material material = lamp();
    material.translucent = true;
    material.alpha = 0.4;
    return material;
}
inline Material skin() {
    Material material;
    material.kind = MaterialKind::boundary;
    material.priority = 1;
    return material;
}
inline Texture checks(TextureKind kind, TextureSpace space = TextureSpace::object) {
    Texture texture;
    texture.kind = kind;
    texture.space = space;
    texture.first = {0.1, 0.3, 0.8};
    texture.second = {0.9, 0.8, 0.2};
    texture.frequency = {3.1, 2.3, 4.7};
    return texture;
}
inline std::shared_ptr<const Pixels> picture(float brightest) {
    Pixels pixels{4, 2, {}};
    for (std::uint32_t i = 0; i < 24; ++i) pixels.rgb.push_back(brightest * static_cast<float>(i * 7 % 24) / 23.0F);
    return std::make_shared<const Pixels>(std::move(pixels));
}

}  // namespace sample_parts

struct EffectSample {
    Effect effect;
    std::function<void(SampledScene&)> add;
};

// In the order of the effects, one each.
inline std::vector<EffectSample> effect_samples() {
    using namespace sample_parts;
    using enum Effect;
    using S = SampledScene;
    const std::array<glm::dvec3, 3> corners{glm::dvec3{-0.5, -0.4, 0.1}, {0.6, -0.3, -0.2}, {0.0, 0.7, 0.05}};
    const glm::dvec3 low(-0.4, -0.35, -0.3), high(0.45, 0.3, 0.35), above(0.1, 1.3, 0.4);
    const auto lit = [=](S& s) { s.sphere(clay()); };
    return {{triangles, [=](S& s) { s.triangle(silver(), corners); }}, {spheres, [=](S& s) { s.sphere(silver()); }},
        {cuboids, [=](S& s) { s.cuboid(silver(), low, high); }},
        {entity_motion,
            [=](S& s) {
                s.sphere(silver()).motion = {0.2, 0.3, 0.0};
            }},
        {lens,
            [=](S& s) {
                s.scene.camera.lens_radius = 0.2;
                s.scene.camera.focus_distance = 3.0;
                s.sphere(silver());
            }},
        {camera_motion,
            [=](S& s) {
                s.scene.camera.position_motion = {0.2, 0.05, 0.0};
                s.sphere(silver());
            }},
        {diffuse, [=](S& s) { s.sphere(clay()); }}, {specular, [=](S& s) { s.sphere(silver()); }},
        {fuzz,
            [=](S& s) {
                Material fuzzy = silver();
                fuzzy.fuzz = 0.4;
                s.sphere(fuzzy);
            }},
        {translucent, [=](S& s) { s.sphere(pane()); }},
        {schlick,
            [=](S& s) {
                Material glass = pane();
                glass.fresnel = Fresnel::schlick;
                s.sphere(glass);
            }},
        {rough_translucent,
            [=](S& s) {
                Material glass = pane();
                glass.roughness = 0.4;
                s.sphere(glass);
            }},
        {smooth_conductor, [=](S& s) { s.sphere(copper(0.0)); }},
        {rough_conductor, [=](S& s) { s.sphere(copper(0.5)); }}, {rough_diffuse, [=](S& s) { s.sphere(dust()); }},
        {boundary, [=](S& s) { s.sphere(skin()); }}, {emission, [=](S& s) { s.sphere(lamp()); }},
        {one_sided_emission, [=](S& s) { s.triangle(lamp(EmittingSides::front), corners); }},
        {translucent_emission, [=](S& s) { s.sphere(glowing()); }},
        {texture_coordinates,
            [=](S& s) { s.textured_sphere(checks(TextureKind::checker, TextureSpace::coordinates)); }},
        {checker, [=](S& s) { s.textured_sphere(checks(TextureKind::checker)); }},
        {noise, [=](S& s) { s.textured_sphere(checks(TextureKind::noise)); }},
        {image_texture,
            [=](S& s) {
                Texture texture = checks(TextureKind::image);
                texture.image = picture(1.0F);
                s.textured_sphere(texture);
            }},
        {background, [=](S& s) { s.sphere(silver()); }},
        {background_gradient,
            [=](S& s) {
                s.scene.background.up = {0.9, 0.8, 0.3};
                s.sphere(silver());
            }},
        {background_image,
            [=](S& s) {
                s.scene.background.image = picture(2.0F);
                s.sphere(silver());
            }},
        {medium_absorption, [=](S& s) { s.fog().absorption += glm::dvec3(0.1, 0.05, 0.2); }},
        {medium_scattering,
            [=](S& s) {
                s.fog().scattering = {0.2, 0.3, 0.15};
            }},
        {anisotropic_phase,
            [=](S& s) {
                s.fog().scattering = {0.2, 0.3, 0.15};
                s.fog().anisotropy = 0.6;
            }},
        {density_grid,
            [=](S& s) {
                DensityGrid grid;
                grid.cells = {2, 1, 2};
                grid.low = glm::dvec3(-1.5);
                grid.high = glm::dvec3(1.5);
                grid.density = {0.5F, 2.0F, 0.0F, 1.0F};
                s.fog().absorption += glm::dvec3(0.1, 0.05, 0.2);
                s.fog().grid = std::make_shared<const DensityGrid>(std::move(grid));
            }},
        {interiors, [=](S& s) { s.sphere(skin()); }},
        {nested_dielectrics,
            [=](S& s) {
                Material outer = pane(), inner = pane();
                outer.priority = 1;
                inner.priority = 2;
                inner.refractive_index = 1.2;
                s.sphere(outer);
                s.sphere(inner, {0.3, 0.2, 0.1}, 0.4);
            }},
        {light_sampling,
            [=](S& s) {
                lit(s);
                s.sphere(lamp(), above, 0.3);
            }},
        {triangle_lights,
            [=](S& s) {
                lit(s);
                s.triangle(lamp(), {glm::dvec3{-0.4, 1.3, 0.1}, {0.5, 1.4, 0.3}, {0.1, 1.2, 0.9}});
            }},
        {sphere_lights,
            [=](S& s) {
                lit(s);
                s.sphere(lamp(), above, 0.25);
            }},
        {cuboid_lights,
            [=](S& s) {
                lit(s);
                s.cuboid(lamp(), above, above + glm::dvec3(0.3, 0.2, 0.25));
            }},
        {ellipsoid_lights,
            [=](S& s) {
                lit(s);
                s.sphere(lamp(), above, 0.3).object_to_world[1][1] = 0.7;
            }},
        {point_lights,
            [=](S& s) {
                lit(s);
                s.light(PunctualKind::point);
            }},
        {spot_lights,
            [=](S& s) {
                lit(s);
                s.light(PunctualKind::spot);
            }},
        {suns,
            [=](S& s) {
                lit(s);
                s.light(PunctualKind::sun);
            }},
        {sampled_background,
            [=](S& s) {
                lit(s);
                s.scene.background.sampled = true;
            }},
        {direct_only,
            [=](S& s) {
                lit(s);
                s.settings.integrator = Integrator::whitted;
            }},
        {roulette,
            [=](S& s) {
                lit(s);
                s.settings.roulette_start = 1;
            }},
        {shading_normals, [=](S& s) { s.smooth_triangle(clay(), corners); }}};
}

// Side by side. Nothing for what cannot be in one scene: punctual lights with boundaries (MODEL.md section 8.3), an
// image and a gradient for a sky. With punctual lights and glass the integrator is whitted.
inline std::optional<SampledScene> scene_of_samples(const EffectSample& first, const EffectSample& second) {
    SampledScene made;
    made.place = -0.75;
    first.add(made);
    made.place = 0.75;
    second.add(made);
    const Scene& scene = made.scene;
    const auto any = [&](auto is) { return std::ranges::any_of(scene.materials, is); };
    const bool boundary = any([](const Material& m) { return m.kind == MaterialKind::boundary; });
    const bool glass = any([](const Material& m) { return m.translucent; });
    if (boundary && !scene.lights.empty()) return std::nullopt;
    if (scene.background.image && scene.background.down != scene.background.up) return std::nullopt;
    if (glass && !scene.lights.empty()) made.settings.integrator = Integrator::whitted;
    return made;
}

}  // namespace tandem::test
