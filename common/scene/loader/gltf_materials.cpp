#include "common/scene/loader/gltf_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

namespace tandem::scene_json {

namespace {

constexpr double least_roughness = 0.03, greatest_k = 1e3;  // of scene files (common/scene/materials.cpp)
constexpr double greatest_strength = 1e18, greatest_absorption = 1e9;

// The mean over an image of one of its channels.
double mean_of(const Pixels& image, std::size_t channel) {
    double sum = 0.0;
    for (std::size_t i = channel; i < image.rgb.size(); i += 3) sum += static_cast<double>(image.rgb[i]);
    return 3.0 * sum / static_cast<double>(image.rgb.size());
}

// glTF's factors: `size` numbers from 0 to 1.
glm::dvec3 read_factor(const Value& object, std::string_view key, std::size_t size, double otherwise) {
    if (!object.has(key)) return glm::dvec3(otherwise);
    const Value value = object.member(key);
    if (value.array_size() != size)
        value.refuse(fmt::format("has {} elements", value.array_size()), fmt::format("write {} numbers", size));
    glm::dvec3 factor;
    for (std::size_t i = 0; i < size; ++i) {
        const double number = value.element(i).number(0.0, 1.0);
        if (i < 3) factor[static_cast<int>(i)] = number;
    }
    return factor;
}

Value empty_object() {
    static const Json none = Json::object();
    return {none, ""};
}

Value object_or_empty(const Value& object, std::string_view key) {
    return object.has(key) ? object.member(key) : empty_object();
}

// A metal that reflects `colour` at normal incidence and everything at grazing, as glTF's does: (k²)/(4 + k²) = C for
// an index 1 + ik.
glm::dvec3 k_of(const glm::dvec3& colour) {
    return glm::min(2.0 * glm::sqrt(colour / glm::max(1.0 - colour, 1e-12)), greatest_k);
}

std::string decoded_uri(std::string_view uri) {
    std::string name;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const std::string_view digits = uri.substr(std::min(i + 1, uri.size()), 2);
        constexpr std::string_view hexadecimal = "0123456789abcdefABCDEF";
        if (uri[i] == '%' && digits.size() == 2 && digits.find_first_not_of(hexadecimal) == std::string_view::npos) {
            name += static_cast<char>(std::stoi(std::string(digits), nullptr, 16));
            i += 2;
        } else {
            name += uri[i];
        }
    }
    return name;
}

}  // namespace

// A material as glTF describes it.
struct GltfMaterials::Surface {
    glm::dvec3 base{1.0}, emission{0.0};
    std::shared_ptr<const Pixels> base_image;
    double metallic = 1.0, roughness = 1.0, transmission = 0.0, index = 1.5, specular = 1.0, strength = 1.0;
    bool double_sided = false;
    glm::dvec3 absorption{0.0};  // inside

    [[nodiscard]] bool metal() const { return metallic >= 0.5; }
    [[nodiscard]] bool glass() const { return !metal() && transmission >= 0.5; }
};

std::uint32_t GltfMaterials::index_of(int material) {
    const auto found = index_.find(material);
    if (found != index_.end()) return found->second;
    const auto index = static_cast<std::uint32_t>(materials_.size());
    if (material < 0) {
        materials_.push_back(read(empty_object()));
        materials_.back().material.name = "default";
    } else {
        const Json number = material;
        const Value value = element("materials", Value(number, root_.place().file));
        materials_.push_back(read(value));
        const bool named = value.has("name") && !value.member("name").text().empty();
        materials_.back().material.name = named ? value.member("name").text() : fmt::format("material {}", material);
    }
    index_.emplace(material, index);
    return index;
}

Value GltfMaterials::element(std::string_view list, const Value& index) const {
    if (!root_.has(list)) index.refuse(fmt::format("the model has no {}", list), "export it again");
    const Value elements = root_.member(list);
    if (elements.array_size() == 0) elements.refuse("holds nothing", "export the model again");
    return elements.element(index.integer(0, static_cast<std::uint32_t>(elements.array_size() - 1)));
}

std::shared_ptr<const Pixels> GltfMaterials::read_texture(const Value& reference, bool srgb, const glm::dvec3& factor) {
    if (reference.has("texCoord") && reference.member("texCoord").integer(0, 255) != 0)
        passed_over_.insert("texCoord (TEXCOORD_0 is taken)");
    if (reference.has("extensions")) passed_over_.insert("KHR_texture_transform");
    const Value texture = element("textures", reference.required("index"));
    if (texture.has("sampler")) {
        const Value sampler = element("samplers", texture.member("sampler"));
        constexpr std::uint32_t repeat = 10497;
        for (const std::string_view wrap : {"wrapS", "wrapT"})
            if (sampler.has(wrap) && sampler.member(wrap).integer(0, 65535) != repeat)
                passed_over_.insert("wrapS and wrapT (images repeat)");
    }
    const Value source = texture.required("source");
    const Value image = element("images", source);
    const auto index = source.integer(0, 0xFFFFFFFFu);
    if (const auto found = embedded_.find(index); found != embedded_.end())
        return images_.read(fmt::format("image {}.{}", index, found->second.starts_with("\xFF\xD8") ? "jpg" : "png"),
            srgb, factor, found->second);
    const Value uri = image.required("uri");
    const std::string name = decoded_uri(uri.relative_file());
    if (name.find('\0') != std::string::npos) uri.refuse("is not a relative path", "export the model again");
    return images_.read(name, srgb, factor);
}

void GltfMaterials::read_metal_and_roughness(const Value& material, Surface& surface) {
    const Value pbr = object_or_empty(material, "pbrMetallicRoughness");
    surface.base = read_factor(pbr, "baseColorFactor", 4, 1.0);
    if (pbr.has("baseColorTexture"))
        surface.base_image = read_texture(pbr.member("baseColorTexture"), true, surface.base);
    surface.metallic = optional_number(pbr, "metallicFactor", 0.0, 1.0, 1.0);
    surface.roughness = optional_number(pbr, "roughnessFactor", 0.0, 1.0, 1.0);
    if (!pbr.has("metallicRoughnessTexture")) return;
    const auto image = read_texture(pbr.member("metallicRoughnessTexture"), false, glm::dvec3(1.0));
    surface.roughness *= mean_of(*image, 1);
    surface.metallic *= mean_of(*image, 2);
    passed_over_.insert("metallicRoughnessTexture (its mean is taken)");
}

void GltfMaterials::read_extensions(const Value& material, Surface& surface) {
    if (!material.has("extensions")) return;
    material.member("extensions").for_each_member([&](const std::string& name, const Value& extension) {
        if (name == "KHR_materials_transmission") {
            surface.transmission = optional_number(extension, "transmissionFactor", 0.0, 1.0, 0.0);
            if (extension.has("transmissionTexture")) passed_over_.insert("transmissionTexture");
        } else if (name == "KHR_materials_ior") {
            surface.index = optional_number(extension, "ior", 1.0, 1e3, 1.5);
        } else if (name == "KHR_materials_emissive_strength") {
            surface.strength = optional_number(extension, "emissiveStrength", 0.0, greatest_strength, 1.0);
        } else if (name == "KHR_materials_volume") {
            read_volume(extension, surface);
        } else if (name == "KHR_materials_specular") {
            surface.specular = optional_number(extension, "specularFactor", 0.0, 1.0, 1.0);
            if (surface.specular != 0.0) passed_over_.insert(name);
        } else {
            passed_over_.insert(printable(name));
        }
    });
}

// What is left of light after the attenuation distance is the attenuation colour. Thickness is that of the body.
void GltfMaterials::read_volume(const Value& volume, Surface& surface) {
    if (volume.has("thicknessTexture")) passed_over_.insert("thicknessTexture");
    if (optional_number(volume, "thicknessFactor", 0.0, greatest_length, 0.0) == 0.0) return;  // thin walls
    const double distance = optional_number(volume, "attenuationDistance", least_length, greatest_length, 0.0);
    const glm::dvec3 colour = read_factor(volume, "attenuationColor", 3, 1.0);
    if (distance > 0.0) surface.absorption = -glm::log(glm::max(colour, 1e-30)) / distance;
    surface.absorption = glm::min(glm::max(surface.absorption, 0.0), greatest_absorption);
}

void GltfMaterials::note_losses(const Value& material, const Surface& surface) {
    const auto lost = [&](bool there, const char* what) {
        if (there) passed_over_.insert(what);
    };
    for (const char* texture : {"normalTexture", "occlusionTexture"}) lost(material.has(texture), texture);
    lost(material.has("emissiveTexture"), "emissiveTexture, and what it colours");
    lost(material.has("alphaMode") && material.member("alphaMode").text() != "OPAQUE", "alphaMode");
    lost(surface.metallic != 0.0 && surface.metallic != 1.0, "metallic between 0 and 1 (rounded)");
    lost(!surface.metal() && surface.transmission != 0.0 && surface.transmission != 1.0,
        "transmission between 0 and 1 (rounded)");
    lost(!surface.metal() && !surface.glass() && surface.specular != 0.0 && surface.index != 1.0,
        "the gloss of what is no metal");
    lost(surface.metal() && surface.base_image, "baseColorTexture of metals (its mean is taken)");
    lost((surface.metal() || surface.glass()) && surface.emission != glm::dvec3(0.0), "emission of metals and glass");
}

ModelMaterial GltfMaterials::read(const Value& source) {
    Surface surface;
    read_metal_and_roughness(source, surface);
    read_extensions(source, surface);
    if (source.has("doubleSided")) surface.double_sided = source.member("doubleSided").boolean();
    // A texture of light would have to be multiplied in; the factor alone is mostly white.
    if (!source.has("emissiveTexture"))
        surface.emission = surface.strength * read_factor(source, "emissiveFactor", 3, 0.0);
    note_losses(source, surface);

    ModelMaterial result;
    Material& material = result.material;
    const double roughness = surface.roughness < least_roughness ? 0.0 : surface.roughness;
    if (surface.metal()) {
        glm::dvec3 colour = surface.base;
        if (const auto& image = surface.base_image)
            colour = glm::dvec3(mean_of(*image, 0), mean_of(*image, 1), mean_of(*image, 2));
        material.kind = MaterialKind::conductor;
        material.k = k_of(colour);
        material.roughness = roughness;
        return result;
    }
    material.colour = surface.base;
    result.colour_image = surface.base_image;
    if (surface.glass()) {
        material.kind = MaterialKind::specular;
        material.translucent = true;
        material.roughness = roughness;
        material.refractive_index = surface.index;
        if (surface.absorption != glm::dvec3(0.0)) {
            result.interior.emplace();
            result.interior->absorption = surface.absorption;
        }
        return result;
    }
    const bool reflects = surface.base != glm::dvec3(0.0), emits = surface.emission != glm::dvec3(0.0);
    material.kind = reflects || !emits ? MaterialKind::diffuse : MaterialKind::emissive;
    if (!reflects) result.colour_image = nullptr;
    material.radiance = surface.emission;
    material.sides = emits && !surface.double_sided ? EmittingSides::front : EmittingSides::both;
    return result;
}

}  // namespace tandem::scene_json
