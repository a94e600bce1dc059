// The lights of MODEL.md section 9.6 as both ends of bidirectional path tracing need them. A light is chosen with a ray
// that leaves it, or for a receiver. Densities of points on lights are over area. Lights that are infinitely far send
// rays through a disc that covers the scene. Their densities are over solid angle.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "cpu_ref/bidirectional/rays.h"
#include "cpu_ref/bidirectional/sky.h"

namespace tandem::cpu {

enum class EmitterKind { triangle, sphere, cuboid, point, spot, sun, sky };

// What a light is, in the world.
struct Emitter {
    EmitterKind kind = EmitterKind::point;
    double chance = 0.0;                                   // P_i
    std::uint32_t primitive = no_primitive, material = 0;  // surfaces
    std::array<glm::dvec3, 3> corners{};                   // triangle; sphere: centre
    double radius = 0.0, area = 0.0;                       // sphere; surfaces
    glm::dmat4 to_world{1.0};                              // cuboid, with its corners in object space and the
    glm::dmat3 normal_to_world{1.0};                       // cumulative shares of its faces by area
    std::array<double, 6> cumulative{};
    double front_share = 1.0, back_share = 0.0;  // of the rays that leave it
    glm::dvec3 radiance{0.0};                    // surfaces
    bool both_sides = false;                     // surfaces: emits on its back too
    PunctualLight punctual{};
    [[nodiscard]] bool is_surface() const { return kind <= EmitterKind::cuboid; }
    // Can a ray meet it?
    [[nodiscard]] bool is_hit() const { return is_surface() || kind == EmitterKind::sky; }
    [[nodiscard]] bool is_far() const { return kind >= EmitterKind::sun; }
};

// A point of a light. For a far one, `place` is nowhere and `towards` the direction to it.
struct LightPoint {
    const Emitter* light = nullptr;
    Place place;
    glm::dvec3 towards{0.0};
};

class Emitters {
public:
    // `caster` and `sky` must outlive this. The camera stands at `eye`.
    Emitters(const Scene& scene, const RayCaster& caster, const Sky& sky, const glm::dvec3& eye);

    [[nodiscard]] bool empty() const { return emitters_.empty(); }
    [[nodiscard]] const Emitter* of_primitive(std::uint32_t primitive) const;  // null: not a sampled light
    [[nodiscard]] const Emitter* of_sky() const;

    // A point by (v0, v1, v2), for whoever receives it, or for a receiver.
    [[nodiscard]] LightPoint sample(const glm::dvec3& v) const;
    [[nodiscard]] LightPoint sample_for(const Place& from, const glm::dvec3& v) const;
    // Their densities, times P_i.
    [[nodiscard]] double density(const LightPoint& at) const;
    [[nodiscard]] double density_for(const Place& from, const LightPoint& at) const;

    // A ray that leaves a point, by (u1, u2, side).
    struct Emission {
        Place from;
        glm::dvec3 direction;
        double density;  // over solid angle; of far lights: over the area of the disc
    };
    [[nodiscard]] Emission emit(const LightPoint& at, const glm::dvec3& u) const;
    // The density of leaving in a direction; of far lights that of the disc.
    [[nodiscard]] double emission_density(const LightPoint& at, const glm::dvec3& direction) const;

    // Radiance (surfaces, sky), radiant intensity (points, spots) or irradiance (suns) that leaves in a direction.
    [[nodiscard]] glm::dvec3 emitted(const LightPoint& at, const glm::dvec3& direction) const;

private:
    void add_surfaces(const Scene& scene, const glm::dvec3& eye);
    void set_chances();
    [[nodiscard]] LightPoint point_on(const Emitter& light, double v1, double v2) const;
    [[nodiscard]] LightPoint point_on_cuboid(const Emitter& light, double v1, double v2) const;

    const RayCaster& caster_;
    const Sky& sky_;
    std::vector<Emitter> emitters_;
    std::vector<std::uint32_t> by_primitive_;  // index into emitters_, or no_index
};

}  // namespace tandem::cpu
