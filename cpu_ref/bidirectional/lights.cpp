#include "cpu_ref/bidirectional/lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cpu_ref/bidirectional/surfaces.h"

namespace tandem::cpu {
namespace {

using glm::dvec3;

dvec3 point_by(const glm::dmat4& m, const dvec3& p) { return dvec3(m * glm::dvec4(p, 1.0)); }

double outer_cosine(const PunctualLight& light) { return std::cos(glm::radians(light.outer_degrees)); }

double falloff(const PunctualLight& light, const dvec3& direction) {
    const double inner = std::cos(glm::radians(light.inner_degrees)), outer = outer_cosine(light);
    const double t = std::clamp((glm::dot(direction, light.direction) - outer) / (inner - outer), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// By how much a similarity scales all directions.
double scale_of(const glm::dmat4& m) {
    const glm::dmat3 linear(m), square = glm::transpose(linear) * linear;
    return std::sqrt((square[0][0] + square[1][1] + square[2][2]) / 3.0);
}

// The surface of a primitive, or nothing where section 9.6 does not sample it.
std::optional<Emitter> surface_of(const Scene& scene, const Entity& entity, const Primitive& primitive) {
    const glm::dmat4& m = entity.object_to_world;
    Emitter light;
    light.to_world = m;
    light.normal_to_world = glm::transpose(glm::inverse(glm::dmat3(m)));
    const auto vertex = [&](std::size_t i) { return scene.vertices[primitive.index[i]]; };
    switch (primitive.kind) {
        case PrimitiveKind::triangle: {
            light.kind = EmitterKind::triangle;
            for (std::size_t i = 0; i < 3; ++i) light.corners[i] = point_by(m, vertex(i));
            light.area =
                0.5 * glm::length(glm::cross(light.corners[1] - light.corners[0], light.corners[2] - light.corners[0]));
            if (!(light.area > 0.0)) return std::nullopt;
            return light;
        }
        case PrimitiveKind::sphere: {
            if (!is_similarity(m) || !(primitive.radius > 0.0)) return std::nullopt;
            light.kind = EmitterKind::sphere;
            light.corners[0] = point_by(m, vertex(0));
            light.radius = scale_of(m) * primitive.radius;
            light.area = 4.0 * std::numbers::pi * light.radius * light.radius;
            return light;
        }
        case PrimitiveKind::cuboid: {
            light.kind = EmitterKind::cuboid;
            light.corners[0] = vertex(0);
            light.corners[1] = vertex(1);
            const dvec3 size = vertex(1) - vertex(0);
            for (std::size_t face = 0; face < 6; ++face) {
                const int axis = static_cast<int>(face / 2), a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
                light.area += glm::length(glm::cross(size[a] * dvec3(m[a]), size[b] * dvec3(m[b])));
                light.cumulative[face] = light.area;
            }
            for (double& bound : light.cumulative) bound /= light.area;
            return light;
        }
    }
    return std::nullopt;
}

bool contains(const Emitter& light, const dvec3& point) {
    if (light.kind == EmitterKind::sphere) return glm::distance(point, light.corners[0]) < light.radius;
    const dvec3 local = point_by(glm::inverse(light.to_world), point);
    return glm::all(glm::greaterThan(local, light.corners[0])) && glm::all(glm::lessThan(local, light.corners[1]));
}

// Rays leave a body that emits on both sides to the side that the camera is on: the other is never seen.
void share_sides(Emitter& light, EmittingSides sides, const dvec3& eye) {
    light.both_sides = sides == EmittingSides::both;
    if (!light.both_sides) return;
    if (light.kind == EmitterKind::triangle)
        light.front_share = light.back_share = 0.5;
    else if (contains(light, eye))
        std::swap(light.front_share, light.back_share);
}

// A sphere as a receiver outside of it sees it. Other lights, and a sphere from inside, have none: they are sampled as
// if for nobody. On the sphere itself only what lies within can be lit by it.
struct Cone {
    dvec3 axis;
    double distance, height;  // of the centre; 1 - cos of the half angle
};

std::optional<Cone> cone_of(const Emitter& light, const Place& from) {
    if (light.kind != EmitterKind::sphere || from.primitive == light.primitive) return std::nullopt;
    const dvec3 offset = light.corners[0] - from.point;
    const double square = glm::dot(offset, offset), s2 = light.radius * light.radius / square;
    if (!(s2 < 1.0)) return std::nullopt;
    return Cone{offset / std::sqrt(square), std::sqrt(square), s2 / (1.0 + std::sqrt(1.0 - s2))};
}

}  // namespace

Emitters::Emitters(const Scene& scene, const RayCaster& caster, const Sky& sky, const dvec3& eye)
    : caster_(caster), sky_(sky) {
    add_surfaces(scene, eye);
    for (const bool far : {false, true}) {
        for (const PunctualLight& punctual : scene.lights) {
            if ((punctual.kind == PunctualKind::sun) != far || punctual.intensity == dvec3(0.0)) continue;
            Emitter light;
            light.kind = far                                   ? EmitterKind::sun
                         : punctual.kind == PunctualKind::spot ? EmitterKind::spot
                                                               : EmitterKind::point;
            light.punctual = punctual;
            emitters_.push_back(light);
        }
    }
    if (sky.is_light()) emitters_.emplace_back().kind = EmitterKind::sky;
    set_chances();
}

void Emitters::add_surfaces(const Scene& scene, const dvec3& eye) {
    const PlacedPrimitives places = placed_primitives(scene);
    by_primitive_.assign(places.size(), no_index);
    for (std::uint32_t id = 0; id < places.size(); ++id) {
        const Entity& entity = scene.entities[places[id].entity];
        const Material& material = scene.materials[entity.material];
        if (material.translucent || material.radiance == dvec3(0.0) || entity.motion != dvec3(0.0)) continue;
        std::optional<Emitter> light = surface_of(scene, entity, scene.primitives[places[id].primitive]);
        if (!light) continue;
        light->primitive = id;
        light->material = entity.material;
        light->radiance = material.radiance;
        share_sides(*light, material.sides, eye);
        by_primitive_[id] = static_cast<std::uint32_t>(emitters_.size());
        emitters_.push_back(*light);
    }
}

void Emitters::set_chances() {
    double near = 0.0, far = 0.0;
    for (Emitter& light : emitters_) {
        const double intensity = luminance(light.punctual.intensity);
        if (light.is_surface()) light.chance = light.area * luminance(light.radiance);
        if (light.kind == EmitterKind::point) light.chance = 4.0 * intensity;
        if (light.kind == EmitterKind::spot) light.chance = 2.0 * (1.0 - outer_cosine(light.punctual)) * intensity;
        if (light.is_far()) light.chance = 1.0;
        (light.is_far() ? far : near) += light.chance;
    }
    const double share = near > 0.0 && far > 0.0 ? 0.5 : 1.0;
    for (Emitter& light : emitters_) light.chance *= share / (light.is_far() ? far : near);
}

const Emitter* Emitters::of_primitive(std::uint32_t primitive) const {
    const std::uint32_t index = by_primitive_[primitive];
    return index == no_index ? nullptr : &emitters_[index];
}

const Emitter* Emitters::of_sky() const { return sky_.is_light() ? &emitters_.back() : nullptr; }

LightPoint Emitters::sample(const dvec3& v) const {
    double cumulative = 0.0;
    for (const Emitter& light : emitters_) {
        cumulative += light.chance;
        if (v.x < cumulative) return point_on(light, v.y, v.z);
    }
    return point_on(emitters_.back(), v.y, v.z);
}

LightPoint Emitters::point_on(const Emitter& light, double v1, double v2) const {
    LightPoint at{&light, {}, {}};
    const auto on_surface = [&](const dvec3& point, const dvec3& normal) {
        at.place = caster_.on_primitive(light.primitive, light.material, point, normal);
    };
    switch (light.kind) {
        case EmitterKind::triangle: {
            const auto& [a, b, c] = light.corners;
            const double s = std::sqrt(v1);
            const dvec3 point = (1.0 - s) * a + s * (1.0 - v2) * b + s * v2 * c;
            const dvec3 normal = glm::normalize(glm::cross(b - a, c - a));
            // The front is that of object space, also where the map mirrors.
            on_surface(point, glm::determinant(glm::dmat3(light.to_world)) < 0.0 ? -normal : normal);
            break;
        }
        case EmitterKind::sphere: {
            const dvec3 normal = sphere_direction(v1, v2);
            on_surface(light.corners[0] + light.radius * normal, normal);
            break;
        }
        case EmitterKind::cuboid:
            return point_on_cuboid(light, v1, v2);
        case EmitterKind::point:
        case EmitterKind::spot:
            at.place.point = light.punctual.position;
            break;
        case EmitterKind::sun:
            at.towards = -light.punctual.direction;
            break;
        case EmitterKind::sky:
            at.towards = sky_.sample(v1, v2);
            break;
    }
    return at;
}

LightPoint Emitters::point_on_cuboid(const Emitter& light, double v1, double v2) const {
    std::size_t face = 0;
    while (face < 5 && v1 >= light.cumulative[face]) ++face;
    const double low = face == 0 ? 0.0 : light.cumulative[face - 1];
    const int axis = static_cast<int>(face / 2), a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    dvec3 share(0.0), normal(0.0);
    share[axis] = face % 2 == 0 ? 0.0 : 1.0;
    normal[axis] = face % 2 == 0 ? -1.0 : 1.0;
    share[a] = (v1 - low) / (light.cumulative[face] - low);
    share[b] = v2;
    const dvec3 point = point_by(light.to_world, glm::mix(light.corners[0], light.corners[1], share));
    return {&light,
        caster_.on_primitive(light.primitive, light.material, point, glm::normalize(light.normal_to_world * normal)),
        {}};
}

LightPoint Emitters::sample_for(const Place& from, const dvec3& v) const {
    LightPoint at = sample(v);
    const Emitter& light = *at.light;
    const std::optional<Cone> cone = cone_of(light, from);
    if (!cone) return at;
    const double cosine = 1.0 - cone->height * v.y, sine_squared = cone->height * v.y * (2.0 - cone->height * v.y);
    const dvec3 direction = in_frame_of(cone->axis, dvec3(std::sqrt(sine_squared) * disc_point(1.0, v.z), cosine));
    const double miss = cone->distance * cone->distance * sine_squared;  // of the centre, squared
    const double half_chord = std::sqrt(std::max(0.0, light.radius * light.radius - miss));
    const dvec3 point = from.point + (cone->distance * cosine - half_chord) * direction;
    const dvec3 normal = glm::normalize(point - light.corners[0]);
    at.place = caster_.on_primitive(light.primitive, light.material, light.corners[0] + light.radius * normal, normal);
    return at;
}

double Emitters::density(const LightPoint& at) const {
    if (at.light->kind == EmitterKind::sky) return at.light->chance * sky_.density(at.towards);
    return at.light->is_surface() ? at.light->chance / at.light->area : at.light->chance;
}

double Emitters::density_for(const Place& from, const LightPoint& at) const {
    const std::optional<Cone> cone = cone_of(*at.light, from);
    if (!cone) return density(at);
    const dvec3 way = at.place.point - from.point;
    const double square = glm::dot(way, way), cosine = std::abs(glm::dot(way, at.place.normal)) / std::sqrt(square);
    return at.light->chance / (2.0 * std::numbers::pi * cone->height) * cosine / square;
}

Emitters::Emission Emitters::emit(const LightPoint& at, const dvec3& u) const {
    const Emitter& light = *at.light;
    Emission ray{at.place, {}, 0.0};
    switch (light.kind) {
        case EmitterKind::point:
            ray.direction = sphere_direction(u.x, u.y);
            break;
        case EmitterKind::spot: {
            const double cosine = 1.0 - u.x * (1.0 - outer_cosine(light.punctual));
            const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
            ray.direction = in_frame_of(light.punctual.direction, dvec3(sine * disc_point(1.0, u.y), cosine));
            break;
        }
        case EmitterKind::sun:
        case EmitterKind::sky: {
            ray.direction = -at.towards;
            const glm::dvec2 disc = caster_.radius() * disc_point(u.x, u.y);
            const dvec3 across = in_frame_of(ray.direction, {1.0, 0.0, 0.0});
            const dvec3 start = caster_.centre() + 2.0 * caster_.radius() * at.towards;
            ray.from.point = start + disc.x * across + disc.y * glm::cross(ray.direction, across);
            break;
        }
        default:
            ray.direction = cosine_direction(u.z < light.front_share ? at.place.normal : -at.place.normal, u.x, u.y);
    }
    ray.density = emission_density(at, ray.direction);
    return ray;
}

double Emitters::emission_density(const LightPoint& at, const dvec3& direction) const {
    const Emitter& light = *at.light;
    switch (light.kind) {
        case EmitterKind::point:
            return 1.0 / (4.0 * std::numbers::pi);
        case EmitterKind::spot: {
            const double outer = outer_cosine(light.punctual);
            return glm::dot(direction, light.punctual.direction) >= outer
                       ? 1.0 / (2.0 * std::numbers::pi * (1.0 - outer))
                       : 0.0;
        }
        case EmitterKind::sun:
        case EmitterKind::sky:
            return 1.0 / (std::numbers::pi * caster_.radius() * caster_.radius());
        default: {
            const double cosine = glm::dot(direction, at.place.normal);
            return std::abs(cosine) / std::numbers::pi * (cosine > 0.0 ? light.front_share : light.back_share);
        }
    }
}

dvec3 Emitters::emitted(const LightPoint& at, const dvec3& direction) const {
    const Emitter& light = *at.light;
    if (light.kind == EmitterKind::sky) return sky_.radiance(-direction);
    if (light.kind == EmitterKind::spot) return falloff(light.punctual, direction) * light.punctual.intensity;
    if (!light.is_surface()) return light.punctual.intensity;
    return light.both_sides || glm::dot(direction, at.place.normal) > 0.0 ? light.radiance : dvec3(0.0);
}

}  // namespace tandem::cpu
