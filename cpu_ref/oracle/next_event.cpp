// MODEL.md section 9.2, rules 1 to 15 and 30 to 33, and 8.2, rule by rule. Written apart from both tracers, like the
// rest of the oracle.
#include "cpu_ref/oracle/next_event.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cpu_ref/oracle/interiors.h"
#include "cpu_ref/oracle/lights.h"
#include "cpu_ref/oracle/surfaces.h"

namespace tandem::oracle {
namespace {

using glm::dmat3;
using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity(), pi = std::numbers::pi;

double luminous(const dvec3& colour) { return colour.x + colour.y + colour.z; }  // Y

// The least index whose cumulative value exceeds `number`, and where the number lies within, from 0 to 1.
struct Choice {
    std::size_t index;
    double place;
};
template <class Iterator>
Choice choose(Iterator begin, Iterator end, double number) {
    auto found = std::upper_bound(begin, end, number);
    if (found == end) --found;  // rounding left none
    const double before = found == begin ? 0.0 : *std::prev(found);
    return {static_cast<std::size_t>(found - begin), std::clamp((number - before) / (*found - before), 0.0, 1.0)};
}

// Makes cumulative shares of a sum; returns the sum.
template <class Iterator>
double accumulate_shares(Iterator begin, Iterator end) {
    double sum = 0.0;
    for (auto at = begin; at != end; ++at) *at = sum += *at;
    for (auto at = begin; at != end && sum > 0.0; ++at) *at /= sum;
    return sum;
}

// Rule 9: no entry of the map's square is far from a multiple of the unit matrix.
bool is_similarity(const dmat3& map) {
    const dmat3 square = glm::transpose(map) * map;
    const double scale = (square[0][0] + square[1][1] + square[2][2]) / 3.0;
    double farthest = 0.0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) farthest = std::max(farthest, std::abs(square[i][j] - (i == j ? scale : 0.0)));
    return farthest <= 2e-5 * scale;
}

// A direction from outside of the unit sphere about the origin, uniform in the cone of what it fills, and the way to
// it.
struct Towards {
    dvec3 direction;
    double way, density;
};
Towards towards_unit_sphere(const dvec3& from, double a, double b) {
    const double distance = glm::length(from), sine_squared = 1.0 / (distance * distance);
    const double k = sine_squared / (1.0 + std::sqrt(1.0 - sine_squared));  // 1 - cos of the cone's half angle
    const double cosine = 1.0 - k * a, sine = std::sqrt(k * a * (2.0 - k * a));
    const dvec3 local(sine * std::cos(two_pi * b), sine * std::sin(two_pi * b), cosine);
    const double half_chord = std::sqrt(std::max(0.0, 1.0 - distance * distance * sine * sine));
    return {Frame(-from / distance).to_world(local), distance * cosine - half_chord, 1.0 / (two_pi * k)};
}

double area_of_unit_cell(const dvec3& first, const dvec3& second) { return glm::length(glm::cross(first, second)); }

}  // namespace

SampledLights::SampledLights(const Scene& scene, LightSampling sampling) : scene_(scene) {
    add_surfaces();
    for (const bool suns : {false, true})
        for (const PunctualLight& light : scene_.lights) {
            if ((light.kind == PunctualKind::sun) != suns || luminous(light.intensity) == 0.0) continue;
            const double cone =
                light.kind == PunctualKind::point ? 4.0 : 2.0 * (1.0 - std::cos(glm::radians(light.outer_degrees)));
            lights_.push_back({&light, suns ? 1.0 : cone * luminous(light.intensity)});
        }
    if (scene_.background.sampled) add_sky();
    share_probability(sampling);
    if (sampling == LightSampling::tree) grow_tree();
}

void SampledLights::add_surfaces() {
    std::uint32_t id = 0;
    for (const PlacedPrimitive place : placed_primitives(scene_)) {
        const Entity& entity = scene_.entities[place.entity];
        const Material& material = scene_.materials[entity.material];
        const Primitive& primitive = scene_.primitives[place.primitive];
        const dvec3 radiance = emitted(material, true);
        const std::uint32_t own_id = id++;
        if (luminous(radiance) == 0.0 || is_tracked(material)) continue;
        const dmat3 map(entity.object_to_world);
        const dvec3 shift(entity.object_to_world[3]);
        Surface light{own_id, primitive.kind, radiance, material.sides == EmittingSides::both, entity.motion, map,
            shift, {}, {}, {}, {}, 0.0};
        const auto corner = [&](std::size_t i) { return scene_.vertices[primitive.index.at(i)]; };
        if (primitive.kind == PrimitiveKind::triangle) {
            light.a = map * corner(0) + shift, light.b = map * corner(1) + shift, light.c = map * corner(2) + shift;
            light.area = 0.5 * area_of_unit_cell(light.b - light.a, light.c - light.a);
        } else if (primitive.kind == PrimitiveKind::sphere) {
            light.map = primitive.radius * map;
            light.centre = map * corner(0) + shift;
            light.area = 4.0 * pi * std::pow(std::abs(glm::determinant(light.map)), 2.0 / 3.0);
        } else {
            light.a = corner(0), light.b = corner(1);
            const dvec3 size = light.b - light.a;
            for (int face = 0; face < 6; ++face) {
                const int i = (face / 2 + 1) % 3, j = (face / 2 + 2) % 3;
                light.faces.push_back(area_of_unit_cell(size[i] * map[i], size[j] * map[j]));
            }
            light.area = accumulate_shares(light.faces.begin(), light.faces.end());
        }
        if (light.area > 0.0) lights_.push_back({light, light.area * luminous(radiance)});
    }
}

// Section 8.2.
void SampledLights::add_sky() {
    const Background& sky = scene_.background;
    if (!sky.image) {
        if (luminous(sky.down) + luminous(sky.up) > 0.0) lights_.push_back({Sky{}});
        return;
    }
    const Pixels& image = *sky.image;
    const std::uint32_t width = image.width, height = image.height;
    const auto texel = [&](std::uint32_t x, std::uint32_t y) {
        const float* rgb = &image.rgb[3 * (std::size_t{y} * width + x)];
        return luminous(dvec3(rgb[0], rgb[1], rgb[2]));
    };
    for (std::uint32_t y = 0; y < height; ++y) {
        const double angle = std::cos(pi * y / height) - std::cos(pi * (y + 1.0) / height);
        const auto begin = static_cast<std::ptrdiff_t>(cells_.columns.size());
        for (std::uint32_t x = 0; x < width; ++x) {
            double brightest = 0.0;
            for (const std::uint32_t row : {y - std::min(y, 1u), y, std::min(y + 1, height - 1)})
                for (const std::uint32_t column : {(x + width - 1) % width, x, (x + 1) % width})
                    brightest = std::max(brightest, texel(column, row));
            cells_.columns.push_back(angle * brightest);
        }
        cells_.rows.push_back(accumulate_shares(cells_.columns.begin() + begin, cells_.columns.end()));
    }
    const double sum = accumulate_shares(cells_.rows.begin(), cells_.rows.end());
    if (sum > 0.0 && sky.image_scale > 0.0) lights_.push_back({Sky{}});
}

bool SampledLights::is_far(const Light& light) {
    if (const auto* punctual = std::get_if<const PunctualLight*>(&light.is))
        return (*punctual)->kind == PunctualKind::sun;
    return std::holds_alternative<Sky>(light.is);
}

// Rules 6, 7 and 30.
void SampledLights::share_probability(LightSampling sampling) {
    double near = 0.0, far = 0.0;
    for (const Light& light : lights_) (is_far(light) ? far : near) += light.weight;
    const double group = near > 0.0 && far > 0.0 ? 0.5 : 1.0;
    near_share_ = near > 0.0 ? group : 0.0;
    for (Light& light : lights_) {
        light.probability = group * light.weight / (is_far(light) ? far : near);
        if (sampling == LightSampling::uniform) light.probability = 1.0 / static_cast<double>(lights_.size());
    }
}

// Rule 32.
LightLeaf SampledLights::leaf_of(const Surface& light) {
    LightLeaf leaf;
    leaf.strength = light.area * luminous(light.radiance) / 4.0;
    if (light.kind == PrimitiveKind::triangle) {
        leaf.low = glm::min(light.a, glm::min(light.b, light.c));
        leaf.high = glm::max(light.a, glm::max(light.b, light.c));
        leaf.strength *= light.back_emits ? 2.0 : 4.0;
        const double hand = glm::determinant(light.map) < 0.0 ? -1.0 : 1.0;
        if (!light.back_emits) leaf.axis = hand * glm::normalize(glm::cross(light.b - light.a, light.c - light.a));
    } else if (light.kind == PrimitiveKind::sphere) {
        const dmat3 rows = glm::transpose(light.map);
        const dvec3 half(glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2]));
        leaf.low = light.centre - half;
        leaf.high = light.centre + half;
    } else {
        leaf.low = dvec3(infinity);
        leaf.high = dvec3(-infinity);
        for (int i = 0; i < 8; ++i) {
            const dvec3 corner((i & 1) != 0 ? light.b.x : light.a.x, (i & 2) != 0 ? light.b.y : light.a.y,
                (i & 4) != 0 ? light.b.z : light.a.z);
            leaf.low = glm::min(leaf.low, light.map * corner + light.centre);
            leaf.high = glm::max(leaf.high, light.map * corner + light.centre);
        }
    }
    leaf.low += glm::min(light.motion, dvec3(0.0));
    leaf.high += glm::max(light.motion, dvec3(0.0));
    return leaf;
}

void SampledLights::grow_tree() {
    std::vector<LightLeaf> leaves;
    for (std::size_t i = 0; i < lights_.size() && !is_far(lights_[i]); ++i) {
        LightLeaf leaf;
        if (const auto* punctual = std::get_if<const PunctualLight*>(&lights_[i].is)) {
            const PunctualLight& light = **punctual;
            leaf.low = leaf.high = light.position;
            leaf.strength = luminous(light.intensity);
            if (light.kind == PunctualKind::spot) leaf.axis = light.direction;
        } else {
            leaf = leaf_of(std::get<Surface>(lights_[i].is));
        }
        leaf.light = i;
        leaves.push_back(leaf);
    }
    if (!leaves.empty()) tree_.emplace(std::move(leaves));
}

// Rules 5 and 31.
SampledLights::Chosen SampledLights::choose_light(const dvec3& from, const dvec3& side, double number) const {
    if (tree_ && number < near_share_) {
        const LightTree::Choice choice = tree_->choose(from, side, number / near_share_);
        return {choice.light, near_share_ * choice.probability};
    }
    std::size_t index = 0;
    for (double sum = lights_[0].probability; !(number < sum) && index + 1 < lights_.size();)
        sum += lights_[++index].probability;
    return {index, lights_[index].probability};
}

std::optional<LightSample> SampledLights::sample(
    const dvec3& from, const dvec3& side, double time, const Numbers& v) const {
    if (lights_.empty()) return std::nullopt;
    const auto [index, probability] = choose_light(from, side, v.first);
    const Light& light = lights_[index];
    if (const auto* punctual = std::get_if<const PunctualLight*>(&light.is)) {
        const PunctualView view = punctual_view(**punctual, from);
        return LightSample{view.direction, view.distance, view.irradiance / probability, no_primitive};
    }
    if (const auto* surface = std::get_if<Surface>(&light.is)) {
        const auto seen = seen_on(*surface, from - time * surface->motion, v.second, v.third);  // rule 12
        if (!seen) return std::nullopt;
        return LightSample{
            seen->direction, seen->distance, surface->radiance / (probability * seen->density), surface->primitive};
    }
    const Seen seen = in_sky(v.second, v.third);
    if (!(seen.density > 0.0)) return std::nullopt;
    return LightSample{seen.direction, seen.distance,
        background_radiance(scene_.background, seen.direction) / (probability * seen.density), no_primitive};
}

std::optional<SampledLights::Seen> SampledLights::seen_on(const Surface& light, const dvec3& from, double a, double b) {
    switch (light.kind) {
        case PrimitiveKind::triangle:
            return on_triangle(light, from, a, b);
        case PrimitiveKind::sphere:
            return on_sphere(light, from, a, b);
        case PrimitiveKind::cuboid:
            return on_cuboid(light, from, a, b);
    }
    return std::nullopt;
}

// Rules 8 and 15.
std::optional<SampledLights::Seen> SampledLights::on_triangle(
    const Surface& light, const dvec3& from, double a, double b) {
    const double s = std::sqrt(a);
    const dvec3 way = (1.0 - s) * light.a + s * (1.0 - b) * light.b + s * b * light.c - from;
    const double r = glm::length(way);
    // The corners go around the front counter-clockwise, but under a map that mirrors.
    const double hand = glm::determinant(light.map) < 0.0 ? -1.0 : 1.0;
    const dvec3 normal = hand * glm::normalize(glm::cross(light.b - light.a, light.c - light.a));
    const double cosine = -glm::dot(normal, way) / r;  // towards the receiver
    if (cosine == 0.0 || (cosine < 0.0 && !light.back_emits)) return std::nullopt;
    return Seen{way / r, r, r * r / (light.area * std::abs(cosine))};
}

// Rules 9 and 10. Under a similarity the cone is a cone in the world too, but its azimuth is that of the world's frame.
std::optional<SampledLights::Seen> SampledLights::on_sphere(
    const Surface& light, const dvec3& from, double a, double b) {
    const double volume = std::abs(glm::determinant(light.map));
    const dmat3 map = is_similarity(light.map) ? dmat3(std::cbrt(volume)) : light.map;
    const dvec3 x = glm::inverse(map) * (from - light.centre);
    Towards towards{};
    if (glm::dot(x, x) > 1.0) {
        towards = towards_unit_sphere(x, a, b);
    } else {
        if (!light.back_emits) return std::nullopt;
        const dvec3 y = unit_sphere(a, b), way = y - x;
        const double r = glm::length(way), cosine = std::abs(glm::dot(y, way)) / r;
        towards = {way / r, r, r * r / (4.0 * pi * cosine)};
    }
    const dvec3 direction = map * towards.direction;
    const double stretch = glm::length(direction);
    return Seen{direction / stretch, towards.way * stretch, towards.density * stretch * stretch * stretch / volume};
}

// Rules 11 and 15.
std::optional<SampledLights::Seen> SampledLights::on_cuboid(
    const Surface& light, const dvec3& from, double a, double b) {
    const Choice chosen = choose(light.faces.begin(), light.faces.end(), a);
    const auto face = static_cast<int>(chosen.index);
    const int axis = face / 2, first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
    const dvec3 size = light.b - light.a;
    dvec3 point(0.0), outward(0.0);
    point[axis] = face % 2 == 1 ? light.b[axis] : light.a[axis];
    point[first] = light.a[first] + chosen.place * size[first];
    point[second] = light.a[second] + b * size[second];
    outward[axis] = face % 2 == 1 ? 1.0 : -1.0;
    const dmat3 inverse = glm::inverse(light.map);
    const dvec3 normal = glm::normalize(glm::transpose(inverse) * outward);
    const dvec3 way = light.map * point + light.centre - from;
    const double r = glm::length(way), cosine = -glm::dot(normal, way) / r;
    if (cosine == 0.0) return std::nullopt;
    if (cosine < 0.0) {  // its back, which is seen from inside alone
        const dvec3 x = inverse * (from - light.centre);
        const bool inside = glm::all(glm::greaterThanEqual(x, light.a)) && glm::all(glm::lessThanEqual(x, light.b));
        if (!light.back_emits || !inside) return std::nullopt;
    }
    return Seen{way / r, r, r * r / (light.area * std::abs(cosine))};
}

// Section 8.2.
SampledLights::Seen SampledLights::in_sky(double a, double b) const {
    const Background& sky = scene_.background;
    if (!sky.image) {
        const double down = luminous(sky.down), up = luminous(sky.up);
        const double root = down + std::sqrt(down * down + a * (up * up - down * down));
        const double height = root > 0.0 ? a * (down + up) / root : 0.0, y = 2.0 * height - 1.0;
        const double across = std::sqrt(std::max(0.0, 1.0 - y * y));
        return {{across * std::cos(two_pi * b), y, across * std::sin(two_pi * b)}, infinity,
            (down + (up - down) * height) / (two_pi * (down + up))};
    }
    const std::uint32_t width = sky.image->width, height = sky.image->height;
    const Choice row = choose(cells_.rows.begin(), cells_.rows.end(), a);
    const auto columns = cells_.columns.begin() + static_cast<std::ptrdiff_t>(row.index * width);
    const Choice column = choose(columns, columns + width, b);
    const auto share_at = [](auto begin, std::size_t i) {
        const auto at = begin + static_cast<std::ptrdiff_t>(i);
        return i == 0 ? *at : *at - *std::prev(at);
    };
    const auto row_index = static_cast<double>(row.index);
    const double above = std::cos(pi * row_index / height), below = std::cos(pi * (row_index + 1.0) / height);
    const double y = above + row.place * (below - above), across = std::sqrt(std::max(0.0, 1.0 - y * y));
    const double azimuth = two_pi * ((static_cast<double>(column.index) + column.place) / width - 0.5);
    const dvec3 turned(across * std::cos(azimuth), y, -across * std::sin(azimuth));
    const double angle = glm::radians(sky.rotation_degrees);
    const dvec3 direction(std::cos(angle) * turned.x + std::sin(angle) * turned.z, turned.y,
        std::cos(angle) * turned.z - std::sin(angle) * turned.x);
    const double share = share_at(cells_.rows.begin(), row.index) * share_at(columns, column.index);
    return {direction, infinity, share / (two_pi / width * (above - below))};
}

}  // namespace tandem::oracle
