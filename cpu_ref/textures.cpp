#include "cpu_ref/textures.h"

#include <cmath>
#include <numbers>

#include "common/random.h"
#include "cpu_ref/sampling.h"

namespace tandem::cpu {

namespace {

using glm::dvec2;
using glm::dvec3;

// An integer modulo 2^32, given as a whole number of any size.
std::uint32_t wrap(double whole) {
    constexpr double two_to_32 = 4294967296.0;
    const double rest = std::fmod(whole, two_to_32);
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(rest < 0.0 ? rest + two_to_32 : rest));
}

bool odd(double whole) { return std::fmod(whole, 2.0) != 0.0; }

bool checker_is_second(const dvec3& q) {
    return (odd(std::floor(q.x)) != odd(std::floor(q.y))) != odd(std::floor(q.z));
}

double turbulence(const dvec3& q, const Texture& texture) {
    double sum = 0.0, scale = 1.0;
    for (std::uint32_t i = 0; i < texture.octaves; ++i, scale *= 2.0)
        sum += gradient_noise(q * scale, texture.seed) / scale;
    return std::abs(sum);
}

double sine_turns(double turns) { return cosine_sine_turns(Lanes<double>(turns - std::floor(turns))).sine[0]; }

double noise_share(const dvec3& q, const Texture& texture) {
    double s = 0.0;
    switch (texture.style) {
        case NoiseStyle::smooth:
            s = 0.5 * (1.0 + gradient_noise(q, texture.seed));
            break;
        case NoiseStyle::turbulence:
            s = turbulence(q, texture);
            break;
        case NoiseStyle::marble:
            s = 0.5 * (1.0 + sine_turns(q.z + texture.amount * turbulence(q, texture)));
            break;
    }
    return std::min(1.0, std::max(0.0, s));
}

// Texel `index` of `count`, repeated or held.
std::size_t texel(double index, std::uint32_t count, bool repeated) {
    const double last = static_cast<double>(count) - 1.0;
    if (!repeated) return static_cast<std::size_t>(std::min(last, std::max(0.0, index)));
    const double turn = index - std::floor(index / static_cast<double>(count)) * static_cast<double>(count);
    return static_cast<std::size_t>(std::min(last, std::max(0.0, turn)));
}

}  // namespace

std::array<std::uint32_t, 3> pcg3d(std::array<std::uint32_t, 3> v) {
    for (std::uint32_t& x : v) x = x * 1664525u + 1013904223u;
    const auto mix = [&v] {
        v[0] += v[1] * v[2];
        v[1] += v[2] * v[0];
        v[2] += v[0] * v[1];
    };
    mix();
    for (std::uint32_t& x : v) x ^= x >> 16;
    mix();
    return v;
}

double gradient_noise(const dvec3& q, std::uint32_t seed) {
    const dvec3 cell = glm::floor(q), r = q - cell, w = r * r * (3.0 - 2.0 * r);
    const std::array<std::uint32_t, 3> base{wrap(cell.x), wrap(cell.y), wrap(cell.z)};
    double sum = 0.0;
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
        const std::uint32_t i = corner & 1u, j = (corner >> 1) & 1u, k = corner >> 2;
        const auto word = pcg3d({base[0] + i + seed, base[1] + j, base[2] + k});
        dvec3 gradient(to_unit<double>(word[0]), to_unit<double>(word[1]), to_unit<double>(word[2]));
        gradient = 2.0 * gradient - 1.0;
        const double share = (i != 0 ? w.x : 1.0 - w.x) * (j != 0 ? w.y : 1.0 - w.y) * (k != 0 ? w.z : 1.0 - w.z);
        sum += share * glm::dot(gradient, r - dvec3(i, j, k));
    }
    return sum;
}

dvec3 bilinear(const Pixels& image, double u, double v, Rows rows) {
    const double x = u * image.width - 0.5, y = (1.0 - v) * image.height - 0.5;
    const double left = std::floor(x), top = std::floor(y), fx = x - left, fy = y - top;
    const bool repeated = rows == Rows::repeated;
    const auto at = [&](double column, double row) {
        const std::size_t index =
            3 * (texel(row, image.height, repeated) * image.width + texel(column, image.width, true));
        return dvec3(image.rgb[index], image.rgb[index + 1], image.rgb[index + 2]);
    };
    const dvec3 above = at(left, top) * (1.0 - fx) + at(left + 1.0, top) * fx;
    const dvec3 below = at(left, top + 1.0) * (1.0 - fx) + at(left + 1.0, top + 1.0) * fx;
    return above * (1.0 - fy) + below * fy;
}

dvec3 texture_colour(const Texture& texture, const dvec3& object_point, const dvec2& coordinates) {
    if (texture.kind == TextureKind::image)
        return bilinear(*texture.image, coordinates.x, coordinates.y, Rows::repeated);
    const dvec3 place =
        texture.space == TextureSpace::coordinates ? dvec3(coordinates.x, coordinates.y, 0.0) : object_point;
    const dvec3 q = texture.frequency * place;
    if (texture.kind == TextureKind::checker) return checker_is_second(q) ? texture.second : texture.first;
    const double s = noise_share(q, texture);
    return texture.first * (1.0 - s) + texture.second * s;
}

TextureTable::TextureTable(const Scene& scene) : textures_(scene.textures) {
    if (textures_.empty()) return;
    for (const Entity& entity : scene.entities)
        entities_.push_back({scene.materials[entity.material].colour_texture, glm::inverse(entity.object_to_world)});
    constexpr std::array<dvec2, 3> default_coordinates{dvec2(0.0, 0.0), dvec2(1.0, 0.0), dvec2(0.0, 1.0)};
    for (const PlacedPrimitive& placed : placed_primitives(scene)) {
        Shape shape;
        shape.entity = placed.entity;
        if (entities_[placed.entity].texture != no_index) {
            const Primitive& primitive = scene.primitives[placed.primitive];
            shape.kind = primitive.kind;
            const std::size_t count = shape.kind == PrimitiveKind::triangle ? 3
                                      : shape.kind == PrimitiveKind::cuboid ? 2
                                                                            : 1;
            for (std::size_t i = 0; i < count; ++i) {
                shape.points[i] = scene.vertices[primitive.index[i]];
                shape.coordinates[i] = scene.texture_coordinates.empty()
                                           ? default_coordinates[i]
                                           : scene.texture_coordinates[primitive.index[i]];
            }
        }
        shapes_.push_back(shape);
    }
}

dvec3 TextureTable::colour(std::uint32_t primitive, unsigned face, const dvec3& point) const {
    const Placement& placement = entities_[shapes_[primitive].entity];
    const Texture& texture = textures_[placement.texture];
    const dvec3 object_point(placement.world_to_object * glm::dvec4(point, 1.0));
    const bool by_coordinates = texture.kind == TextureKind::image || texture.space == TextureSpace::coordinates;
    return texture_colour(
        texture, object_point, by_coordinates ? coordinates(primitive, face, object_point) : dvec2(0.0));
}

dvec2 TextureTable::coordinates(std::uint32_t primitive, unsigned face, const dvec3& object_point) const {
    const Shape& shape = shapes_[primitive];
    const dvec3& origin = shape.points[0];
    if (shape.kind == PrimitiveKind::sphere) {
        const dvec3 n = glm::normalize(object_point - origin);
        return {0.5 + std::atan2(-n.z, n.x) * (0.5 * std::numbers::inv_pi),
            std::acos(std::min(1.0, std::max(-1.0, -n.y))) * std::numbers::inv_pi};
    }
    if (shape.kind == PrimitiveKind::cuboid) {
        const int axis = static_cast<int>(face / 2), j = axis == 0 ? 1 : 0, k = axis == 2 ? 1 : 2;
        const dvec3 size = shape.points[1] - origin, offset = object_point - origin;
        const auto fraction = [&](int i) { return size[i] > 0.0 ? offset[i] / size[i] : 0.0; };
        return {fraction(j), fraction(k)};
    }
    // Weights of corners 1 and 2: areas against the whole, along its normal.
    const dvec3 edge1 = shape.points[1] - origin, edge2 = shape.points[2] - origin, offset = object_point - origin;
    const dvec3 normal = glm::cross(edge1, edge2);
    const double scale = 1.0 / glm::dot(normal, normal);
    const double w1 = glm::dot(glm::cross(offset, edge2), normal) * scale;
    const double w2 = glm::dot(glm::cross(edge1, offset), normal) * scale;
    return shape.coordinates[0] * (1.0 - w1 - w2) + shape.coordinates[1] * w1 + shape.coordinates[2] * w2;
}

}  // namespace tandem::cpu
