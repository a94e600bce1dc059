#include "cpu_ref/bidirectional/surfaces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::cpu {
namespace {

using glm::dvec3;

constexpr double pi = std::numbers::pi, two_pi = 2.0 * std::numbers::pi;

struct Axes {
    dvec3 tangent, bitangent;
};

Axes axes_of(const dvec3& n) {
    const double sign = n.z < 0.0 ? -1.0 : 1.0, a = -1.0 / (sign + n.z), b = n.x * n.y * a;
    return {{1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}};
}

dvec3 to_frame_of(const dvec3& n, const dvec3& v) {
    const Axes axes = axes_of(n);
    return {glm::dot(v, axes.tangent), glm::dot(v, axes.bitangent), glm::dot(v, n)};
}

dvec3 mirrored(const dvec3& v, const dvec3& about) { return 2.0 * glm::dot(v, about) * about - v; }

// Section 7.6: F of one channel.
double fresnel_conductor(double c, double eta, double k) {
    const double s2 = std::max(0.0, 1.0 - c * c), t = (eta - 1.0) * (eta + 1.0) + c * c - k * k;
    const double great = std::sqrt(0.5 * (std::abs(t) + std::hypot(t, 2.0 * eta * k)));
    if (great + c == 0.0) return 0.0;  // no surface, seen along it
    const double small = great > 0.0 ? eta * k / great : 0.0, a = t < 0.0 ? small : great, b = t < 0.0 ? great : small;
    const double outer = std::hypot(eta - 1.0, k) * std::hypot(eta + 1.0, k) / ((a + c) * (a + c) + b * b);
    const double ratio = std::hypot(a * c - s2, b * c) / std::hypot(a * c + s2, b * c);
    return 0.5 * std::min(1.0, outer * outer) * (1.0 + ratio * ratio);
}

dvec3 fresnel_conductor(const Material& material, double c) {
    return {fresnel_conductor(c, material.eta.x, material.k.x), fresnel_conductor(c, material.eta.y, material.k.y),
        fresnel_conductor(c, material.eta.z, material.k.z)};
}

// Sections 7.6 and 7.7, in the frame of the facing normal.
double ggx_alpha(const Material& material) { return material.roughness * material.roughness; }

double smith_lambda(const dvec3& w, double alpha) {
    const double tangent_squared = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    return 0.5 * (std::sqrt(1.0 + alpha * alpha * tangent_squared) - 1.0);
}

double ggx(const dvec3& h, double alpha) {
    const double a2 = alpha * alpha, spread = a2 * h.z * h.z + h.x * h.x + h.y * h.y;
    return a2 / (pi * spread * spread);
}

dvec3 visible_normal(const dvec3& i, double alpha, double u1, double u2) {
    const dvec3 v = glm::normalize(dvec3(alpha * i.x, alpha * i.y, i.z));
    const double z = (1.0 - u2) * (1.0 + v.z) - v.z, rho = std::sqrt(std::max(0.0, 1.0 - z * z));
    return glm::normalize(dvec3(alpha * (rho * std::cos(two_pi * u1) + v.x),
        alpha * (rho * std::sin(two_pi * u1) + v.y), (1.0 - u2) * (1.0 + v.z)));
}

double ggx_weight(const dvec3& i, const dvec3& o, double alpha) {
    const double seen = 1.0 + smith_lambda(i, alpha);
    return seen / (seen + smith_lambda(o, alpha));
}

// Sections 7.2 and 7.9. The sines' product over the greater cosine is that of the greater sine and the lesser tangent.
bool is_matt(const Material& material) {
    return material.kind == MaterialKind::diffuse || material.kind == MaterialKind::rough_diffuse;
}

double matt_share(const Reached& at, const dvec3& out) {
    if (at.material->kind == MaterialKind::diffuse) return 1.0;
    const double variance = at.material->roughness * at.material->roughness;
    const dvec3 normal = at.facing();
    const double ci = glm::dot(normal, at.back), co = glm::dot(normal, out);
    const double sines = std::max(0.0, glm::dot(at.back, out) - ci * co);
    return 1.0 - variance / (2.0 * variance + 0.66) +
           0.45 * variance / (variance + 0.09) * sines / std::max({ci, co, 1e-12});
}

// Section 7.4 at a normal on the side of `back`: the reflected or the refracted direction, by u3.
struct Turned {
    dvec3 direction;
    bool refracted;
    double eta;
};

Turned reflect_or_refract(const Reached& at, const dvec3& normal, double u3) {
    const Material& material = *at.material;
    const double eta = at.front() ? 1.0 / material.refractive_index : material.refractive_index;
    const dvec3 reflected = glm::normalize(mirrored(at.back, normal));
    if (!material.translucent) return {reflected, false, eta};
    const double c = glm::dot(at.back, normal), inner = (1.0 - eta) * (1.0 + eta) + eta * eta * c * c;
    if (inner < 0.0) return {reflected, false, eta};
    const double ct = std::sqrt(inner);
    double reflectance;
    if (material.fresnel == Fresnel::schlick) {
        const double r0 = (1.0 - eta) * (1.0 - eta) / ((1.0 + eta) * (1.0 + eta));
        reflectance = r0 + (1.0 - r0) * std::pow(1.0 - (eta > 1.0 ? ct : c), 5.0);
    } else {
        const double rs = (eta * c - ct) / (eta * c + ct), rp = (c - eta * ct) / (c + eta * ct);
        reflectance = 0.5 * (rs * rs + rp * rp);
    }
    if (u3 < reflectance) return {reflected, false, eta};
    return {glm::normalize((eta * c - ct) * normal - eta * at.back), true, eta};
}

dvec3 absorbed(const Reached& at) {  // section 7.1
    if (!at.material->translucent) return at.colour;
    return dvec3(1.0) - at.material->alpha * (dvec3(1.0) - at.colour);
}

double refraction_weight(const Turned& turned, Transport transport) {
    return turned.refracted && transport == Transport::from_light ? turned.eta * turned.eta : 1.0;
}

std::optional<ScatteredPath> scatter_rough(const Reached& at, const dvec3& u, Transport transport) {
    const dvec3 facing = at.facing(), i = to_frame_of(facing, at.back);
    const double alpha = ggx_alpha(*at.material);
    const dvec3 h = visible_normal(i, alpha, u.x, u.y);
    const Turned turned = reflect_or_refract(at, in_frame_of(facing, h), u.z);
    const dvec3 o = to_frame_of(facing, turned.direction);
    if (turned.refracted ? !(o.z < 0.0) : !(o.z > 0.0)) return std::nullopt;
    const bool conductor = at.material->kind == MaterialKind::conductor;
    const dvec3 share = conductor ? fresnel_conductor(*at.material, glm::dot(i, h)) : absorbed(at);
    return ScatteredPath{turned.direction, ggx_weight(i, o, alpha) * refraction_weight(turned, transport) * share,
        scattering_density(at, turned.direction)};
}

// Section 7.3: nothing where the perturbed direction is absorbed.
std::optional<dvec3> fuzzed(const Reached& at, const dvec3& w, const dvec3& u) {
    const double fuzz = at.material->fuzz;
    if (fuzz == 0.0) return w;
    const dvec3 spread = w + fuzz * sphere_direction(u.x, u.y);
    const double square = glm::dot(spread, spread);
    if (square < 0x1p-40) return std::nullopt;
    const dvec3 direction = spread / std::sqrt(square);
    if (glm::dot(direction, at.normal) * glm::dot(w, at.normal) <= 0.0) return std::nullopt;
    return direction;
}

}  // namespace

dvec3 in_frame_of(const dvec3& normal, const dvec3& local) {
    const Axes axes = axes_of(normal);
    return glm::normalize(local.x * axes.tangent + local.y * axes.bitangent + local.z * normal);
}

glm::dvec2 disc_point(double a, double b) {
    const double r = std::sqrt(a);
    return {r * std::cos(two_pi * b), r * std::sin(two_pi * b)};
}

dvec3 cosine_direction(const dvec3& normal, double a, double b) {
    return in_frame_of(normal, dvec3(disc_point(a, b), std::sqrt(1.0 - a)));
}

dvec3 sphere_direction(double a, double b) {
    const double rho = 2.0 * std::sqrt(a * (1.0 - a));
    return {rho * std::cos(two_pi * b), rho * std::sin(two_pi * b), 1.0 - 2.0 * a};
}

Lobe lobe_of(const Material& material) {
    if (is_matt(material)) return Lobe::known;
    if (material.kind == MaterialKind::conductor) return material.roughness > 0.0 ? Lobe::known : Lobe::delta;
    return material.fuzz > 0.0 || material.roughness > 0.0 ? Lobe::sampled_only : Lobe::delta;
}

dvec3 scattering_value(const Reached& at, const dvec3& out) {
    const dvec3 facing = at.facing();
    if (lobe_of(*at.material) != Lobe::known || !(glm::dot(out, facing) > 0.0)) return dvec3(0.0);
    if (is_matt(*at.material)) return matt_share(at, out) * at.colour / pi;
    const dvec3 i = to_frame_of(facing, at.back), o = to_frame_of(facing, out), h = glm::normalize(i + o);
    const double alpha = ggx_alpha(*at.material);
    const double together = 1.0 / (1.0 + smith_lambda(i, alpha) + smith_lambda(o, alpha));
    return fresnel_conductor(*at.material, glm::dot(i, h)) * (ggx(h, alpha) * together / (4.0 * i.z * o.z));
}

double scattering_density(const Reached& at, const dvec3& out) {
    const dvec3 facing = at.facing();
    const double cosine = glm::dot(out, facing);
    switch (lobe_of(*at.material)) {
        case Lobe::delta: {
            const bool inside = at.material->translucent && glm::dot(out, at.normal) < 0.0;
            const double index = inside ? at.material->refractive_index : 1.0;
            return index * index * std::abs(cosine);
        }
        case Lobe::sampled_only:
            return 1.0;  // weighs nothing: no other way to sample the path goes past it
        case Lobe::known:
            break;
    }
    if (!(cosine > 0.0)) return 0.0;
    if (is_matt(*at.material)) return cosine / pi;
    const dvec3 i = to_frame_of(facing, at.back), h = glm::normalize(i + to_frame_of(facing, out));
    const double alpha = ggx_alpha(*at.material);
    return ggx(h, alpha) / (4.0 * i.z * (1.0 + smith_lambda(i, alpha)));
}

std::optional<ScatteredPath> scatter_path(const Reached& at, const dvec3& u, Transport transport) {
    const Material& material = *at.material;
    const dvec3 facing = at.facing();
    if (is_matt(material)) {
        const dvec3 direction = cosine_direction(facing, u.x, u.y);
        return ScatteredPath{direction, matt_share(at, direction) * at.colour, scattering_density(at, direction)};
    }
    if (material.roughness > 0.0) return scatter_rough(at, u, transport);
    if (material.kind == MaterialKind::conductor) {
        const dvec3 direction = glm::normalize(mirrored(at.back, facing));
        return ScatteredPath{
            direction, fresnel_conductor(material, glm::dot(at.back, facing)), scattering_density(at, direction)};
    }
    const Turned turned = reflect_or_refract(at, facing, u.z);
    const std::optional<dvec3> direction = fuzzed(at, turned.direction, u);
    if (!direction) return std::nullopt;
    return ScatteredPath{
        *direction, refraction_weight(turned, transport) * absorbed(at), scattering_density(at, *direction)};
}

}  // namespace tandem::cpu
