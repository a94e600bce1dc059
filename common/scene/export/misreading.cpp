#include "common/scene/export/misreading.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string_view>

#include "common/scene/export/parts_json.h"

namespace tandem {

namespace {

using scene_export::Json;
using Pointer = Json::json_pointer;

Misreading misread(const Pointer& pointer, const Json& file, const Json& scene) {
    const std::string place = pointer.to_string();
    return {place, fmt::format("{} is {} in the file and {} in the scene", place, file.dump(),
                       scene.is_null() ? "nothing" : scene.dump())};
}

// But for the rounding to single precision, in which densities are kept.
bool same(double a, double b) { return a == b || std::abs(a - b) <= 0x1p-24 * std::max(std::abs(a), std::abs(b)); }

// What a scene does not keep as it is written: names of files, and how their numbers are encoded.
bool is_kept(std::string_view key) {
    constexpr std::array<std::string_view, 3> others{"file", "image", "colour_space"};
    return std::ranges::find(others, key) == others.end();
}

// What the writer leaves out where it is 0: so a scene without it has lost what the file says.
bool is_lost(std::string_view key, const Json& file) {
    constexpr std::array<std::string_view, 5> left_out{
        "motion", "lens_radius", "roulette_start", "ray_min", "anisotropy"};
    if (std::ranges::find(left_out, key) == left_out.end()) return false;
    const Json flat = file.is_structured() ? file.flatten() : Json::array({file});
    return std::ranges::any_of(flat, [](const Json& one) { return one.is_number() && one.get<double>() != 0.0; });
}

// Where both have a value of one kind; a file may also have other forms, which are not compared.
std::optional<Misreading> compared(const Json& file, const Json& scene, const Pointer& pointer) {
    if (file.is_number() && scene.is_number() && !same(file.get<double>(), scene.get<double>()))
        return misread(pointer, file, scene);
    if (((file.is_string() && scene.is_string()) || (file.is_boolean() && scene.is_boolean())) && file != scene)
        return misread(pointer, file, scene);
    if (file.is_array() && scene.is_array()) {
        if (file.size() != scene.size()) return misread(pointer, file.size(), scene.size());
        for (std::size_t i = 0; i < file.size(); ++i)
            if (auto found = compared(file[i], scene[i], pointer / i)) return found;
    }
    if (file.is_object() && scene.is_object())
        for (const auto& [key, value] : file.items()) {
            if (!scene.contains(key) && is_lost(key, value)) return misread(pointer / key, value, nullptr);
            if (is_kept(key) && scene.contains(key))
                if (auto found = compared(value, scene[key], pointer / key)) return found;
        }
    return std::nullopt;
}

// By name, those whose name is no other's.
template <class Thing, class Write>
Json by_name(const std::vector<Thing>& things, const Write& write) {
    Json written = Json::object();
    for (const Thing& thing : things)
        if (std::ranges::count(things, thing.name, &Thing::name) == 1) written[thing.name] = write(thing);
    return written;
}

Json parts_of(const Scene& scene) {
    const scene_export::SceneNames names(scene);
    return {{"render", scene_export::render_json(scene.defaults)}, {"camera", scene_export::camera_json(scene.camera)},
        {"background", scene_export::background_json(scene.background, "")},
        {"materials",
            by_name(scene.materials, [&](const Material& one) { return scene_export::material_json(one, names); })},
        {"textures", by_name(scene.textures, [](const Texture& one) { return scene_export::texture_json(one, ""); })},
        {"media", by_name(scene.media, [](const Medium& one) { return scene_export::medium_json(one); })}};
}

}  // namespace

std::optional<Misreading> misreading_of(const Scene& scene, const std::filesystem::path& file) {
    std::ifstream stream(file);
    Json said = Json::parse(stream, nullptr, false);
    if (!said.is_object()) return std::nullopt;
    const Json parts = parts_of(scene);
    if (auto found = compared(said, parts, Pointer())) return found;
    // One radiance everywhere has two forms.
    const auto background = said.find("background");
    if (background == said.end()) return std::nullopt;
    const bool is_short = background->is_array();
    const Json* const radiance = is_short ? &*background
                                 : background->is_object() && background->contains("radiance")
                                     ? &(*background)["radiance"]
                                     : nullptr;
    if (radiance == nullptr) return std::nullopt;
    for (const glm::dvec3& end : {scene.background.down, scene.background.up})
        if (auto found = compared(*radiance, scene_export::vector_json(end),
                is_short ? Pointer("/background") : Pointer("/background/radiance")))
            return found;
    return std::nullopt;
}

}  // namespace tandem
