#include "cpu_ref/oracle/surfaces.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "cpu_ref/oracle/rough_diffuse.h"

namespace tandem::oracle {
namespace {

using glm::dvec3;

// Section 7.4: the reflectance, and the refracted direction unless all is reflected. `cosine` is that of the direction
// and the normal that it is refracted at, the surface's own or a facet's.
struct Interface {
    double reflectance;
    dvec3 refracted;
};

Interface interface_of(Fresnel fresnel, double eta, const dvec3& direction, const dvec3& normal, double cosine) {
    const double c = cosine, cosine_squared = (1.0 - eta) * (1.0 + eta) + eta * eta * c * c;
    if (cosine_squared < 0.0) return {1.0, dvec3(0.0)};  // total internal reflection: u3 < 1 always
    const double ct = std::sqrt(cosine_squared);
    const dvec3 refracted = eta * direction + (eta * c - ct) * normal;
    if (fresnel == Fresnel::schlick) {
        const double root = (1.0 - eta) / (1.0 + eta), r0 = root * root;
        return {r0 + (1.0 - r0) * std::pow(1.0 - (eta <= 1.0 ? c : ct), 5.0), refracted};
    }
    const double senkrecht = (eta * c - ct) / (eta * c + ct), parallel = (c - eta * ct) / (c + eta * ct);
    return {0.5 * (senkrecht * senkrecht + parallel * parallel), refracted};
}

// The mirrored or refracted direction at a normal (7.3, 7.4), by u3.
dvec3 reflected_or_refracted(const Surface& surface, const dvec3& normal, double cosine, double choice) {
    const Material& material = surface.material;
    const dvec3& d = surface.in.direction;
    if (material.translucent) {
        const Interface at = interface_of(material.fresnel, surface.relative_index, d, normal, cosine);
        if (!(choice < at.reflectance)) return glm::normalize(at.refracted);
    }
    return glm::normalize(d + 2.0 * cosine * normal);
}

// Section 7.1.
dvec3 absorption(const Surface& surface) {
    const Material& material = surface.material;
    return material.translucent ? 1.0 - material.alpha * (1.0 - surface.colour) : surface.colour;
}

// Section 7.6: reflectance of a conductor for unpolarised light.
double conductor_reflectance(double eta, double k, double c) {
    const double sine_squared = std::max(0.0, 1.0 - c * c);
    const std::complex<double> index(eta, k), beyond = (index - 1.0) * (index + 1.0);  // N^2 - 1
    const std::complex<double> inner = std::sqrt(beyond + c * c), sum = c + inner;     // N times the inner cosine
    if (std::norm(sum) == 0.0) return 0.0;                                             // N = 1, along the surface
    const double rs = std::min(1.0, std::norm(beyond / sum / sum));
    const double ratio = std::norm((c * inner - sine_squared) / (c * inner + sine_squared));
    return 0.5 * rs * (1.0 + ratio);
}

dvec3 conductor_reflectance(const Material& material, double c) {
    dvec3 result;
    for (int i = 0; i < 3; ++i) result[i] = conductor_reflectance(material.eta[i], material.k[i], c);
    return result;
}

// The microfacet distribution of section 7.6, in the frame of n_f.
struct Microfacets {
    double alpha;

    [[nodiscard]] double density(const dvec3& h) const {
        const double a2 = alpha * alpha, root = 1.0 + h.z * h.z * (a2 - 1.0);
        return a2 / (std::numbers::pi * root * root);
    }
    [[nodiscard]] double lambda(const dvec3& w) const {
        return 0.5 * (std::sqrt(1.0 + alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z)) - 1.0);
    }
    [[nodiscard]] double masking(const dvec3& i) const { return 1.0 / (1.0 + lambda(i)); }
    [[nodiscard]] double masking_shadowing(const dvec3& i, const dvec3& o) const {
        return 1.0 / (1.0 + lambda(i) + lambda(o));
    }
    // [Dupuy 2023]
    [[nodiscard]] dvec3 visible_normal(const dvec3& i, const Numbers& u) const {
        const dvec3 v = glm::normalize(dvec3(alpha * i.x, alpha * i.y, i.z));
        const double z = (1.0 - u.second) * (1.0 + v.z) - v.z, sigma = std::sqrt(std::max(0.0, 1.0 - z * z));
        const dvec3 s = dvec3(sigma * std::cos(two_pi * u.first), sigma * std::sin(two_pi * u.first), z) + v;
        return glm::normalize(dvec3(alpha * s.x, alpha * s.y, s.z));
    }
};

Microfacets microfacets_of(const Material& material) { return {material.roughness * material.roughness}; }

// Sections 7.6 and 7.7: conductors reflect, translucent facets reflect or refract.
std::optional<Scattering> scatter_roughly(const Surface& surface, const Numbers& u) {
    const Microfacets facets = microfacets_of(surface.material);
    const Frame frame(surface.in.near_normal);
    const dvec3 i = frame.to_local(-surface.in.direction);
    const dvec3 h = facets.visible_normal(i, u);
    const double cosine = glm::dot(i, h);
    const dvec3 normal = frame.to_world(h);
    const bool conductor = surface.material.kind == MaterialKind::conductor;
    const dvec3 direction = reflected_or_refracted(surface, normal, cosine, u.third);
    const bool reflected = conductor || glm::dot(direction, normal) > 0.0;
    const dvec3 o = frame.to_local(direction);
    if (reflected ? !(o.z > 0.0) : !(o.z < 0.0)) return std::nullopt;
    const double seen = facets.masking_shadowing(i, o) / facets.masking(i);
    if (!conductor) return Scattering{direction, seen * absorption(surface)};
    return Scattering{direction, seen * conductor_reflectance(surface.material, cosine),
        facets.masking(i) * facets.density(h) / (4.0 * i.z)};
}

Scattering diffusely(const Surface& surface, const Numbers& u) {
    const dvec3 direction = cosine_hemisphere(surface.in.near_normal, u.first, u.second);
    return {direction, surface.colour, glm::dot(direction, surface.in.near_normal) / std::numbers::pi};
}

// Section 7.9.
double share_of_diffuse(const Surface& surface, const dvec3& towards) {
    if (surface.material.kind != MaterialKind::rough_diffuse) return 1.0;
    const Incidence& in = surface.in;
    return oren_nayar_share(surface.material.roughness, in.near_normal, -in.direction, towards);
}

Scattering rough_diffusely(const Surface& surface, const Numbers& u) {
    Scattering scattering = diffusely(surface, u);
    scattering.weight *= share_of_diffuse(surface, scattering.direction);
    return scattering;
}

// Sections 7.3 and 7.4.
std::optional<dvec3> specular_direction(const Surface& surface, const Numbers& u) {
    const Material& material = surface.material;
    const Incidence& in = surface.in;
    const dvec3 base = reflected_or_refracted(surface, in.near_normal, in.cosine, u.third);
    if (material.fuzz == 0.0) return base;
    const dvec3 blurred = base + material.fuzz * unit_sphere(u.first, u.second);
    if (glm::dot(blurred, blurred) < 0x1p-40) return std::nullopt;
    const dvec3 direction = glm::normalize(blurred);
    if (glm::dot(direction, in.near_normal) * glm::dot(base, in.near_normal) <= 0.0) return std::nullopt;
    return direction;
}

}  // namespace

Incidence incidence_of(const dvec3& direction, const dvec3& front_normal) {
    const double along = glm::dot(direction, front_normal);
    const bool front = along < 0.0;
    return {direction, front, front ? front_normal : -front_normal, std::abs(along)};
}

dvec3 emitted(const Material& material, bool front) {
    if (material.sides == EmittingSides::front && !front) return dvec3(0.0);
    return material.translucent ? material.alpha * material.radiance : material.radiance;
}

bool ends_path(const Material& material) { return material.kind == MaterialKind::emissive && !material.translucent; }

std::optional<Scattering> scatter(const Surface& surface, const Numbers& u) {
    const Material& material = surface.material;
    const Incidence& in = surface.in;
    switch (material.kind) {
        case MaterialKind::diffuse:
            return diffusely(surface, u);
        case MaterialKind::rough_diffuse:
            return rough_diffusely(surface, u);
        case MaterialKind::boundary:
            return Scattering{in.direction, dvec3(1.0)};
        case MaterialKind::conductor:
            if (material.roughness > 0.0) return scatter_roughly(surface, u);
            return Scattering{glm::normalize(in.direction + 2.0 * in.cosine * in.near_normal),
                conductor_reflectance(material, in.cosine)};
        case MaterialKind::specular:
        case MaterialKind::emissive:
            break;
    }
    if (material.translucent && material.roughness > 0.0) return scatter_roughly(surface, u);
    const std::optional<dvec3> direction = specular_direction(surface, u);
    if (!direction) return std::nullopt;
    return Scattering{*direction, absorption(surface)};
}

bool has_known_scattering(const Material& material) {
    return material.kind == MaterialKind::diffuse || material.kind == MaterialKind::rough_diffuse ||
           (material.kind == MaterialKind::conductor && material.roughness > 0.0);
}

dvec3 scattered_share(const Surface& surface, const dvec3& towards) {
    const double cosine = glm::dot(towards, surface.in.near_normal);
    if (!(cosine > 0.0)) return dvec3(0.0);
    if (surface.material.kind != MaterialKind::conductor)
        return share_of_diffuse(surface, towards) * surface.colour * (cosine / std::numbers::pi);
    const Frame frame(surface.in.near_normal);
    const dvec3 i = frame.to_local(-surface.in.direction), o = frame.to_local(towards), h = glm::normalize(i + o);
    if (!(i.z > 0.0)) return dvec3(0.0);
    const Microfacets facets = microfacets_of(surface.material);
    return conductor_reflectance(surface.material, glm::dot(i, h)) * facets.density(h) *
           facets.masking_shadowing(i, o) / (4.0 * i.z);
}

}  // namespace tandem::oracle
