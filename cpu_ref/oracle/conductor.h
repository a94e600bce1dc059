// The oracle's conductors (MODEL.md section 7.6), in complex numbers.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>

#include "common/scene/scene.h"

namespace tandem::oracle {

// Reflectance for unpolarised light.
inline double conductor_reflectance(double eta, double k, double c) {
    const double sine_squared = std::max(0.0, 1.0 - c * c);
    const std::complex<double> index(eta, k), beyond = (index - 1.0) * (index + 1.0);  // N^2 - 1
    const std::complex<double> inner = std::sqrt(beyond + c * c), sum = c + inner;     // N times the inner cosine
    if (std::norm(sum) == 0.0) return 0.0;                                             // N = 1, along the surface
    const double rs = std::min(1.0, std::norm(beyond / sum / sum));
    const double ratio = std::norm((c * inner - sine_squared) / (c * inner + sine_squared));
    return 0.5 * rs * (1.0 + ratio);
}

inline glm::dvec3 conductor_reflectance(const Material& material, double c) {
    glm::dvec3 result;
    for (int i = 0; i < 3; ++i) result[i] = conductor_reflectance(material.eta[i], material.k[i], c);
    return result;
}

}  // namespace tandem::oracle
