// Conductors, smooth and rough (MODEL.md section 7.6), a lane a path.
#pragma once

#include "cpu_ref/path_tracer/material/microfacet.h"

namespace tandem::cpu {

// Reflectance of a conductor of index eta + ik at cosine c (section 7.6). The root of N^2 - s^2 has the larger part
// from a sum, the other from the product of both.
template <class V>
TANDEM_INLINE V conductor_reflectance(V c, V eta, V k) {
    using Real = RealOf<V>;
    const V zero(Real(0)), one(Real(1)), half(Real(0.5)), least_positive(std::numeric_limits<Real>::min());
    const V c2 = c * c, s2 = greatest(V(one - c2), zero), k2 = k * k, below = eta - one, above = eta + one;
    const V real = below * above + c2 - k2, half_imaginary = eta * k;
    const V larger =
        sqrt(V(half * (absolute(real) + sqrt(V(real * real + V(Real(4)) * half_imaginary * half_imaginary)))));
    const V smaller = half_imaginary / greatest(larger, least_positive);
    const auto positive = real >= zero;
    const V a = select(positive, larger, smaller), b2 = select(positive, smaller * smaller, larger * larger);
    const V sum = greatest(V((a + c) * (a + c) + b2), least_positive);
    const V rs = least(V((below * below + k2) * (above * above + k2) / sum / sum), one);
    const V ac = a * c, rest = b2 * c2;
    const V rp = rs * (((ac - s2) * (ac - s2) + rest) / ((ac + s2) * (ac + s2) + rest));
    return half * (rs + rp);
}

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

}  // namespace tandem::cpu
