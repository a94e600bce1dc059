#include "cpu_ref/oracle/surfaces.h"

#include <cmath>
#include <numbers>

#include "cpu_ref/oracle/conductor.h"
#include "cpu_ref/oracle/dielectric.h"
#include "cpu_ref/oracle/microfacets.h"
#include "cpu_ref/oracle/rough_diffuse.h"

namespace tandem::oracle {
namespace {

using glm::dvec3;

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

Incidence shaded_incidence(const Incidence& flat, const dvec3& vertex_normal) {
    const double agreement = glm::dot(vertex_normal, flat.near_normal);
    if (agreement == 0.0) return flat;
    const dvec3 normal = glm::normalize(std::copysign(1.0, agreement) * vertex_normal);
    const double cosine = glm::dot(-flat.direction, normal);
    if (cosine <= 0.0) return flat;
    return {flat.direction, flat.front, normal, cosine};
}

bool is_on_one_side(const Incidence& flat, const Incidence& shaded, const dvec3& direction) {
    return (glm::dot(direction, flat.near_normal) > 0.0) == (glm::dot(direction, shaded.near_normal) > 0.0);
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
