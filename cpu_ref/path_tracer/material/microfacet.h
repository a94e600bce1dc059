// The microfacet distribution of Trowbridge and Reitz, "GGX" (MODEL.md sections 7.6 and 7.7), a lane a
// path. Directions are in the frame of the normal of the lit side, z along it.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/sampling.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

// The cosine below which directions count as grazing ones, so that tangents stay finite. It changes neither weights
// nor densities beyond rounding: both have finite limits at cosine 0.
inline constexpr double least_cosine = 0x1p-30;

// Lambda of Smith's masking.
template <class V>
TANDEM_INLINE V smith_lambda(Vec3<V> w, V alpha) {
    using Real = RealOf<V>;
    if (planted(PlantedBug::ggx_masking_dropped)) return V(Real(0));
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
    if (planted(PlantedBug::ggx_jacobian_missing))
        return {base / (seen + smith_lambda(o, alpha)), V(Real(4)) * z * base / seen, dot(i, h)};
    return {base / (seen + smith_lambda(o, alpha)), base / seen, dot(i, h)};
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

}  // namespace tandem::cpu
