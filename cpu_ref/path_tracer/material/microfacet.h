// Conductors and the microfacet distribution of Trowbridge and Reitz, "GGX" (MODEL.md sections 7.6 and 7.7), a lane a
// path. Directions are in the frame of the normal of the lit side, z along it.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/sampling.h"
#include "cpu_ref/planted.h"

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

// The cosine below which directions count as grazing ones, so that tangents stay finite. It changes neither weights
// nor densities beyond rounding: both have finite limits at cosine 0.
inline constexpr double least_cosine = 0x1p-30;

// Lambda of Smith's masking.
template <class V>
TANDEM_INLINE V smith_lambda(Vec3<V> w, V alpha) {
    using Real = RealOf<V>;
    const V z = greatest(absolute(w.z), V(static_cast<Real>(least_cosine))), one(Real(1));
    const V tangent_squared = (w.x * w.x + w.y * w.y) / (z * z);
    return V(Real(0.5)) * (sqrt(V(one + alpha * alpha * tangent_squared)) - one);
}

// D(h). 1 + h_z^2 (alpha^2 - 1) is written as alpha^2 h_z^2 + h_x^2 + h_y^2, which does not cancel at the peak.
template <class V>
TANDEM_INLINE V ggx_distribution(Vec3<V> h, V alpha) {
    const V a2 = alpha * alpha, spread = a2 * h.z * h.z + (h.x * h.x + h.y * h.y);
    return a2 / (V(static_cast<RealOf<V>>(3.14159265358979323846)) * spread * spread);
}

// A normal visible from i (i.z >= 0) [Dupuy 2023].
template <class V>
TANDEM_INLINE Vec3<V> sample_visible_normal(Vec3<V> i, V alpha, V u1, V u2) {
    using Real = RealOf<V>;
    const V one(Real(1)), zero(Real(0));
    const Vec3<V> v = unit(Vec3<V>{alpha * i.x, alpha * i.y, i.z});
    const V height = (one - u2) * (one + v.z), z = height - v.z;
    const V rho = sqrt(greatest(V(one - z * z), zero));
    const auto [c, s] = cosine_sine_turns(u1);
    return unit(Vec3<V>{alpha * (rho * c + v.x), alpha * (rho * s + v.y), height});
}

// G2/G1, the weight of a sampled direction o without the Fresnel factor.
template <class V>
TANDEM_INLINE V ggx_weight(Vec3<V> i, Vec3<V> o, V alpha) {
    const V one(RealOf<V>(1)), seen = one + smith_lambda(i, alpha);
    if (planted(PlantedBug::ggx_masking_dropped)) return one;
    return seen / (seen + smith_lambda(o, alpha));
}

// For a direction o on the side of i: f cos without the Fresnel factor, the density of sampling it, and i.h.
template <class V>
struct Reflection {
    V transfer, density, cosine;
};
template <class V>
TANDEM_INLINE Reflection<V> ggx_reflection(Vec3<V> i, Vec3<V> o, V alpha) {
    using Real = RealOf<V>;
    const V one(Real(1)), z = greatest(i.z, V(static_cast<Real>(least_cosine)));
    const Vec3<V> h = unit(i + o);
    const V base = ggx_distribution(h, alpha) / (V(Real(4)) * z), seen = one + smith_lambda(i, alpha);
    if (planted(PlantedBug::ggx_masking_dropped)) return {base, base / seen, dot(i, h)};
    if (planted(PlantedBug::ggx_jacobian_missing))
        return {base / (seen + smith_lambda(o, alpha)), V(Real(4)) * z * base / seen, dot(i, h)};
    return {base / (seen + smith_lambda(o, alpha)), base / seen, dot(i, h)};
}

}  // namespace tandem::cpu
