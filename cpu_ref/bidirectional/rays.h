// Single rays through the path tracer's accelerator, in double, for bidirectional path tracing.
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "cpu_ref/path_tracer/geometry/accelerator.h"
#include "cpu_ref/path_tracer/geometry/surface.h"

namespace tandem::cpu {

// A point of a surface, or in free space (no primitive, error 0).
struct Place {
    glm::dvec3 point{0.0}, normal{0.0};  // normal: to the front, unit
    double error = 0.0;                  // bound on that of the point, along the normal
    std::uint32_t primitive = no_primitive, material = 0;
    std::uint32_t face = 0;  // within the primitive
};

class RayCaster {
public:
    RayCaster(RTCDevice device, const Scene& scene, const RenderSettings& settings);

    // At a time of the shutter (section 4).
    [[nodiscard]] std::optional<Place> closest(const Place& from, const glm::dvec3& direction, double time) const;
    [[nodiscard]] bool sees(const Place& from, const Place& to, double time) const;
    [[nodiscard]] bool sees_far(const Place& from, const glm::dvec3& direction, double time) const;

    // The colour of a texture there.
    [[nodiscard]] glm::dvec3 texture_colour(const Place& place, double time) const;

    // A point of the scene's primitive, as closest() would give it.
    [[nodiscard]] Place on_primitive(
        std::uint32_t primitive, std::uint32_t material, const glm::dvec3& point, const glm::dvec3& normal) const;

    // A ball around all primitives, at any time.
    [[nodiscard]] glm::dvec3 centre() const { return centre_; }
    [[nodiscard]] double radius() const { return radius_; }

private:
    [[nodiscard]] glm::dvec3 shift_of(std::uint32_t primitive, double time) const;
    [[nodiscard]] bool free(const Place& from, const glm::dvec3& direction, double distance, double time) const;

    Tables<double> tables_;
    Accelerator<double> accelerator_;
    glm::dvec3 centre_{0.0};
    double radius_ = 0.0;
};

}  // namespace tandem::cpu
