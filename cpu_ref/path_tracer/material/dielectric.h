// Dielectrics, smooth (MODEL.md section 7.4) and rough (7.7), a lane a path.
#pragma once

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

}  // namespace tandem::cpu
