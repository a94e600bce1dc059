// Rough diffuse surfaces (MODEL.md section 7.9), a lane a path.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/sampling.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

// f of a path that arrives and leaves in these directions, divided by that of a diffuse surface [Oren 1994]. With beta
// the lesser angle, sin alpha tan beta = sin theta_i sin theta_o / cos beta. `facing`: the normal of the lit side.
template <class V>
TANDEM_INLINE V rough_diffuse_factor(
    const Vec3<V>& facing, const Vec3<V>& arriving, const Vec3<V>& leaving, V sigma_squared) {
    using Real = RealOf<V>;
    const V one(Real(1)), zero(Real(0)), s2 = sigma_squared;
    const V a = one - s2 / (V(Real(2)) * (s2 + V(static_cast<Real>(0.33))));
    V b = V(static_cast<Real>(0.45)) * s2 / (s2 + V(static_cast<Real>(0.09)));
    if (planted(PlantedBug::rough_diffuse_term_dropped)) b = zero;
    const Frame<V> frame = frame_about(facing);
    const Vec3<V> i = frame.to_local(-arriving), o = frame.to_local(leaving);
    const V toward = greatest(V(i.x * o.x + i.y * o.y), zero);
    return a + b * toward / greatest(V(greatest(i.z, o.z)), V(static_cast<Real>(0x1p-30)));
}

}  // namespace tandem::cpu
