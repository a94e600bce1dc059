// How surfaces emit and scatter (MODEL.md section 7).
#pragma once

#include "cpu_ref/first_tracer/shapes.h"

namespace tandem::first {

// A ray of direction d at a surface. `normal` is n_f, on the side that the ray comes from, and `cosine` is c.
struct Incidence {
    const Material& material;
    dvec3 d, normal;
    double cosine;
    bool front;
};

inline Incidence incidence(const Material& material, const dvec3& d, const Hit& hit) {
    const bool front = glm::dot(d, hit.normal) < 0.0;
    const dvec3 normal = front ? hit.normal : -hit.normal;
    return {material, d, normal, -glm::dot(d, normal), front};
}

// Section 7: L_e towards the side that was hit, with the α of section 7.5.
inline dvec3 emitted(const Material& material, bool front) {
    if (material.sides == EmittingSides::front && !front) return dvec3(0.0);
    return material.translucent ? material.alpha * material.radiance : material.radiance;
}

// A direction, what A is multiplied by, and the density of the direction over solid angle. The weight is
// f cos θ/density. A mirror's direction is certain, and glass's one of two: they have no density, which 0 stands for.
struct Scattering {
    dvec3 direction, weight;
    double density = 0.0;
};

// Section 7.2. f = C/π and density = cos θ/π: of the weight only C is left.
inline Scattering scatter_diffuse(const Incidence& in, const Numbers& u) {
    const dvec3 direction = cosine_hemisphere(in.normal, u.first, u.second);
    return {direction, in.material.colour, glm::dot(direction, in.normal) / pi};
}

inline dvec3 mirrored(const Incidence& in) { return glm::normalize(in.d + 2.0 * in.cosine * in.normal); }

// Section 7.4: Snell's law says where the ray may go on, Fresnel's equations how much goes there, u₃ whether it does.
inline dvec3 reflected_or_refracted(const Incidence& in, double u3) {
    const double n = in.material.refractive_index, eta = in.front ? 1.0 / n : n, c = in.cosine;
    const double cosine_squared = (1.0 - eta) * (1.0 + eta) + eta * eta * c * c;
    if (cosine_squared < 0.0) return mirrored(in);  // total internal reflection
    const double ct = std::sqrt(cosine_squared);
    double reflectance = 0.0;
    if (in.material.fresnel == Fresnel::exact) {
        const double rs = (eta * c - ct) / (eta * c + ct), rp = (c - eta * ct) / (c + eta * ct);
        reflectance = 0.5 * (rs * rs + rp * rp);
    } else {
        const double r = (1.0 - eta) / (1.0 + eta), r0 = r * r;
        reflectance = r0 + (1.0 - r0) * std::pow(1.0 - (eta <= 1.0 ? c : ct), 5.0);
    }
    if (u3 < reflectance) return mirrored(in);
    return glm::normalize(eta * in.d + (eta * c - ct) * in.normal);
}

// Sections 7.3 and 7.4, with the absorption of 7.1. Nothing where fuzz sends the ray through the surface.
inline std::optional<Scattering> scatter_specular(const Incidence& in, const Numbers& u) {
    const Material& m = in.material;
    const dvec3 weight = m.translucent ? 1.0 - m.alpha * (1.0 - m.colour) : m.colour;
    const dvec3 w = m.translucent ? reflected_or_refracted(in, u.third) : mirrored(in);
    if (m.fuzz == 0.0) return Scattering{w, weight};
    const dvec3 blurred = w + m.fuzz * sphere(u.first, u.second);
    if (glm::dot(blurred, blurred) < 0x1p-40) return {};
    const dvec3 direction = glm::normalize(blurred);
    if (glm::dot(direction, in.normal) * glm::dot(w, in.normal) <= 0.0) return {};
    return Scattering{direction, weight};
}

}  // namespace tandem::first
