// How far a point lies from a primitive of a scene, in double: the measure of an intersection's error.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "common/scene/scene.h"

namespace tandem::stability {

struct SurfaceOffset {
    double along_normal = 0.0, sideways = 0.0;  // world units, both >= 0
    glm::dvec3 normal{0.0};                     // of the nearest point
};

class Surfaces {
public:
    explicit Surfaces(const Scene& scene);

    // From the point of primitive `id` that is nearest to `point` (of affine images of spheres and cuboids: to first
    // order in the distance).
    [[nodiscard]] SurfaceOffset offset(std::uint32_t id, const glm::dvec3& point) const;

    // The largest magnitude of a coordinate of primitive `id`, and of any.
    [[nodiscard]] double reach(std::uint32_t id) const { return placed_[id].reach; }
    [[nodiscard]] double reach() const { return reach_; }
    [[nodiscard]] std::size_t size() const { return placed_.size(); }
    [[nodiscard]] bool is_triangle(std::uint32_t id) const { return placed_[id].kind == PrimitiveKind::triangle; }
    [[nodiscard]] const std::array<glm::dvec3, 3>& corners(std::uint32_t id) const { return placed_[id].corners; }

private:
    struct Placed {
        PrimitiveKind kind;
        std::array<glm::dvec3, 3> corners;  // of a triangle, in the world
        glm::dmat4 to_world, to_unit;       // unit sphere or [-1, 1]^3
        glm::dvec3 half;                    // of a cuboid in unit space: 1, or 0 where it is flat
        double reach;
    };
    std::vector<Placed> placed_;
    double reach_ = 0.0;
};

}  // namespace tandem::stability
