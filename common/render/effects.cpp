#include "common/render/effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

#include "common/error.h"
#include "common/render/renderer.h"
#include "common/scene/materials.h"

namespace tandem {

namespace {

struct EffectText {
    std::array<char, 24> name{};  // "entity-motion", then zeros
    std::string_view absent;      // why, where it is

    consteval EffectText(std::string_view identifier, std::string_view absent_) : absent(absent_) {
        for (std::size_t i = 0; i < identifier.size(); ++i) name.at(i) = identifier[i] == '_' ? '-' : identifier[i];
    }
};

constexpr std::array<EffectText, effect_count> texts{{
#define EFFECT(name, absent) {#name, absent},
#include "common/render/effects.def"
#undef EFFECT
}};

bool black(const glm::dvec3& colour) { return colour == glm::dvec3(0.0); }

bool reflects(const Material& material) { return material.kind != MaterialKind::emissive; }

bool black(const Background& background) {
    if (!background.image) return black(background.down) && black(background.up);
    for (const float value : background.image->rgb)
        if (value != 0.0F) return false;
    return true;
}

// Gathers the first reason for each effect.
class EffectFinder {
public:
    EffectFinder(const Scene& scene, const RenderSettings& settings) : scene_(scene), settings_(settings) {
        find_camera();
        if (scene.medium != no_index) find_medium(scene.medium);
        for (const Entity& entity : scene.entities)
            if (entity.primitive_count > 0) find_entity(entity);
        find_background();
        if (settings.roulette_start <= settings.bounces)
            call(Effect::roulette, fmt::format("roulette starts at event {}", settings.roulette_start));
        if (settings.integrator == Integrator::whitted) call(Effect::direct_only, "the integrator is whitted");
        find_light_sampling();
    }

    [[nodiscard]] std::vector<EffectFinding> findings() const {
        std::vector<EffectFinding> result;
        for (std::uint32_t i = 0; i < effect_count; ++i) {
            const bool needed = !reasons_[i].empty();
            result.push_back({static_cast<Effect>(i), needed, needed ? reasons_[i] : std::string(texts[i].absent)});
        }
        return result;
    }

private:
    void call(Effect effect, const std::string& reason) {
        std::string& kept = reasons_[static_cast<std::uint32_t>(effect)];
        if (kept.empty()) kept = reason;
    }
    [[nodiscard]] bool called(Effect effect) const { return !reasons_[static_cast<std::uint32_t>(effect)].empty(); }
    [[nodiscard]] bool any_called(EffectSet some) const {
        for (std::uint32_t i = 0; i < effect_count; ++i)
            if (some.has(static_cast<Effect>(i)) && !reasons_[i].empty()) return true;
        return false;
    }

    void find_camera() {
        const Camera& camera = scene_.camera;
        if (camera.lens_radius > 0.0) call(Effect::lens, "the camera has a lens");
        if (!black(camera.position_motion) || !black(camera.target_motion))
            call(Effect::camera_motion, "the camera moves");
    }

    void find_background() {
        const Background& background = scene_.background;
        if (black(background)) return;
        call(Effect::background, "the background has light");
        if (background.image)
            call(Effect::background_image, "the background is an image");
        else if (background.down != background.up)
            call(Effect::background_gradient, "the background differs from down to up");
    }

    void find_medium(std::uint32_t index) {
        const Medium& medium = scene_.media[index];
        const std::string reason = fmt::format("medium \"{}\"", medium.name);
        if (black(medium.absorption) && black(medium.scattering)) return;
        call(Effect::medium_absorption, reason);
        if (medium.grid) call(Effect::density_grid, reason);
        if (black(medium.scattering)) return;
        call(Effect::medium_scattering, reason);
        if (medium.anisotropy != 0.0) call(Effect::anisotropic_phase, reason);
    }

    void find_texture(const Texture& texture) {
        const std::string reason = fmt::format("texture \"{}\"", texture.name);
        if (texture.kind == TextureKind::checker) call(Effect::checker, reason);
        if (texture.kind == TextureKind::noise) call(Effect::noise, reason);
        if (texture.kind == TextureKind::image) call(Effect::image_texture, reason);
        if (texture.kind == TextureKind::image || texture.space == TextureSpace::coordinates)
            call(Effect::texture_coordinates, reason);
    }

    void find_material(const Material& material) {
        const std::string reason = fmt::format("material \"{}\"", material.name);
        const bool emits = !black(material.radiance), scatters = reflects(material) || material.translucent;
        if (const std::optional<Effect> effect = called_effect(material)) call(*effect, reason);
        if (material.translucent) {
            call(Effect::translucent, reason);
            if (settings_.fresnel.value_or(material.fresnel) == Fresnel::schlick) call(Effect::schlick, reason);
            if (material.roughness > 0.0) call(Effect::rough_translucent, reason);
            if (emits) call(Effect::translucent_emission, reason);
        }
        if (scatters && material.fuzz > 0.0) call(Effect::fuzz, reason);
        if (emits) {
            call(Effect::emission, reason);
            if (material.sides == EmittingSides::front) call(Effect::one_sided_emission, reason);
        }
        if (scatters && material.colour_texture != no_index) find_texture(scene_.textures[material.colour_texture]);
        if (material.interior != no_index) find_medium(material.interior);
        if (material.interior != no_index || material.priority) {
            call(Effect::interiors, reason);
            if (material.translucent) call(Effect::nested_dielectrics, reason);
        }
    }

    void find_entity(const Entity& entity) {
        const Material& material = scene_.materials[entity.material];
        find_material(material);
        const std::string reason = entity.name.empty() ? fmt::format("an entity of material \"{}\"", material.name)
                                                       : fmt::format("entity \"{}\"", entity.name);
        const bool moves = !black(entity.motion);
        if (moves) call(Effect::entity_motion, reason);
        const bool tracked = material.translucent && (material.interior != no_index || material.priority);
        const bool sampled = !tracked && !black(material.radiance) && !(material.translucent && material.alpha == 0.0);
        const bool stretched = !is_similarity(entity.object_to_world);
        const bool turns = material.kind != MaterialKind::boundary && (reflects(material) || material.translucent);
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            const Primitive& primitive = scene_.primitives[entity.first_primitive + i];
            const PrimitiveKind kind = primitive.kind;
            if (turns && kind == PrimitiveKind::triangle && is_smooth(primitive)) call(Effect::shading_normals, reason);
            const auto offset = static_cast<std::uint32_t>(kind);
            call(static_cast<Effect>(static_cast<std::uint32_t>(Effect::triangles) + offset), reason);
            if (!sampled) continue;
            light_reasons_[kind == PrimitiveKind::sphere && stretched ? ellipsoids : offset] = reason;
        }
    }

    [[nodiscard]] bool is_smooth(const Primitive& triangle) const {
        return !scene_.normals.empty() && !black(scene_.normals[triangle.index[0]]);
    }

    // Punctual lights, sampled primitives and the sampled background, where something receives their light.
    void find_light_sampling() {
        const bool samples = settings_.integrator != Integrator::path && settings_.bounces > 0;
        if (!samples || !any_called(light_receiving_effects())) return;
        const auto light = [&](Effect effect, const std::string& reason) {
            call(effect, reason);
            call(Effect::light_sampling, reason);
        };
        for (std::uint32_t kind = 0; kind < light_reasons_.size(); ++kind)
            if (!light_reasons_[kind].empty())
                light(static_cast<Effect>(static_cast<std::uint32_t>(Effect::triangle_lights) + kind),
                    light_reasons_[kind]);
        for (const PunctualLight& punctual : scene_.lights) {
            if (black(punctual.intensity)) continue;
            const std::string reason = fmt::format("light \"{}\"", punctual.name);
            if (punctual.kind == PunctualKind::sun)
                light(Effect::suns, reason);
            else
                light(Effect::point_lights, reason);
            if (punctual.kind == PunctualKind::spot) light(Effect::spot_lights, reason);
        }
        if (scene_.background.sampled && called(Effect::background))
            light(Effect::sampled_background, "the background is sampled");
    }

    const Scene& scene_;
    const RenderSettings& settings_;
    std::array<std::string, effect_count> reasons_;
    static constexpr std::size_t ellipsoids = 3;
    std::array<std::string, 4> light_reasons_;  // by kind of primitive, and of ellipsoids
};

}  // namespace

std::string_view effect_name(Effect effect) { return texts[static_cast<std::uint32_t>(effect)].name.data(); }

std::string effect_names(EffectSet set) {
    std::string names;
    for (std::uint32_t i = 0; i < effect_count; ++i)
        if (set.has(static_cast<Effect>(i))) names += (names.empty() ? "" : ", ") + std::string(texts[i].name.data());
    return names;
}

EffectSet light_receiving_effects() {
    EffectSet effects{Effect::medium_scattering};
    for (const MaterialRow& row : material_rows()) {
        if (row.receives == Receives::always && row.smooth) effects = effects.with(*row.smooth);
        if (row.receives != Receives::never && row.rough) effects = effects.with(*row.rough);
    }
    return effects;
}

std::vector<EffectFinding> find_effects(const Scene& scene, const RenderSettings& settings) {
    return EffectFinder(scene, settings).findings();
}

namespace {

EffectSet needed_of(const std::vector<EffectFinding>& findings) {
    EffectSet needed;
    for (const EffectFinding& finding : findings)
        if (finding.needed) needed = needed.with(finding.effect);
    return needed;
}

}  // namespace

EffectSet needed_effects(const Scene& scene, const RenderSettings& settings) {
    return needed_of(find_effects(scene, settings));
}

namespace {

// Light without a surface is found by sampling alone, which translucent and boundary surfaces block (MODEL.md sections
// 8.3 and 9.2). What it would bring through them would be missing without a word.
void refuse_lights_that_cannot_be_found(
    const Scene& scene, const RenderSettings& settings, const std::vector<EffectFinding>& findings) {
    const auto of = [&](Effect effect) -> const EffectFinding& { return findings[static_cast<std::size_t>(effect)]; };
    const bool punctual =
        std::ranges::any_of(scene.lights, [](const PunctualLight& light) { return !black(light.intensity); });
    if (!punctual) return;
    if (settings.integrator == Integrator::path)
        throw UnsupportedError(
            "the path integrator cannot find point, spot and sun lights; choose one that samples lights (next-event)");
    if (of(Effect::boundary).needed)
        throw UnsupportedError(
            "boundary surfaces block light sampling, so point, spot and sun lights would not reach what is behind "
            "them; use surfaces that emit");
    const EffectFinding& light = of(Effect::point_lights).needed ? of(Effect::point_lights) : of(Effect::suns);
    if (settings.integrator == Integrator::next_event && light.needed && of(Effect::translucent).needed)
        throw UnsupportedError(fmt::format(
            "{} is translucent and blocks light sampling, so that {} would leave black what is behind it (MODEL.md "
            "section 8.3). Use surfaces that emit, or the integrator whitted, which shows no light through glass, or "
            "bidirectional (cpu), which finds it",
            of(Effect::translucent).reason, light.reason));
}

}  // namespace

EffectSet effects_to_simulate(
    const Scene& scene, const RenderSettings& settings, EffectSet supported, std::string_view backend) {
    const std::vector<EffectFinding> findings = find_effects(scene, settings);
    const EffectSet needed = needed_of(findings);
    if (!settings.mis && settings.integrator != Integrator::next_event)
        throw UnsupportedError(
            "leaving out MIS (--mis off) is of the integrator next-event alone. path and whitted have no two ways to a "
            "light to weigh, bidirectional has no paths without weights. Add --integrator next-event or leave it out");
    refuse_lights_that_cannot_be_found(scene, settings, findings);
    if (const EffectSet lacking = needed.without(supported); lacking.size() > 0)
        throw UnsupportedError(fmt::format(
            "the {} backend does not simulate what this scene calls for: {}", backend, effect_names(lacking)));
    const EffectSet chosen = settings.effects.value_or(needed);
    if (const EffectSet left_out = needed.without(chosen); left_out.size() > 0)
        throw UnsupportedError(
            fmt::format("the chosen effects leave out what the scene calls for: {}; add them", effect_names(left_out)));
    return chosen.without(EffectSet::all().without(supported));
}

}  // namespace tandem
