// The oracle's geometry (MODEL.md sections 5 and 6): every ray is tested against every primitive, in double precision.
// It is written independently of both tracers, by other methods where there is a choice. So a fault cannot hide in all
// three.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "common/scene/scene.h"

namespace tandem::oracle {

inline constexpr std::uint32_t no_primitive = 0xFFFFFFFFu;

// p(t) = origin + t direction, `direction` of unit length.
struct Ray {
    glm::dvec3 origin{0.0};
    glm::dvec3 direction{0.0, 0.0, -1.0};
    std::uint32_t left_primitive = no_primitive;  // the primitive that the ray leaves
    bool leaves_to_front = true;                  // the side of it that the ray goes to
    double time = 0.0;                            // of the path (MODEL.md section 4)
};

struct Hit {
    double t = 0.0;
    std::uint32_t primitive = no_primitive;  // primitive id (MODEL.md section 5)
    std::uint32_t material = 0;
    glm::dvec3 position{0.0};                // a point of the primitive itself, not of the ray
    glm::dvec3 front_normal{0.0, 0.0, 1.0};  // unit
    glm::dvec3 object_point{0.0};            // the position in the object space of its entity
    glm::dvec2 coordinates{0.0};             // of textures (MODEL.md section 5.1)
    double rounding = 0.0;                   // by which the position may be off along the normal, as neighbours see it
    glm::dvec3 vertex_normal{0.0};           // interpolated, to the front, of any length; 0: none (section 5.4)
};

// Where a ray that leaves the hit starts: the position, moved to that side by its rounding (section 5.2).
[[nodiscard]] inline glm::dvec3 leaving_origin(const Hit& hit, bool to_front) {
    return hit.position + (to_front ? hit.rounding : -hit.rounding) * hit.front_normal;
}

// The placed primitives of a scene.
class World {
public:
    explicit World(const Scene& scene);

    // The first hit with t in [t_min, t_max]; of equal t the lower primitive id.
    [[nodiscard]] std::optional<Hit> closest_hit(const Ray& ray, double t_min, double t_max) const;

private:
    struct Placed {
        PrimitiveKind kind;
        std::uint32_t material;
        glm::dmat4 object_to_world, world_to_object;
        glm::dmat3 normal_to_world;  // inverse transpose, MODEL.md section 6
        glm::dvec3 a, b, c;          // triangle: world corners; cuboid: lo, hi; sphere: centre (object space)
        glm::dvec3 object_normal;    // triangle
        double radius;               // sphere
        glm::dvec3 motion;           // from shutter opening to closing, world space
        std::array<glm::dvec3, 3> object_corners;      // triangle
        std::array<glm::dvec2, 3> corner_coordinates;  // triangle
        std::array<glm::dvec3, 3> corner_normals;      // triangle
    };
    // What an intersection routine finds on a primitive, `position` and `normal` in world space.
    struct Candidate {
        double t;
        glm::dvec3 position, normal, object_point;
        glm::dvec2 coordinates;
        double rounding = 0.0;
        glm::dvec3 vertex_normal{0.0};
    };

    // The hit of a primitive that stands where it stands at shutter opening.
    static std::optional<Candidate> hit_at_rest(
        const Placed& primitive, const Ray& ray, bool leaving, double t_min, double t_max);
    static double rounding_of_plane(const Placed& triangle);
    static double rounding_of_faces(const Placed& cuboid, const glm::dvec3& normal);
    static std::optional<Candidate> triangle_hit(const Placed& triangle, const Ray& ray, double t_min, double t_max);
    static std::optional<Candidate> sphere_hit(
        const Placed& sphere, const Ray& ray, bool leaving, double t_min, double t_max);
    static std::optional<Candidate> cuboid_hit(
        const Placed& cuboid, const Ray& ray, bool leaving, double t_min, double t_max);

    std::vector<Placed> primitives_;
};

}  // namespace tandem::oracle
