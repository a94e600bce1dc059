// Arguments of exercises from uniform numbers.
#pragma once

#include <cmath>

#include "common/exercise/exercise.h"
#include "cpu_ref/oracle/sampling.h"

namespace tandem {

using V = Values;  // rows are short

inline double between(double u, double low, double high) { return low + u * (high - low); }
inline double between_logarithms(double u, double low, double high) { return low * std::pow(high / low, u); }
inline glm::dvec3 any_direction(const V& u, std::size_t i) { return oracle::unit_sphere(u[i], u[i + 1]); }
inline glm::dvec3 any_point(const V& u, std::size_t i, double size) { return size * (2.0 * u.three(i) - 1.0); }
// On the hemisphere about +z, not too near to the horizon.
inline glm::dvec3 upper_direction(const V& u, std::size_t i) {
    const double z = between(u[i], 0.02, 1.0), r = std::sqrt(1.0 - z * z), angle = oracle::two_pi * u[i + 1];
    return {r * std::cos(angle), r * std::sin(angle), z};
}
// Arguments that are uniform numbers themselves, from the given place on.
inline void numbers_at(const V& u, V& x, std::size_t from, std::size_t count, std::size_t to) {
    for (std::size_t k = 0; k < count; ++k) x[to + k] = u[from + k];
}
// The place of a direction: height and azimuth, which are uniform on the sphere.
inline glm::dvec2 by_height_and_azimuth(const glm::dvec3& d) {
    return {0.5 * d.z + 0.5, std::atan2(d.y, d.x) / oracle::two_pi + 0.5};
}
// In tolerances of a single-precision unit vector.
inline double off_unit_length(const glm::dvec3& d) { return std::abs(glm::length(d) - 1.0) / 0x1p-14; }

}  // namespace tandem
