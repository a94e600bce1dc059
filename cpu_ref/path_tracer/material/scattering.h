// How materials scatter (MODEL.md section 7), a lane a path.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/sampling.h"
#include "cpu_ref/path_tracer/material/microfacet.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

// Reflectance of a dielectric surface and the cosine of the refracted direction, at cosine c and relative index eta.
template <class Real>
struct Dielectric {
    Lanes<Real> reflectance, transmitted_cosine;
    Mask<Real> total_reflection;
};
template <class Real>
TANDEM_INLINE Dielectric<Real> dielectric(Lanes<Real> c, Lanes<Real> eta, Mask<Real> schlick) {
    using V = Lanes<Real>;
    const V one(Real(1)), zero(Real(0));
    // 1 - eta^2 (1 - c^2), to within a rounding of its terms where c is small.
    const V square = (one - eta) * (one + eta) + (eta * c) * (eta * c);
    const Mask<Real> total = square < zero;
    const V ct = sqrt(greatest(square, zero));
    const V rs = (eta * c - ct) / (eta * c + ct), rp = (c - eta * ct) / (c + eta * ct);
    const V exact = planted(PlantedBug::one_polarisation) ? rs * rs : V(Real(0.5)) * (rs * rs + rp * rp);
    const V root = (one - eta) / (one + eta), r0 = root * root;
    const V x = one - select(eta > one, ct, c), x2 = x * x;
    const V approximate = r0 + (one - r0) * (x2 * x2 * x);
    return {select(total, one, select(schlick, approximate, exact)), ct, total};
}

// n_incident / n_transmitted.
template <class Real>
TANDEM_INLINE Lanes<Real> relative_index(
    const Tables<Real>& tables, Ints<Real> material, Mask<Real> front, const Lanes<Real>* outside) {
    using V = Lanes<Real>;
    const V index = tables.materials.index[material];
    if (outside == nullptr || planted(PlantedBug::outside_index_ignored))
        return select(front, V(Real(1)) / index, index);
    return select(front, *outside / index, index / *outside);
}

template <class Real>
struct Scattered {
    Vec3<Lanes<Real>> direction;
    Mask<Real> alive;
};

// Section 7.3 and 7.4: mirror or refracted direction, then fuzz. `normal` is the front one, `facing` that of the side
// which the ray comes from, `c` its cosine. `outside`: the index outside of the surface, where it is not 1.
template <class Real>
TANDEM_INLINE Scattered<Real> scatter_specular(const Tables<Real>& tables, Ints<Real> material, Ints<Real> bits,
    Mask<Real> lanes, const Vec3<Lanes<Real>>& direction, const Vec3<Lanes<Real>>& normal,
    const Vec3<Lanes<Real>>& facing, Lanes<Real> c, Mask<Real> front, const RandomLanes<Real>& u,
    const Lanes<Real>* outside = nullptr) {
    using V = Lanes<Real>;
    const V one(Real(1)), zero(Real(0));
    Vec3<V> w = along(direction, V(c + c), facing);
    Mask<Real> alive = lanes;
    const Mask<Real> translucent = has_bit(bits, UnsignedOf<Real>{material_bits::translucent}) & lanes;
    if (any(translucent)) {
        const V eta = relative_index(tables, material, front, outside);
        const auto [reflectance, ct, total] =
            dielectric(c, eta, has_bit(bits, UnsignedOf<Real>{material_bits::schlick}));
        const Mask<Real> refracts = translucent & !total & !(u[2] < reflectance);
        w = select(refracts, along(direction * eta, V(eta * c - ct), facing), w);
        if (planted(PlantedBug::total_reflection_lost)) alive = alive & !(translucent & total);
    }
    w = unit(w);
    const Mask<Real> fuzzy = has_bit(bits, UnsignedOf<Real>{material_bits::fuzzy}) & lanes;
    if (any(fuzzy)) {
        const Vec3<V> spread = along(w, tables.materials.fuzz[material], sample_sphere(u[0], u[1]));
        const V square = dot(spread, spread);
        const Vec3<V> perturbed = spread * V(one / sqrt(square));
        const Mask<Real> absorbed =
            (!(dot(perturbed, normal) * dot(w, normal) > zero)) | (square < V(static_cast<Real>(0x1p-40)));
        w = select(fuzzy, perturbed, w);
        alive = alive & !(fuzzy & absorbed);
    }
    return {w, alive};
}

// Directions and weights of sections 7.6 and 7.7, where the microfacets of `facing` are sampled.
template <class Real>
struct Microfaceted {
    Vec3<Lanes<Real>> direction;
    Lanes<Real> weight;   // G2/G1
    Lanes<Real> density;  // of a conductor's direction
    Lanes<Real> cosine;   // i.h
    Mask<Real> alive;
};
template <class Real>
TANDEM_INLINE Microfaceted<Real> scatter_conductor(const Vec3<Lanes<Real>>& direction, const Vec3<Lanes<Real>>& facing,
    Lanes<Real> alpha, const RandomLanes<Real>& u) {
    using V = Lanes<Real>;
    const Frame<V> frame = frame_about(facing);
    Vec3<V> i = frame.to_local(-direction);
    i.z = greatest(i.z, V(Real(0)));
    const Vec3<V> h = sample_visible_normal(i, alpha, u[0], u[1]);
    const V cosine = dot(i, h);
    const Vec3<V> o = along(-i, V(cosine + cosine), h);
    return {unit(frame.to_world(o)), ggx_weight(i, o, alpha), ggx_reflection(i, o, alpha).density, cosine,
        o.z > V(Real(0))};
}
template <class Real>
TANDEM_INLINE Microfaceted<Real> scatter_rough_translucent(const Vec3<Lanes<Real>>& direction,
    const Vec3<Lanes<Real>>& facing, Lanes<Real> alpha, Lanes<Real> eta, Mask<Real> schlick,
    const RandomLanes<Real>& u) {
    using V = Lanes<Real>;
    const V zero(Real(0));
    const Frame<V> frame = frame_about(facing);
    Vec3<V> i = frame.to_local(-direction);
    i.z = greatest(i.z, zero);
    const Vec3<V> h = sample_visible_normal(i, alpha, u[0], u[1]);
    const V c = dot(i, h);
    const auto [reflectance, ct, total] = dielectric(c, eta, schlick);
    const Mask<Real> refracts = (!total) & !(u[2] < reflectance);
    const Vec3<V> reflected = along(-i, V(c + c), h), refracted = along(-i * eta, V(eta * c - ct), h);
    const Vec3<V> o = select(refracts, refracted, reflected);
    const Mask<Real> proper = (refracts & (o.z < zero)) | ((!refracts) & (o.z > zero));
    return {unit(frame.to_world(o)), ggx_weight(i, o, alpha), zero, c, proper};
}

// Section 7.2. With pdf_not_of_sampler directions are uniform and still weighted as cosine ones.
template <class Real>
TANDEM_INLINE Vec3<Lanes<Real>> scatter_diffuse(const Vec3<Lanes<Real>>& facing, const RandomLanes<Real>& u) {
    using V = Lanes<Real>;
    const V second = planted(PlantedBug::dimension_reused) ? u[0] : planted(PlantedBug::number_exchanged) ? u[3] : u[1];
    Vec3<V> local = sample_cosine_hemisphere(u[0], second);
    if (planted(PlantedBug::pdf_not_of_sampler)) {
        const V z = V(Real(1)) - u[0], rho = sqrt(V(greatest(V(Real(1)) - z * z, V(Real(0)))));
        const auto [c, s] = cosine_sine_turns(second);
        local = {rho * c, rho * s, z};
    }
    return frame_about(facing).to_world(local);
}

// Section 7.1.
template <class Real>
TANDEM_INLINE Vec3<Lanes<Real>> absorption(
    const Tables<Real>& tables, Ints<Real> material, Ints<Real> bits, const Vec3<Lanes<Real>>& colour) {
    using V = Lanes<Real>;
    const Mask<Real> translucent = has_bit(bits, UnsignedOf<Real>{material_bits::translucent});
    if (none(translucent)) return colour;
    const V one(Real(1)), alpha = tables.materials.alpha[material];
    const Vec3<V> clear{one - alpha * (one - colour.x), one - alpha * (one - colour.y), one - alpha * (one - colour.z)};
    return select(translucent, clear, colour);
}

}  // namespace tandem::cpu
