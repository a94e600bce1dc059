#include "common/validation/verdict/greatest_sample.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "common/scene/materials.h"

namespace tandem {

namespace {

using glm::dmat3;
using glm::dvec3;

constexpr double pi = std::numbers::pi, infinite = std::numeric_limits<double>::infinity();

double brightness(const dvec3& colour) { return colour.x + colour.y + colour.z; }

dvec3 world_point(const Entity& entity, const dvec3& point) {
    return dvec3(entity.object_to_world * glm::dvec4(point, 1.0));
}

// Corners of a cuboid in the world, bit k of the index choosing the greater side along axis k.
std::array<dvec3, 8> corners_of(const Scene& scene, const Entity& entity, const Primitive& cuboid) {
    const dvec3 &low = scene.vertices[cuboid.index[0]], &high = scene.vertices[cuboid.index[1]];
    std::array<dvec3, 8> corners;
    for (unsigned i = 0; i < corners.size(); ++i)
        corners[i] = world_point(
            entity, {(i & 1u) != 0 ? high.x : low.x, (i & 2u) != 0 ? high.y : low.y, (i & 4u) != 0 ? high.z : low.z});
    return corners;
}

// The area that a light's weight counts (MODEL.md section 9.2).
double light_area(const Scene& scene, const Entity& entity, const Primitive& primitive) {
    const auto corner = [&](std::size_t k) { return world_point(entity, scene.vertices[primitive.index[k]]); };
    switch (primitive.kind) {
        case PrimitiveKind::triangle:
            return 0.5 * glm::length(glm::cross(corner(1) - corner(0), corner(2) - corner(0)));
        case PrimitiveKind::sphere: {
            const double scale = std::cbrt(std::abs(glm::determinant(dmat3(entity.object_to_world))));
            return 4.0 * pi * primitive.radius * primitive.radius * scale * scale;
        }
        case PrimitiveKind::cuboid:
            break;
    }
    const std::array<dvec3, 8> c = corners_of(scene, entity, primitive);
    const dvec3 x = c[1] - c[0], y = c[2] - c[0], z = c[4] - c[0];
    return 2.0 * (glm::length(glm::cross(x, y)) + glm::length(glm::cross(y, z)) + glm::length(glm::cross(z, x)));
}

double distance_to_segment(const dvec3& p, const dvec3& a, const dvec3& b) {
    const dvec3 along = b - a;
    const double square = glm::dot(along, along);
    const double t = square > 0.0 ? std::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0.0;
    return glm::length(p - a - t * along);
}

double distance_to_triangle(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
    const dvec3 normal = glm::cross(b - a, c - a);
    const auto inside = [&](const dvec3& from, const dvec3& to) {
        return glm::dot(glm::cross(normal, to - from), p - from) >= 0.0;
    };
    if (glm::dot(normal, normal) > 0.0 && inside(a, b) && inside(b, c) && inside(c, a))
        return std::abs(glm::dot(p - a, glm::normalize(normal)));
    return std::min({distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
}

// At most the distance of `p` from the primitive, wherever it is while the shutter is open.
double least_distance(const Scene& scene, const Entity& entity, const Primitive& primitive, const dvec3& p) {
    const auto corner = [&](std::size_t k) { return world_point(entity, scene.vertices[primitive.index[k]]); };
    double distance = infinite;
    if (primitive.kind == PrimitiveKind::triangle) {
        distance = distance_to_triangle(p, corner(0), corner(1), corner(2));
    } else if (primitive.kind == PrimitiveKind::sphere) {
        // Let x be the light in the unit sphere's space: |p - y| = |N (x - u)| >= s ||x| - 1|. The least of three
        // singular values is s = |det| / (s_1 s_2) >= 2 |det| / (s_1^2 + s_2^2) >= 2 |det| / |N|^2.
        const dmat3 map = dmat3(entity.object_to_world) * primitive.radius;
        double squares = 0.0;
        for (glm::length_t k = 0; k < 3; ++k) squares += glm::dot(map[k], map[k]);
        const double singular = 2.0 * std::abs(glm::determinant(map)) / squares;
        distance = singular * std::abs(glm::length(glm::inverse(map) * (p - corner(0))) - 1.0);
    } else {
        const std::array<dvec3, 8> c = corners_of(scene, entity, primitive);
        for (const auto& [u, v] : {std::pair{1u, 2u}, {2u, 4u}, {4u, 1u}})
            for (const unsigned first : {0u, 7u - u - v})
                distance = std::min({distance, distance_to_triangle(p, c[first], c[first + u], c[first + u + v]),
                    distance_to_triangle(p, c[first], c[first + v], c[first + u + v])});
    }
    return std::max(0.0, distance - glm::length(entity.motion));
}

bool scatters(const Medium& medium) { return brightness(medium.scattering) > 0.0; }

double distance_to_scattering(const Scene& scene, const dvec3& position) {
    if (std::ranges::any_of(scene.media, scatters)) return 0.0;
    double distance = infinite;
    for (const PlacedPrimitive placed : placed_primitives(scene)) {
        const Entity& entity = scene.entities[placed.entity];
        if (receives_light(scene.materials[entity.material]))
            distance = std::min(distance, least_distance(scene, entity, scene.primitives[placed.primitive], position));
    }
    return distance;
}

// Greatest f cos of the vertices where lights are sampled.
dvec3 greatest_scattering(const Scene& scene) {
    dvec3 greatest(0.0);
    for (const Material& material : scene.materials)
        if (receives_light(material))
            greatest = glm::max(greatest, row_of(material.kind).greatest_scattering(material));
    for (const Medium& medium : scene.media) {
        const double g = std::abs(medium.anisotropy);
        if (scatters(medium)) greatest = glm::max(greatest, dvec3((1.0 + g) / (4.0 * pi * (1.0 - g) * (1.0 - g))));
    }
    return greatest;
}

bool is_sampled_light(const Material& material) {
    const bool tracked = material.translucent && (material.interior != no_index || material.priority);
    return brightness(material.radiance) > 0.0 && !tracked;
}

// Sum of the weights by which near lights share, and whether there are far ones, and how many.
struct LightShares {
    double near = 0.0, far = 0.0;
    double lights = 0.0;    // how many there are of either
    bool surfaces = false;  // a primitive or the background is among them
};

double near_weight(const PunctualLight& light) {
    const double power = brightness(light.intensity);
    return light.kind == PunctualKind::point ? 4.0 * power
                                             : 2.0 * (1.0 - std::cos(glm::radians(light.outer_degrees))) * power;
}

LightShares light_shares(const Scene& scene, bool sky_is_black) {
    LightShares shares;
    for (const PunctualLight& light : scene.lights) {
        if (brightness(light.intensity) <= 0.0) continue;
        shares.lights += 1.0;
        if (light.kind == PunctualKind::sun)
            shares.far += 1.0;
        else
            shares.near += near_weight(light);
    }
    for (const PlacedPrimitive placed : placed_primitives(scene)) {
        const Entity& entity = scene.entities[placed.entity];
        const Material& material = scene.materials[entity.material];
        if (!is_sampled_light(material)) continue;
        const double alpha = material.translucent ? material.alpha : 1.0;
        shares.lights += 1.0;
        shares.near +=
            light_area(scene, entity, scene.primitives[placed.primitive]) * alpha * brightness(material.radiance);
        shares.surfaces = true;
    }
    if (scene.background.sampled && !sky_is_black) {
        shares.far += 1.0;
        shares.lights += 1.0;
        shares.surfaces = true;
    }
    return shares;
}

// The most that a sample of a point, a spot or a sun can add.
dvec3 greatest_of_punctual(const Scene& scene, const LightShares& shares, LightSampling sampling) {
    const dvec3 scattering = greatest_scattering(scene);
    const double group = shares.near > 0.0 && shares.far > 0.0 ? 0.5 : 1.0;
    dvec3 greatest(0.0);
    for (const PunctualLight& light : scene.lights) {
        if (brightness(light.intensity) <= 0.0) continue;
        const bool sun = light.kind == PunctualKind::sun;
        double chance = group * (sun ? 1.0 / shares.far : near_weight(light) / shares.near);
        if (sampling == LightSampling::uniform) chance = 1.0 / shares.lights;
        // Nothing useful bounds it from below: a light deep in the tree may have 2^-10 of every node above it.
        if (sampling == LightSampling::tree && !sun && shares.lights - shares.far > 1.0) chance = 0.0;
        const double r = sun ? 1.0 : distance_to_scattering(scene, light.position);
        for (glm::length_t c = 0; c < 3; ++c)
            if (light.intensity[c] > 0.0 && scattering[c] > 0.0)
                greatest[c] = std::max(greatest[c], scattering[c] * light.intensity[c] / (chance * r * r));
    }
    return greatest;
}

dvec3 greatest_of_sky(const Background& sky) {
    if (!sky.image) return glm::max(sky.down, sky.up);
    dvec3 greatest(0.0);
    for (std::size_t i = 0; i < sky.image->rgb.size(); ++i) {
        double& channel = greatest[static_cast<glm::length_t>(i % channel_count)];
        channel = std::max(channel, sky.image_scale * sky.image->rgb[i]);
    }
    return greatest;
}

bool gains(const Material& material) {
    return row_of(material.kind).greatest_weight != nullptr && material.roughness > 0.0;
}

// The greatest tangent of the angle between a ray of the camera and the normal of a primitive that may gain. Where that
// is not known it is infinite: of curved primitives, of what moves, behind lenses.
double greatest_tangent(const Scene& scene) {
    const Camera& camera = scene.camera;
    if (camera.lens_radius > 0.0 || camera.position_motion != dvec3(0.0) || camera.target_motion != dvec3(0.0))
        return infinite;
    const dvec3 axis = glm::normalize(camera.target - camera.position);
    const double height = std::tan(0.5 * glm::radians(camera.vertical_field_degrees));
    const double half_diagonal = std::atan(height * std::hypot(1.0, double(scene.film.width) / scene.film.height));
    double greatest = 0.0;
    for (const PlacedPrimitive placed : placed_primitives(scene)) {
        const Entity& entity = scene.entities[placed.entity];
        const Primitive& primitive = scene.primitives[placed.primitive];
        if (!gains(scene.materials[entity.material])) continue;
        if (primitive.kind != PrimitiveKind::triangle || entity.motion != dvec3(0.0) || !scene.normals.empty())
            return infinite;
        const auto corner = [&](std::size_t k) { return world_point(entity, scene.vertices[primitive.index[k]]); };
        const dvec3 normal = glm::cross(corner(1) - corner(0), corner(2) - corner(0));
        if (glm::dot(normal, normal) == 0.0) continue;
        const double angle = std::acos(std::min(1.0, std::abs(glm::dot(axis, glm::normalize(normal))))) + half_diagonal;
        greatest = std::max(greatest, angle < 0.5 * pi ? std::tan(angle) : infinite);
    }
    return greatest;
}

// The most by which one event of the camera's own ray weighs a path; infinite: nothing bounds it.
dvec3 greatest_gain(const Scene& scene) {
    const double tangent = greatest_tangent(scene);
    dvec3 greatest(1.0);
    for (const Material& material : scene.materials)
        if (gains(material)) greatest = glm::max(greatest, row_of(material.kind).greatest_weight(material, tangent));
    return greatest;
}

}  // namespace

std::array<double, channel_count> greatest_sample(const Scene& scene, const RenderSettings& settings) {
    const dvec3 sky = greatest_of_sky(scene.background);
    dvec3 radiance = sky;
    bool emits_and_goes_on = false;
    for (const Material& material : scene.materials) {
        radiance = glm::max(radiance, material.radiance);
        const bool ends_path = material.kind == MaterialKind::emissive && !material.translucent;
        if (brightness(material.radiance) > 0.0 && !ends_path) emits_and_goes_on = true;
    }
    const bool may_gain = settings.integrator != Integrator::whitted && std::ranges::any_of(scene.materials, gains);
    const double events = settings.bounces, meetings = emits_and_goes_on ? events + 1.0 : 1.0;
    dvec3 greatest = meetings * radiance;
    if (settings.integrator != Integrator::path) {
        const LightShares shares = light_shares(scene, brightness(sky) == 0.0);
        const dvec3 punctual = greatest_of_punctual(scene, shares, settings.light_sampling);
        for (glm::length_t c = 0; c < 3; ++c) {
            if (events == 0.0) continue;
            if (settings.integrator == Integrator::bidirectional)
                greatest[c] = punctual[c] > 0.0 ? infinite : (events + 1.0) * (events + 4.0) / 2.0 * radiance[c];
            else if ((settings.integrator == Integrator::whitted || !settings.mis) && shares.surfaces &&
                     radiance[c] > 0.0)
                greatest[c] = infinite;
            else
                greatest[c] += events * std::max(0.5 * radiance[c], punctual[c]);
            if (may_gain && events > 1.0 && punctual[c] > 0.0) greatest[c] = infinite;
        }
    }
    if (may_gain && events > 0.0) {
        const bool first_alone = events == 1.0 && settings.integrator != Integrator::bidirectional;
        const dvec3 gain = first_alone ? greatest_gain(scene) : dvec3(infinite);
        for (glm::length_t c = 0; c < 3; ++c)
            if (radiance[c] > 0.0) greatest[c] *= gain[c];
    }
    return {greatest.x, greatest.y, greatest.z};
}

}  // namespace tandem
