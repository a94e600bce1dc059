// What scenes of the suite are made of beyond tests/scene_builder.h: MODEL.md sections 5.1, 7.0, 7.6 to 8.3 and 10.
#pragma once

#include <utility>

#include "tests/suite/tracers.h"

namespace tandem::test {

// So small a field that its angles, 1e-15, vanish beside 1: every ray is on the axis, also where what it sees is
// steep.
inline constexpr double narrow_field = 1e-13;  // degrees

// Where views of SceneBuilder::floor aim: not at the origin, where its two triangles meet.
inline const dvec3 aim(0.31, 0.0, 0.17);

inline Material conductor(const dvec3& eta, const dvec3& k, double roughness = 0.0) {
    Material material;
    material.kind = MaterialKind::conductor;
    material.eta = eta;
    material.k = k;
    material.roughness = roughness;
    return material;
}

inline Material rough_glass(double refractive_index, double roughness) {
    Material material = glass(refractive_index);
    material.roughness = roughness;
    return material;
}

// The scene's medium number 0 within; add it by with_medium.
inline Material boundary() {
    Material material;
    material.kind = MaterialKind::boundary;
    material.interior = 0;
    return material;
}

inline Medium medium_of(const dvec3& absorption, const dvec3& scattering, double anisotropy = 0.0) {
    Medium medium;
    medium.name = "fog";
    medium.absorption = absorption;
    medium.scattering = scattering;
    medium.anisotropy = anisotropy;
    return medium;
}

inline Scene with_medium(Scene scene, Medium medium) {
    scene.media.push_back(std::move(medium));
    return scene;
}

// The medium fills all that is not inside a body.
inline Scene filled_with(Scene scene, Medium medium) {
    scene.media.push_back(std::move(medium));
    scene.medium = static_cast<std::uint32_t>(scene.media.size() - 1);
    return scene;
}

inline Scene with_light(Scene scene, PunctualLight light) {
    scene.lights.push_back(std::move(light));
    return scene;
}

inline PunctualLight point_light(const dvec3& position, const dvec3& intensity) {
    PunctualLight light;
    light.name = "point";
    light.position = position;
    light.intensity = intensity;
    return light;
}

inline PunctualLight sun(const dvec3& direction, const dvec3& irradiance) {
    PunctualLight light;
    light.name = "sun";
    light.kind = PunctualKind::sun;
    light.direction = glm::normalize(direction);
    light.intensity = irradiance;
    return light;
}

// All entities take the texture for their colour.
inline Scene textured(Scene scene, Texture texture) {
    scene.textures.push_back(std::move(texture));
    for (Material& material : scene.materials) material.colour_texture = 0;
    return scene;
}

// Texels whose channels all differ, in [0, 1].
inline std::shared_ptr<const Pixels> some_pixels(std::uint32_t width, std::uint32_t height, float scale = 1.0F) {
    Pixels pixels{width, height, {}};
    for (std::uint32_t i = 0; i < 3 * width * height; ++i)
        pixels.rgb.push_back(scale * static_cast<float>((i * 37 + 11) % 64) / 64.0F);
    return std::make_shared<const Pixels>(std::move(pixels));
}

// Bilinear between the middles of texels by tent weights of them all: columns repeat, rows repeat or are held.
inline dvec3 interpolated(const Pixels& image, double u, double v, bool rows_repeat) {
    dvec3 sum(0.0);
    const auto tent = [](double distance) { return std::max(0.0, 1.0 - std::abs(distance)); };
    const double width = image.width, height = image.height;
    for (std::uint32_t j = 0; j < image.height; ++j) {
        for (std::uint32_t i = 0; i < image.width; ++i) {
            const double x = u * width - (i + 0.5), y = (1.0 - v) * height - (j + 0.5);
            double across = 0.0, down = 0.0;
            for (const double period : {-2.0, -1.0, 0.0, 1.0, 2.0}) {
                across += tent(x - period * width);
                if (rows_repeat) down += tent(y - period * height);
            }
            const bool above = j == 0 && y < 0.0, below = j + 1 == image.height && y > 0.0;
            if (!rows_repeat) down = above || below ? 1.0 : tent(y);
            const std::size_t at = 3 * (std::size_t{j} * image.width + i);
            sum += across * down * dvec3(image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]);
        }
    }
    return sum;
}

}  // namespace tandem::test
