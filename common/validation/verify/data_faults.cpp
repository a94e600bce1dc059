#include "common/validation/verify/data_faults.h"

#include <algorithm>
#include <glm/common.hpp>
#include <utility>

namespace tandem {

namespace {

using glm::dvec3;

template <typename T>
bool set(T& value, const T& other) {
    if (value == other) return false;
    value = other;
    return true;
}

// Whether any material was changed.
template <typename Change>
bool change_materials(Scene& scene, Change change) {
    bool changed = false;
    for (Material& material : scene.materials) changed = change(material) || changed;
    return changed;
}

dvec3 in_8_bits(const dvec3& colour) { return glm::round(255.0 * colour) / 255.0; }
dvec3 blue_first(const dvec3& colour) { return {colour.z, colour.y, colour.x}; }

bool round_colours(Scene& scene) {
    return change_materials(scene, [](Material& m) { return set(m.colour, in_8_bits(m.colour)); });
}
bool exchange_channels(Scene& scene) {
    return change_materials(scene, [](Material& m) {
        const bool colour = set(m.colour, blue_first(m.colour));
        return set(m.radiance, blue_first(m.radiance)) || colour;
    });
}
template <bool eta_is_k>
bool mix_up_indices(Scene& scene) {
    return change_materials(scene, [](Material& m) {
        if (m.kind != MaterialKind::conductor) return false;
        return eta_is_k ? std::min({m.k.x, m.k.y, m.k.z}) > 0.0 && set(m.eta, m.k) : set(m.k, m.eta);
    });
}
template <bool last>
bool take_other_colour(Scene& scene) {
    if (scene.materials.size() < 2) return false;
    Material& material = last ? scene.materials.back() : scene.materials.front();
    return set(material.colour, (last ? scene.materials.front() : scene.materials.back()).colour);
}
bool lose_last_light(Scene& scene) {
    if (scene.lights.empty()) return false;
    scene.lights.pop_back();
    return true;
}
bool lose_last_entity(Scene& scene) {
    if (scene.entities.size() < 2) return false;
    scene.entities.pop_back();
    return true;
}
bool lose_last_primitive(Scene& scene) {
    if (scene.entities.empty() || scene.entities.back().primitive_count < 2) return false;
    --scene.entities.back().primitive_count;
    return true;
}
bool exchange_coordinates(Scene& scene) {
    bool changed = false;
    for (glm::dvec2& uv : scene.texture_coordinates) changed = set(uv, glm::dvec2(uv.y, uv.x)) || changed;
    return changed;
}
bool lose_priorities_of_empty(Scene& scene) {
    return change_materials(scene, [](Material& m) {
        if (m.interior != no_index || !m.priority) return false;
        m.priority.reset();
        return true;
    });
}
bool emit_to_front(Scene& scene) {
    return change_materials(
        scene, [](Material& m) { return m.radiance != dvec3(0.0) && set(m.sides, EmittingSides::front); });
}

bool lose_priorities(Scene& scene) {
    return change_materials(scene, [](Material& m) { return std::exchange(m.priority, std::nullopt).has_value(); });
}
bool lose_interiors(Scene& scene) {
    return change_materials(scene, [](Material& m) { return set(m.interior, no_index); });
}
bool lose_colours(Scene& scene) {
    return change_materials(scene, [](Material& m) { return set(m.colour, dvec3(1.0)); });
}
bool lose_roughness(Scene& scene) {
    return change_materials(
        scene, [](Material& m) { return m.kind != MaterialKind::rough_diffuse && set(m.roughness, 0.0); });
}
bool lose_fuzz(Scene& scene) {
    return change_materials(scene, [](Material& m) { return set(m.fuzz, 0.0); });
}
bool lose_alpha(Scene& scene) {
    return change_materials(scene, [](Material& m) { return set(m.alpha, 1.0); });
}
bool emit_to_both_sides(Scene& scene) {
    return change_materials(scene, [](Material& m) { return set(m.sides, EmittingSides::both); });
}
bool lose_motion(Scene& scene) {
    bool changed = false;
    for (Entity& entity : scene.entities) changed = set(entity.motion, dvec3(0.0)) || changed;
    return changed;
}
bool lose_normals(Scene& scene) { return !std::exchange(scene.normals, {}).empty(); }
bool lose_absorption(Scene& scene) {
    bool changed = false;
    for (Medium& medium : scene.media) changed = set(medium.absorption, dvec3(0.0)) || changed;
    return changed;
}
bool exchange_coefficients(Scene& scene) {
    bool changed = false;
    for (Medium& medium : scene.media) {
        changed = changed || medium.absorption != medium.scattering;
        std::swap(medium.absorption, medium.scattering);
    }
    return changed;
}

constexpr DataFault faults[] = {
    {"colours are rounded to 8 bits", round_colours, true},
    {"red and blue of materials are exchanged", exchange_channels, true},
    {"the k of conductors is their eta", mix_up_indices<false>, true},
    {"the eta of conductors is their k", mix_up_indices<true>, true},
    {"the first material has the last one's colour", take_other_colour<false>, true},
    {"the last material has the first one's colour", take_other_colour<true>, true},
    {"the last point light, spot or sun is lost", lose_last_light},
    {"the last entity is lost", lose_last_entity},
    {"the last entity lacks its last primitive", lose_last_primitive},
    {"u and v of texture coordinates are exchanged", exchange_coordinates},
    {"priorities are lost where a body has no interior", lose_priorities_of_empty},
    {"surfaces emit to the front alone", emit_to_front},
    {"priorities are lost", lose_priorities},
    {"interiors are lost", lose_interiors},
    {"colours are white", lose_colours},
    {"roughness is lost", lose_roughness},
    {"fuzz is lost", lose_fuzz},
    {"alpha is lost", lose_alpha},
    {"surfaces emit to both sides", emit_to_both_sides},
    {"motion is lost", lose_motion},
    {"normals of models are lost", lose_normals},
    {"absorption is lost", lose_absorption},
    {"absorption and scattering are exchanged", exchange_coefficients},
};

}  // namespace

std::span<const DataFault> data_faults() { return faults; }

}  // namespace tandem
