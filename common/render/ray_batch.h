// Given rays and their hits: the interface for tests of intersection, which need no image.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "common/scene/scene.h"

namespace tandem {

// p(t) = origin + t d, t in [t_min, t_max]. d is `direction`, rounded to the renderer's arithmetic. If its length is
// not 1 to within 10^-6, d is the unit vector along it. A ray without one, or with a NaN or infinite component, misses.
struct GivenRay {
    glm::dvec3 origin{0.0};
    glm::dvec3 direction{0.0, 0.0, -1.0};
    double t_min = 0.0;
    double t_max = std::numeric_limits<double>::infinity();
    std::uint32_t left_primitive = no_index;  // primitive id that the ray leaves (MODEL.md section 5.2), or no_index
    bool inside = false;                      // it leaves it towards its back: the inside of a sphere or cuboid
};

struct RayHit {
    double t = 0.0;
    std::uint32_t primitive = no_index;                // primitive id; no_index: a miss, and all else is 0
    glm::dvec3 point{0.0};                             // as the renderer computes it
    glm::dvec3 normal{0.0};                            // unit, to the front
    glm::dvec3 leaving_front{0.0}, leaving_back{0.0};  // origins of rays that leave to either side
};

struct RayHits {
    std::vector<RayHit> hits;              // as many as rays
    double seconds = 0.0;                  // wall clock of intersecting, transfers not counted
    std::optional<double> device_seconds;  // the device's own clock, where there is one
};

// A scene made ready for rays, by the very code that finds hits on the paths of an image.
class RayIntersector {
public:
    virtual ~RayIntersector() = default;
    [[nodiscard]] virtual RayHits intersect(std::span<const GivenRay> rays) = 0;
};

}  // namespace tandem
