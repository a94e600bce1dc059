#include "common/validation/verify/data_faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <string_view>
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

// Whether any entry of the table was changed.
template <typename Entry, typename Change>
bool change_all(std::vector<Entry>& table, const Change& change) {
    bool changed = false;
    for (Entry& entry : table) changed = change(entry) || changed;
    return changed;
}
template <typename Change>
DataFault in_materials(std::string words, Change change, bool of_data_alone = false) {
    return {std::move(words), [change](Scene& scene) { return change_all(scene.materials, change); }, of_data_alone};
}
template <typename Change>
DataFault in_media(std::string words, Change change) {
    return {std::move(words), [change](Scene& scene) { return change_all(scene.media, change); }};
}
template <typename Change>
DataFault in_entities(std::string words, Change change, bool of_data_alone = false) {
    return {std::move(words), [change](Scene& scene) { return change_all(scene.entities, change); }, of_data_alone};
}

// Each entry takes what the next one has, and the last one the first one's.
template <typename Entry, typename T>
DataFault from_the_next(std::string words, std::vector<Entry> Scene::*table, T Entry::*field) {
    return {std::move(words),
        [table, field](Scene& scene) {
            std::vector<Entry>& entries = scene.*table;
            const std::vector<Entry> sound = entries;
            bool changed = false;
            for (std::size_t i = 0; i < entries.size(); ++i)
                changed = set(entries[i].*field, sound[(i + 1) % sound.size()].*field) || changed;
            return changed;
        },
        true};
}

// As tables hold materials apart.
struct MaterialGroup {
    std::string_view name;
    bool (*holds)(const Material&);
};
constexpr std::array material_groups{
    MaterialGroup{"diffuse surfaces", [](const Material& m) { return m.kind == MaterialKind::diffuse; }},
    MaterialGroup{"mirrors", [](const Material& m) { return m.kind == MaterialKind::specular && !m.translucent; }},
    MaterialGroup{"glass", [](const Material& m) { return m.kind == MaterialKind::specular && m.translucent; }},
    MaterialGroup{"conductors", [](const Material& m) { return m.kind == MaterialKind::conductor; }},
    MaterialGroup{"rough diffuse surfaces", [](const Material& m) { return m.kind == MaterialKind::rough_diffuse; }},
    MaterialGroup{"emitters", [](const Material& m) { return m.kind == MaterialKind::emissive; }},
    MaterialGroup{"boundaries", [](const Material& m) { return m.kind == MaterialKind::boundary; }},
};

template <typename T>
void lose(std::vector<DataFault>& faults, std::string_view field, T Material::*member, const T& otherwise,
    std::string_view words = {}) {
    const auto changed = [=](Material& m) { return set(m.*member, otherwise); };
    faults.push_back(in_materials(words.empty() ? fmt::format("{} is lost", field) : std::string(words), changed));
    for (const MaterialGroup& group : material_groups) {
        const auto holds = group.holds;
        faults.push_back(in_materials(fmt::format("the {} of {} is lost", field, group.name),
            [=](Material& m) { return holds(m) && changed(m); }));
    }
}

// `lost`: a value that says no more than that the field was lost.
void copy(std::vector<DataFault>& faults, std::string_view to_name, double Material::*to, std::string_view from_name,
    double Material::*from, double lost) {
    faults.push_back(in_materials(
        fmt::format("the {} of materials is their {}", to_name, from_name),
        [=](Material& m) { return m.*from != lost && m.*to != lost && set(m.*to, m.*from); }, true));
}

dvec3 in_8_bits(const dvec3& colour) { return glm::round(255.0 * colour) / 255.0; }
dvec3 blue_first(const dvec3& colour) { return {colour.z, colour.y, colour.x}; }

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
bool lose_normals(Scene& scene) { return !std::exchange(scene.normals, {}).empty(); }
bool transpose(Entity& entity) {
    const glm::dmat3 turned = glm::transpose(glm::dmat3(entity.object_to_world));
    glm::dmat4 wrong(turned);
    wrong[3] = entity.object_to_world[3];
    return set(entity.object_to_world, wrong);
}

void add_of_data_alone(std::vector<DataFault>& faults) {
    faults.push_back(in_materials(
        "colours are rounded to 8 bits", [](Material& m) { return set(m.colour, in_8_bits(m.colour)); }, true));
    faults.push_back(in_materials(
        "red and blue of materials are exchanged",
        [](Material& m) {
            const bool colour = set(m.colour, blue_first(m.colour));
            return set(m.radiance, blue_first(m.radiance)) || colour;
        },
        true));
    const auto metal = [](const Material& m) { return m.kind == MaterialKind::conductor; };
    faults.push_back(in_materials(
        "the k of conductors is their eta", [=](Material& m) { return metal(m) && set(m.k, m.eta); }, true));
    faults.push_back(in_materials(
        "the eta of conductors is their k",
        [=](Material& m) {
            return metal(m) && std::min({m.k.x, m.k.y, m.k.z}) > 0.0 && set(m.eta, m.k);
        },
        true));
    faults.push_back({"the first material has the last one's colour", take_other_colour<false>, true});
    faults.push_back({"the last material has the first one's colour", take_other_colour<true>, true});
    copy(faults, "fuzz", &Material::fuzz, "roughness", &Material::roughness, 0.0);
    copy(faults, "roughness", &Material::roughness, "fuzz", &Material::fuzz, 0.0);
    copy(faults, "fuzz", &Material::fuzz, "alpha", &Material::alpha, 1.0);
    copy(faults, "alpha", &Material::alpha, "fuzz", &Material::fuzz, 0.0);
    copy(faults, "alpha", &Material::alpha, "roughness", &Material::roughness, 0.0);
    copy(faults, "roughness", &Material::roughness, "alpha", &Material::alpha, 1.0);
    faults.push_back(in_entities("the rows and columns of entities' maps are exchanged", transpose, true));
    faults.push_back(from_the_next("entities have the next one's material", &Scene::entities, &Entity::material));
    faults.push_back(from_the_next("entities have the next one's motion", &Scene::entities, &Entity::motion));
    faults.push_back(from_the_next("materials have the next one's colour", &Scene::materials, &Material::colour));
    faults.push_back(
        from_the_next("materials have the next one's texture", &Scene::materials, &Material::colour_texture));
    faults.push_back(from_the_next("media have the next one's absorption", &Scene::media, &Medium::absorption));
    faults.push_back(from_the_next("media have the next one's scattering", &Scene::media, &Medium::scattering));
    faults.push_back(from_the_next("media have the next one's anisotropy", &Scene::media, &Medium::anisotropy));
    faults.push_back(from_the_next("lights have the next one's intensity", &Scene::lights, &PunctualLight::intensity));
    faults.push_back(from_the_next("lights have the next one's direction", &Scene::lights, &PunctualLight::direction));
}

void add_of_media(std::vector<DataFault>& faults) {
    faults.push_back(in_media("absorption is lost", [](Medium& m) { return set(m.absorption, dvec3(0.0)); }));
    faults.push_back(in_media("scattering is lost", [](Medium& m) { return set(m.scattering, dvec3(0.0)); }));
    faults.push_back(in_media("anisotropy is lost", [](Medium& m) { return set(m.anisotropy, 0.0); }));
    for (const bool with_grid : {false, true})
        faults.push_back(
            in_media(fmt::format("the anisotropy of media {} a density grid is lost", with_grid ? "with" : "without"),
                [=](Medium& m) { return (m.grid != nullptr) == with_grid && set(m.anisotropy, 0.0); }));
    faults.push_back(
        in_media("anisotropy has the other sign", [](Medium& m) { return set(m.anisotropy, -m.anisotropy); }));
    faults.push_back(in_media("density grids are lost", [](Medium& m) { return set(m.grid, {}); }));
    faults.push_back(in_media("absorption and scattering are exchanged", [](Medium& m) {
        std::swap(m.absorption, m.scattering);
        return m.absorption != m.scattering;
    }));
}

void add_of_shapes(std::vector<DataFault>& faults) {
    faults.push_back({"the last point light, spot or sun is lost", lose_last_light});
    faults.push_back({"the last entity is lost", lose_last_entity});
    faults.push_back({"the last entity lacks its last primitive", lose_last_primitive});
    faults.push_back({"normals of models are lost", lose_normals});
    faults.push_back({"u and v of texture coordinates are exchanged", [](Scene& scene) {
                          return change_all(scene.texture_coordinates,
                              [](glm::dvec2& uv) { return set(uv, glm::dvec2(uv.y, uv.x)); });
                      }});
    faults.push_back(in_entities("motion is lost", [](Entity& e) { return set(e.motion, dvec3(0.0)); }));
    faults.push_back(in_entities("motion has the other sign", [](Entity& e) { return set(e.motion, -e.motion); }));
}

void add_of_materials(std::vector<DataFault>& faults) {
    using M = Material;
    faults.push_back(in_materials("priorities are lost where a body has no interior",
        [](M& m) { return m.interior == no_index && set(m.priority, {}); }));
    faults.push_back(in_materials("priorities have the other sign",
        [](M& m) { return m.priority && set(m.priority, std::optional(-*m.priority)); }));
    faults.push_back(in_materials("surfaces emit to the front alone",
        [](M& m) { return m.radiance != dvec3(0.0) && set(m.sides, EmittingSides::front); }));
    faults.push_back(
        in_materials("surfaces emit to both sides", [](M& m) { return set(m.sides, EmittingSides::both); }));
    lose(faults, "priority", &M::priority, std::optional<std::int32_t>{}, "priorities are lost");
    lose(faults, "interior", &M::interior, no_index, "interiors are lost");
    lose(faults, "texture", &M::colour_texture, no_index, "textures are lost");
    lose(faults, "colour", &M::colour, dvec3(1.0), "colours are white");
    lose(faults, "roughness", &M::roughness, 0.0);
    lose(faults, "fuzz", &M::fuzz, 0.0);
    lose(faults, "alpha", &M::alpha, 1.0);
    lose(faults, "refractive index", &M::refractive_index, M{}.refractive_index);
    lose(faults, "Fresnel formula", &M::fresnel, Fresnel::exact);
}

}  // namespace

std::vector<DataFault> data_faults() {
    std::vector<DataFault> faults;
    add_of_data_alone(faults);
    add_of_materials(faults);
    add_of_media(faults);
    add_of_shapes(faults);
    return faults;
}

}  // namespace tandem
