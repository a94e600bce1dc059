// Points and directions from random numbers (MODEL.md sections 3 and 3.1).
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "common/render/random.h"
#include "common/render/renderer.h"

namespace tandem::first {

using glm::dmat3;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using std::numbers::pi;

struct Numbers {
    double first, second, third, fourth;  // uniform in [0, 1)
};

// Section 3: four numbers for one purpose. Nothing is drawn in an order.
inline Numbers numbers(const RenderSettings& s, std::uint32_t pixel, std::uint64_t sample, std::uint32_t block) {
    const RandomBlock words = random_block(s.generator, s.seed, pixel, sample, block);
    return {to_unit<double>(words[0]), to_unit<double>(words[1]), to_unit<double>(words[2]), to_unit<double>(words[3])};
}

// Uniform on the unit disc: the area within the radius r grows as r², hence the root.
inline dvec2 disc(double a, double b) { return std::sqrt(a) * dvec2(std::cos(2.0 * pi * b), std::sin(2.0 * pi * b)); }

// Uniform on the unit sphere: zones of equal height have equal area, hence z is uniform. [Archimedes]
inline dvec3 sphere(double a, double b) {
    const double rho = 2.0 * std::sqrt(a * (1.0 - a));
    return {rho * std::cos(2.0 * pi * b), rho * std::sin(2.0 * pi * b), 1.0 - 2.0 * a};
}

// Uniform on a triangle, as barycentric weights of its corners. [Turk 1990]
inline dvec3 triangle(double a, double b) {
    const double s = std::sqrt(a);
    return {1.0 - s, s * (1.0 - b), s * b};
}

// The vector with coordinates `local` in the frame that has n for its z axis. [Duff 2017]
inline dvec3 in_frame_of(const dvec3& n, const dvec3& local) {
    const double sign = n.z >= 0.0 ? 1.0 : -1.0, a = -1.0 / (sign + n.z), b = n.x * n.y * a;
    const dvec3 tangent(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    const dvec3 bitangent(b, sign + n.y * n.y * a, -n.y);
    return local.x * tangent + local.y * bitangent + local.z * n;
}

// About n with the density cos θ/π: a uniform disc, lifted to the hemisphere above it.
inline dvec3 cosine_hemisphere(const dvec3& n, double a, double b) {
    return glm::normalize(in_frame_of(n, dvec3(disc(a, b), std::sqrt(1.0 - a))));
}

}  // namespace tandem::first
