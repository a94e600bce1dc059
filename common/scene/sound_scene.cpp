#include "common/scene/sound_scene.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace tandem {

namespace {

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool within(const glm::dvec3& v, double least, double greatest) {
    return v.x >= least && v.x <= greatest && v.y >= least && v.y <= greatest && v.z >= least && v.z <= greatest;
}
bool sound_radiance(const glm::dvec3& v) { return within(v, 0.0, 1e18); }
bool index(std::uint32_t i, std::size_t size) { return i == no_index || i < size; }

bool sound(const Pixels& pixels, double greatest) {
    return pixels.width > 0 && pixels.height > 0 &&
           pixels.rgb.size() == std::size_t{pixels.width} * pixels.height * 3 &&
           std::ranges::all_of(pixels.rgb, [&](float v) { return v >= 0.0F && v <= greatest; });
}

bool sound(const Camera& camera) {
    return finite(camera.position) && finite(camera.target) && finite(camera.up) && finite(camera.position_motion) &&
           finite(camera.target_motion) && camera.position != camera.target && camera.vertical_field_degrees > 0.0 &&
           camera.vertical_field_degrees < 180.0 && camera.lens_radius >= 0.0 && camera.lens_radius <= 1e18 &&
           camera.focus_distance > 0.0 && camera.focus_distance <= 1e18;
}

bool sound(const Background& background) {
    return sound_radiance(background.down) && sound_radiance(background.up) && background.image_scale > 0.0 &&
           std::isfinite(background.image_scale) && std::isfinite(background.rotation_degrees) &&
           (!background.image || sound(*background.image, 1e18));
}

bool sound(const Medium& medium) {
    if (!sound_radiance(medium.absorption) || !sound_radiance(medium.scattering) ||
        !(std::abs(medium.anisotropy) <= 0.99))
        return false;
    if (!medium.grid) return true;
    const DensityGrid& grid = *medium.grid;
    return finite(grid.low) && finite(grid.high) && glm::all(glm::lessThan(grid.low, grid.high)) &&
           grid.density.size() == std::size_t{grid.cells[0]} * grid.cells[1] * grid.cells[2] && !grid.density.empty() &&
           std::ranges::all_of(grid.density, [](float d) { return d >= 0.0F && d <= 1e9F; });
}

bool sound(const Texture& texture) {
    if (texture.kind == TextureKind::image) return texture.image && sound(*texture.image, 1.0);
    return within(texture.first, 0.0, 1.0) && within(texture.second, 0.0, 1.0) && within(texture.frequency, 0.0, 1e6) &&
           texture.octaves >= 1 && texture.octaves <= 16 && texture.amount >= 0.0 && texture.amount <= 1e3;
}

bool sound(const Material& material, const Scene& scene) {
    const double g = material.roughness, least_roughness = material.kind == MaterialKind::rough_diffuse ? 0.0 : 0.03;
    return within(material.colour, 0.0, 1.0) && sound_radiance(material.radiance) && material.alpha >= 0.0 &&
           material.alpha <= 1.0 && material.fuzz >= 0.0 && material.fuzz <= 1.0 && material.refractive_index > 0.0 &&
           material.refractive_index <= 1e3 && (g == 0.0 || (g >= least_roughness && g <= 1.0)) &&
           within(material.k, 0.0, 1e3) && within(material.eta, 1e-3, 1e3) &&
           index(material.colour_texture, scene.textures.size()) && index(material.interior, scene.media.size());
}

bool sound(const PunctualLight& light) {
    return finite(light.position) && std::abs(glm::length(light.direction) - 1.0) < 1e-9 &&
           sound_radiance(light.intensity) && light.inner_degrees >= 0.0 && light.inner_degrees < light.outer_degrees &&
           light.outer_degrees <= 90.0;
}

bool sound(const Primitive& primitive, const Scene& scene) {
    const std::size_t points = primitive.kind == PrimitiveKind::triangle ? 3
                               : primitive.kind == PrimitiveKind::cuboid ? 2
                                                                         : 1;
    for (std::size_t i = 0; i < points; ++i)
        if (primitive.index[i] >= scene.vertices.size()) return false;
    return primitive.kind != PrimitiveKind::sphere || (primitive.radius > 0.0 && std::isfinite(primitive.radius));
}

bool sound(const Entity& entity, const Scene& scene) {
    const glm::dmat4& m = entity.object_to_world;
    return entity.material < scene.materials.size() && entity.primitive_count > 0 &&
           std::size_t{entity.first_primitive} + entity.primitive_count <= scene.primitives.size() &&
           finite(entity.motion) && finite(glm::dvec3(m[0])) && finite(glm::dvec3(m[1])) && finite(glm::dvec3(m[2])) &&
           finite(glm::dvec3(m[3])) && std::abs(glm::determinant(glm::dmat3(m))) > 0.0;
}

}  // namespace

std::string unsound_part(const Scene& scene) {
    const auto all = [](const auto& list, const auto& check) { return std::ranges::all_of(list, check); };
    if (scene.film.width == 0 || scene.film.height == 0) return "film";
    if (!sound(scene.camera)) return "camera";
    if (!sound(scene.background)) return "background";
    if (!all(scene.textures, [](const Texture& t) { return sound(t); })) return "textures";
    if (!all(scene.media, [](const Medium& m) { return sound(m); })) return "media";
    if (!index(scene.medium, scene.media.size())) return "medium";
    if (!all(scene.materials, [&](const Material& m) { return sound(m, scene); })) return "materials";
    if (!all(scene.lights, [](const PunctualLight& l) { return sound(l); })) return "lights";
    if (!all(scene.vertices, finite)) return "vertices";
    if (!scene.texture_coordinates.empty() && scene.texture_coordinates.size() != scene.vertices.size())
        return "texture coordinates";
    if (!scene.normals.empty() && (scene.normals.size() != scene.vertices.size() || !all(scene.normals, finite)))
        return "normals";
    if (!all(scene.primitives, [&](const Primitive& p) { return sound(p, scene); })) return "primitives";
    if (!all(scene.entities, [&](const Entity& e) { return sound(e, scene); })) return "entities";
    if (scene.expect && !sound_radiance(scene.expect->radiance)) return "expect";
    return {};
}

}  // namespace tandem
