#include "common/scene/export/parts_json.h"

#include <fmt/format.h>

#include <cmath>
#include <set>

#include "common/image/image_io_parts.h"
#include "common/render/renderer.h"
#include "common/scene/materials.h"

namespace tandem::scene_export {

namespace {

const Material& plain() {
    static const Material material;
    return material;
}

// The value of a field where it differs from its default, or is needed; null otherwise.
Json field_json(const MaterialField& field, const Material& material, const SceneNames& names, bool needed) {
    if (field.texture != nullptr && material.*field.texture != no_index)
        return {{"texture", names.textures[material.*field.texture]}};
    const auto value = [&](auto member) -> Json {
        using Type = std::remove_cvref_t<decltype(material.*member)>;
        const Type& own = material.*member;
        if (!needed && own == plain().*member) return nullptr;
        if constexpr (std::is_same_v<Type, glm::dvec3>)
            return vector_json(own);
        else if constexpr (std::is_enum_v<Type>)
            return std::string(field.choices[static_cast<std::size_t>(own)]);
        else if constexpr (std::is_same_v<Type, std::optional<std::int32_t>>)
            return own.value_or(0);
        else if constexpr (std::is_same_v<Type, std::uint32_t>)
            return names.media[own];
        else
            return own;
    };
    return std::visit(value, field.member);
}

// Each name once: a repeated one gets a number.
template <class Thing>
std::vector<std::string> unique_names(const std::vector<Thing>& things) {
    std::vector<std::string> names;
    std::set<std::string> taken;
    for (const Thing& thing : things) {
        std::string name = thing.name.empty() ? "unnamed" : thing.name;
        for (int number = 2; !taken.insert(name).second; ++number) name = fmt::format("{} {}", thing.name, number);
        names.push_back(name);
    }
    return names;
}

}  // namespace

Json matrix_json(const glm::dmat4& matrix) {
    Json rows = Json::array();
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) rows.push_back(matrix[column][row]);
    return rows;
}

SceneNames::SceneNames(const Scene& scene)
    : materials(unique_names(scene.materials)),
      textures(unique_names(scene.textures)),
      media(unique_names(scene.media)) {}

Json material_json(const Material& material, const SceneNames& names) {
    const MaterialRow& row = row_of(material.kind);
    Json json{{"kind", std::string(row.name)}};
    for (const FieldRule& rule : row.rules) {
        if (rule.when == FieldRule::When::opaque && material.translucent) continue;
        if (rule.when == FieldRule::When::translucent && !material.translucent) continue;
        if (rule.action == FieldRule::Action::refuse) continue;
        for (const MaterialField& field : rule.fields) {
            Json value = field_json(field, material, names, rule.action == FieldRule::Action::need);
            if (!value.is_null()) json[std::string(field.key)] = std::move(value);
        }
    }
    return json;
}

Json texture_json(const Texture& texture, const std::string& image_file) {
    if (texture.kind == TextureKind::image)
        return {{"kind", "image"}, {"file", image_file}, {"colour_space", "linear"}};
    Json json{{"kind", texture.kind == TextureKind::checker ? "checker" : "noise"},
        {"colours", {vector_json(texture.first), vector_json(texture.second)}},
        {"frequency", vector_json(texture.frequency)},
        {"space", texture.space == TextureSpace::object ? "object" : "coordinates"}};
    if (texture.kind == TextureKind::checker) return json;
    constexpr const char* styles[] = {"smooth", "turbulence", "marble"};
    json["style"] = styles[static_cast<std::size_t>(texture.style)];
    if (texture.style != NoiseStyle::smooth) json["octaves"] = texture.octaves;
    if (texture.style == NoiseStyle::marble) json["amount"] = texture.amount;
    json["seed"] = texture.seed;
    return json;
}

Json medium_json(const Medium& medium) {
    Json json{{"absorption", vector_json(medium.absorption)}, {"scattering", vector_json(medium.scattering)}};
    if (medium.anisotropy != 0.0) json["anisotropy"] = medium.anisotropy;
    if (const auto& grid = medium.grid)
        json["grid"] = {{"cells", grid->cells}, {"low", vector_json(grid->low)}, {"high", vector_json(grid->high)},
            {"density", grid->density}};
    return json;
}

Json background_json(const Background& background, const std::string& image_file) {
    if (background.image)
        return {{"image", image_file}, {"colour_space", "linear"}, {"scale", background.image_scale},
            {"rotation_degrees", background.rotation_degrees}, {"sampled", background.sampled}};
    if (background.down == background.up)
        return {{"radiance", vector_json(background.down)}, {"sampled", background.sampled}};
    return {
        {"down", vector_json(background.down)}, {"up", vector_json(background.up)}, {"sampled", background.sampled}};
}

Json render_json(const SceneDefaults& defaults) {
    Json json{{"integrator", std::string(integrator_names[static_cast<std::size_t>(defaults.integrator)])},
        {"bounces", defaults.bounces}};
    if (defaults.roulette_start != no_roulette) json["roulette_start"] = defaults.roulette_start;
    if (defaults.ray_min > 0.0) json["ray_min"] = defaults.ray_min;
    if (std::isfinite(defaults.ray_max)) json["ray_max"] = defaults.ray_max;
    return json;
}

Json camera_json(const Camera& camera) {
    Json json{{"position", vector_json(camera.position)}, {"target", vector_json(camera.target)},
        {"up", vector_json(camera.up)}, {"vertical_field_degrees", camera.vertical_field_degrees}};
    if (camera.lens_radius > 0.0) {
        json["lens_radius"] = camera.lens_radius;
        json["focus_distance"] = camera.focus_distance;
    }
    if (camera.position_motion != glm::dvec3(0.0) || camera.target_motion != glm::dvec3(0.0))
        json["motion"] = {
            {"position", vector_json(camera.position_motion)}, {"target", vector_json(camera.target_motion)}};
    return json;
}

std::string pfm_bytes(const Pixels& pixels) { return image_files::pfm_bytes(image_of(pixels)); }

Image image_of(const Pixels& pixels) {
    Image image;
    image.width = pixels.width;
    image.height = pixels.height;
    image.channels = {"R", "G", "B"};
    image.pixels = pixels.rgb;
    return image;
}

}  // namespace tandem::scene_export
