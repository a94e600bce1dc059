#include "cpu_ref/oracle/textures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace tandem::oracle {
namespace {

using glm::dvec3;

// Three words from three [Jarzynski, Olano 2020, pcg3d].
std::array<std::uint32_t, 3> pcg3d(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    constexpr std::uint32_t multiplier = 1664525u, increment = 1013904223u;
    x = x * multiplier + increment;
    y = y * multiplier + increment;
    z = z * multiplier + increment;
    const auto mix = [&] {
        x += y * z;
        y += z * x;
        z += x * y;
    };
    mix();
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
    mix();
    return {x, y, z};
}

std::uint32_t word_of(double whole) { return static_cast<std::uint32_t>(static_cast<std::int64_t>(whole)); }

// g(i, j, k), each component in [-1, 1).
dvec3 gradient(const dvec3& corner, std::uint32_t seed) {
    const auto words = pcg3d(word_of(corner.x) + seed, word_of(corner.y), word_of(corner.z));
    const auto component = [](std::uint32_t word) { return 2.0 * (word >> 8) * 0x1p-24 - 1.0; };
    return {component(words[0]), component(words[1]), component(words[2])};
}

// N(q) [Perlin 1985].
double gradient_noise(const dvec3& q, std::uint32_t seed) {
    const dvec3 cell = glm::floor(q), r = q - cell, w = r * r * (3.0 - 2.0 * r);
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const dvec3 k(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1);
        const dvec3 share = glm::mix(1.0 - w, w, k);
        sum += share.x * share.y * share.z * glm::dot(gradient(cell + k, seed), r - k);
    }
    return sum;
}

double turbulence(const dvec3& q, const Texture& texture) {
    double sum = 0.0, scale = 1.0;
    for (std::uint32_t i = 0; i < texture.octaves; ++i, scale *= 2.0)
        sum += gradient_noise(scale * q, texture.seed) / scale;
    return std::abs(sum);
}

// s, the share of the second colour.
double noise_share(const dvec3& q, const Texture& texture) {
    double share = 0.0;
    switch (texture.style) {
        case NoiseStyle::smooth:
            share = 0.5 * (1.0 + gradient_noise(q, texture.seed));
            break;
        case NoiseStyle::turbulence:
            share = turbulence(q, texture);
            break;
        case NoiseStyle::marble: {
            const double turns = q.z + texture.amount * turbulence(q, texture);
            share = 0.5 * (1.0 + std::sin(2.0 * std::numbers::pi * (turns - std::floor(turns))));
            break;
        }
    }
    return std::clamp(share, 0.0, 1.0);
}

bool is_even(double whole) { return std::fmod(whole, 2.0) == 0.0; }

}  // namespace

dvec3 texture_colour(const Texture& texture, const dvec3& object_point, const glm::dvec2& coordinates) {
    const bool by_coordinates = texture.kind == TextureKind::image || texture.space == TextureSpace::coordinates;
    const dvec3 q = texture.frequency * (by_coordinates ? dvec3(coordinates, 0.0) : object_point);
    switch (texture.kind) {
        case TextureKind::checker:
            return is_even(std::floor(q.x) + std::floor(q.y) + std::floor(q.z)) ? texture.first : texture.second;
        case TextureKind::noise:
            return glm::mix(texture.first, texture.second, noise_share(q, texture));
        case TextureKind::image:
            return bilinear(*texture.image, q.x, q.y, Rows::repeated);
    }
    return texture.first;
}

dvec3 bilinear(const Pixels& image, double u, double v, Rows rows) {
    const double width = image.width, height = image.height;
    const double x = u * width - 0.5, y = (1.0 - v) * height - 0.5;  // in texels from the middle of the upper left one
    const double column = std::floor(x), row = std::floor(y);
    const auto wrapped = [](double index, double count) { return index - count * std::floor(index / count); };
    const auto texel = [&](double i, double j) {
        const double kept_row = rows == Rows::held ? std::clamp(j, 0.0, height - 1.0) : wrapped(j, height);
        const auto at = static_cast<std::size_t>(kept_row * width + wrapped(i, width)) * 3;
        return dvec3(image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]);
    };
    const auto across = [&](double j) { return glm::mix(texel(column, j), texel(column + 1.0, j), x - column); };
    return glm::mix(across(row), across(row + 1.0), y - row);
}

}  // namespace tandem::oracle
