// The oracle's rough diffuse surfaces (MODEL.md section 7.9), by the angles themselves.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "cpu_ref/oracle/sampling.h"

namespace tandem::oracle {

// The share that f has of a diffuse surface's, for light between two directions away from the surface.
inline double oren_nayar_share(
    double sigma, const glm::dvec3& normal, const glm::dvec3& towards_eye, const glm::dvec3& towards_light) {
    const Frame frame(normal);
    const glm::dvec3 i = frame.to_local(towards_eye), o = frame.to_local(towards_light);
    const auto angle = [](const glm::dvec3& w) { return std::atan2(std::hypot(w.x, w.y), w.z); };
    const double azimuth = std::atan2(i.y, i.x) - std::atan2(o.y, o.x);
    const auto [beta, alpha] = std::minmax({angle(i), angle(o)});
    const double variance = sigma * sigma;
    return 1.0 - 0.5 * variance / (variance + 0.33) +
           0.45 * variance / (variance + 0.09) * std::max(0.0, std::cos(azimuth)) * std::sin(alpha) * std::tan(beta);
}

}  // namespace tandem::oracle
