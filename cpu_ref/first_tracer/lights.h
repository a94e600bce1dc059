// Next-event estimation's choice of a light and of a point on it (MODEL.md section 9.2).
#pragma once

#include <vector>

#include "cpu_ref/first_tracer/materials.h"

namespace tandem::first {

// A direction to a light, and the density P_i p with which it was chosen, over solid angle.
struct LightSample {
    std::uint32_t primitive = no_index;
    dvec3 direction{0.0}, radiance{0.0};
    double distance = 0.0, density = 0.0;
};

// Rule 20, β = 2: how much one of two ways to find a light counts, by the densities of both. [Veach 1995]
inline double power_heuristic(double this_way, double other_way) {
    const double ratio = other_way / this_way;
    return 1.0 / (1.0 + ratio * ratio);
}

// The triangles and spheres that emit, by primitive id (rule 1).
class Lights {
public:
    Lights(const Scene& scene, const World& world) : scene_(scene), world_(world), lights_(world.shapes.size()) {
        for (std::size_t id = 0; id < lights_.size(); ++id) {
            const Shape& s = world.shapes[id];
            Light& light = lights_[id];
            light.centre = point_by(s.to_world, s.a);
            light.radius = s.radius * std::cbrt(std::abs(glm::determinant(dmat3(s.to_world))));
            light.area = s.kind == PrimitiveKind::triangle ? 0.5 * glm::length(glm::cross(s.b - s.a, s.c - s.a))
                                                           : 4.0 * pi * light.radius * light.radius;
            const dvec3 radiance = emitted(scene.materials[s.material], true);
            light.chance = light.area * (radiance.x + radiance.y + radiance.z);
            sum_ += light.chance;
        }
        for (Light& light : lights_) light.chance = sum_ > 0.0 ? light.chance / sum_ : 0.0;  // rule 6
    }

    // Rules 5 to 15: a light by v₀, a point on it by v₁ and v₂. It is for a receiver from which the ray `from` starts
    // in a direction not known yet. Nothing where there is no light, or where its dark side shows.
    [[nodiscard]] std::optional<LightSample> sample(const Ray& from, const Numbers& v) const {
        if (sum_ == 0.0) return {};
        std::uint32_t id = 0;
        double cumulative = 0.0;
        for (std::uint32_t i = 0; i < lights_.size(); ++i) {
            if (lights_[i].chance == 0.0) continue;
            id = i;
            cumulative += lights_[i].chance;
            if (v.first < cumulative) break;
        }
        if (id == from.left && !from.inwards) return {};  // flat or convex: it does not light its own outside
        const Shape& s = world_.shapes[id];
        if (is_sphere_from_outside(id, from)) return sample_cone(id, from, v);

        // Rules 8 and 9: uniform by area.
        const dvec3 weights = triangle(v.second, v.third), outward = sphere(v.second, v.third);
        const bool flat = s.kind == PrimitiveKind::triangle;
        const dvec3 y = flat ? weights.x * s.a + weights.y * s.b + weights.z * s.c
                             : lights_[id].centre + lights_[id].radius * outward;
        const double distance = glm::distance(y, from.origin);
        const dvec3 direction = (y - from.origin) / distance;
        const double cosine = -glm::dot(flat ? s.normal : outward, direction);
        if (flat ? cosine == 0.0 : !(cosine < 0.0)) return {};
        const double slack = s.error / std::abs(cosine);  // what lies in the light's own plane does not hide it
        const dvec3 radiance = emitted(scene_.materials[s.material], cosine > 0.0);
        return LightSample{id, direction, radiance, distance - slack, density_by_area(id, distance, cosine)};
    }

    // Rule 25: P_i p of the direction in which a ray met the hit; 0 where that is no light.
    [[nodiscard]] double density(const Ray& ray, const Hit& hit) const {
        const std::uint32_t id = hit.primitive;
        if (lights_[id].chance == 0.0) return 0.0;
        if (is_sphere_from_outside(id, ray)) return lights_[id].chance / (2.0 * pi * cone_height(id, ray));
        return density_by_area(id, hit.t, glm::dot(hit.normal, ray.direction));
    }

private:
    struct Light {
        dvec3 centre{0.0};                              // of a sphere, in the world, as its radius
        double radius = 0.0, area = 0.0, chance = 0.0;  // the chance is P_i, 0 of what does not emit
    };

    // On a sphere's own surface only the side that the ray leaves to tells.
    [[nodiscard]] bool is_sphere_from_outside(std::uint32_t id, const Ray& from) const {
        if (world_.shapes[id].kind != PrimitiveKind::sphere) return false;
        if (from.left == id) return !from.inwards;
        return glm::distance(lights_[id].centre, from.origin) > lights_[id].radius;
    }

    // A density by area becomes one over solid angle by r²/cos θ_y: so much larger does the area look from nearby.
    [[nodiscard]] double density_by_area(std::uint32_t id, double distance, double cosine) const {
        return lights_[id].chance * distance * distance / (lights_[id].area * std::abs(cosine));
    }

    // Rule 9: 1 - cos θ_m of the cone in which a sphere is seen.
    [[nodiscard]] double cone_height(std::uint32_t id, const Ray& from) const {
        const dvec3 way = lights_[id].centre - from.origin;
        const double sine_squared = lights_[id].radius * lights_[id].radius / glm::dot(way, way);
        return sine_squared / (1.0 + std::sqrt(std::max(0.0, 1.0 - sine_squared)));
    }

    // Rule 9, from outside: uniform in that cone.
    [[nodiscard]] LightSample sample_cone(std::uint32_t id, const Ray& from, const Numbers& v) const {
        const double k = cone_height(id, from), cosine = 1.0 - k * v.second;
        const double sine = std::sqrt(k * v.second * (2.0 - k * v.second)), azimuth = 2.0 * pi * v.third;
        const double radius = lights_[id].radius, delta = glm::distance(lights_[id].centre, from.origin);
        const dvec3 axis = (lights_[id].centre - from.origin) / delta;
        const dvec3 local(sine * std::cos(azimuth), sine * std::sin(azimuth), cosine);
        const double half_chord = std::sqrt(std::max(0.0, radius * radius - delta * delta * sine * sine));
        const double distance = (delta - radius) * (delta + radius) / (delta * cosine + half_chord);
        return {id, glm::normalize(in_frame_of(axis, local)),
            emitted(scene_.materials[world_.shapes[id].material], true), distance, lights_[id].chance / (2.0 * pi * k)};
    }

    const Scene& scene_;
    const World& world_;
    std::vector<Light> lights_;  // by primitive id
    double sum_ = 0.0;
};

}  // namespace tandem::first
