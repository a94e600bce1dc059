#include "cpu_ref/path_tracer/material/textures.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "cpu_ref/path_tracer/arithmetic/sampling.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

namespace {

using glm::dvec2;
using glm::dvec3;

// An integer modulo 2^32, given as a whole number of any size.
std::uint32_t wrap(double whole) {
    constexpr double two_to_32 = 4294967296.0;
    if (std::abs(whole) < two_to_32) return static_cast<std::uint32_t>(static_cast<std::int64_t>(whole));
    const double rest = std::fmod(whole, two_to_32);
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(rest < 0.0 ? rest + two_to_32 : rest));
}

inline void hash_in_place(std::uint32_t& x, std::uint32_t& y, std::uint32_t& z) {
    x = x * 1664525u + 1013904223u;
    y = y * 1664525u + 1013904223u;
    z = z * 1664525u + 1013904223u;
    x += y * z;
    y += z * x;
    z += x * y;
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
    x += y * z;
    y += z * x;
    z += x * y;
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
    hash_in_place(v[0], v[1], v[2]);
    return v;
}

double gradient_noise(const dvec3& q, std::uint32_t seed) {
    const dvec3 cell = glm::floor(q), r = q - cell, w = r * r * (3.0 - 2.0 * r);
    const std::uint32_t x = wrap(cell.x) + seed, y = wrap(cell.y), z = wrap(cell.z);
    // The eight corners side by side, so that the compiler makes vectors of them.
    constexpr std::size_t corners = 8;
    std::array<std::uint32_t, corners> i{}, j{}, k{};
    std::array<double, corners> part{};
    for (std::uint32_t c = 0; c < corners; ++c) {
        i[c] = x + (c & 1u);
        j[c] = y + ((c >> 1) & 1u);
        k[c] = z + (c >> 2);
    }
    for (std::size_t c = 0; c < corners; ++c) hash_in_place(i[c], j[c], k[c]);
    const auto slope = [](std::uint32_t word) {
        return static_cast<double>(static_cast<std::int32_t>(word >> 8)) * 0x1p-23 - 1.0;
    };
    for (std::uint32_t c = 0; c < corners; ++c) {
        const double right = c & 1u, top = (c >> 1) & 1u, back = c >> 2;
        const double share = (1.0 - right + (2.0 * right - 1.0) * w.x) * (1.0 - top + (2.0 * top - 1.0) * w.y) *
                             (1.0 - back + (2.0 * back - 1.0) * w.z);
        part[c] = share * (slope(i[c]) * (r.x - right) + slope(j[c]) * (r.y - top) + slope(k[c]) * (r.z - back));
    }
    double sum = 0.0;
    for (const double p : part) sum += p;
    return sum;
}

dvec3 bilinear(const Pixels& image, double u, double v, Rows rows) {
    const bool repeated = rows == Rows::repeated;  // that of a texture; skies hold theirs
    const bool nearest = planted(repeated ? PlantedBug::texture_nearest : PlantedBug::sky_nearest);
    const double half = nearest || (repeated && planted(PlantedBug::texture_half_texel)) ? 0.0 : 0.5;
    const double x = u * image.width - half, y = (1.0 - v) * image.height - half;
    const double left = std::floor(x), top = std::floor(y);
    double fx = nearest ? 0.0 : x - left, fy = nearest ? 0.0 : y - top;
    if (planted(PlantedBug::texture_weights_short))
        for (double* const weight : {&fx, &fy}) *weight = std::round(*weight * 256.0) / 256.0;
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

namespace {
constexpr std::array<dvec2, 3> default_coordinates{dvec2(0.0, 0.0), dvec2(1.0, 0.0), dvec2(0.0, 1.0)};
}  // namespace

TextureTable::TextureTable(const Scene& scene, std::shared_ptr<const MeshTable> meshes)
    : textures_(scene.textures), meshes_(std::move(meshes)) {
    if (textures_.empty()) return;
    for (const Entity& entity : scene.entities)
        entities_.push_back({scene.materials[entity.material].colour_texture, glm::inverse(entity.object_to_world)});
    for (const PlacedPrimitive placed : placed_primitives(scene)) {
        if (meshes_ && meshes_->is_place(placed.entity)) continue;
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

TextureTable::Shape TextureTable::shape_of_mesh(std::uint32_t slot) const {
    const MeshTable::Place& place = meshes_->place_of(slot);
    const std::array<std::uint32_t, 3>& indices = meshes_->indices_of(place, slot);
    Shape shape{PrimitiveKind::triangle, place.entity, meshes_->corners_of(indices), default_coordinates};
    for (std::size_t i = 0; i < 3 && !meshes_->coordinates.empty(); ++i)
        shape.coordinates[i] = meshes_->coordinates[indices[i]];
    return shape;
}

dvec3 TextureTable::colour(std::uint32_t primitive, unsigned face, const dvec3& point) const {
    const std::uint32_t entity = in_mesh(primitive) ? meshes_->place_of(primitive).entity : shapes_[primitive].entity;
    const Placement& placement = entities_[entity];
    const Texture& texture = textures_[placement.texture];
    const dvec3 object_point(placement.world_to_object * glm::dvec4(point, 1.0));
    const bool by_coordinates = texture.kind == TextureKind::image || texture.space == TextureSpace::coordinates;
    const dvec2 place = by_coordinates ? coordinates(primitive, face, object_point) : dvec2(0.0);
    return texture_colour(texture, object_point, place);
}

dvec2 TextureTable::coordinates(std::uint32_t primitive, unsigned face, const dvec3& object_point) const {
    return in_mesh(primitive) ? coordinates(shape_of_mesh(primitive), face, object_point)
                              : coordinates(shapes_[primitive], face, object_point);
}

dvec2 TextureTable::coordinates(const Shape& shape, unsigned face, const dvec3& object_point) {
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
