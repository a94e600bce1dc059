// Three-vectors over numbers or lanes, and 3x4 affine maps. Products are summed with fused multiply-adds in a fixed
// order.
#pragma once

#include <array>

#include "cpu_ref/path_tracer/arithmetic/lanes.h"

namespace tandem::cpu {

template <class V>
struct Vec3 {
    V x{}, y{}, z{};
    TANDEM_INLINE friend Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    TANDEM_INLINE friend Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    TANDEM_INLINE friend Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
    TANDEM_INLINE friend Vec3 operator*(Vec3 a, V s) { return {a.x * s, a.y * s, a.z * s}; }
    TANDEM_INLINE Vec3 operator-() const { return {-x, -y, -z}; }
};

template <class V>
TANDEM_INLINE V dot(Vec3<V> a, std::type_identity_t<Vec3<V>> b) {
    return fma(a.x, b.x, fma(a.y, b.y, V(a.z * b.z)));
}
// Exactly antisymmetric: cross(b, a) == -cross(a, b).
template <class V>
TANDEM_INLINE Vec3<V> cross(Vec3<V> a, std::type_identity_t<Vec3<V>> b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
TANDEM_INLINE V length(Vec3<V> a) {
    return sqrt(dot(a, a));
}
template <class V>
TANDEM_INLINE Vec3<V> unit(Vec3<V> a) {
    return a * V(V(RealOf<V>(1)) / length(a));
}
// a + s b
template <class V>
TANDEM_INLINE Vec3<V> along(Vec3<V> a, std::type_identity_t<V> s, std::type_identity_t<Vec3<V>> b) {
    return {fma(s, b.x, a.x), fma(s, b.y, a.y), fma(s, b.z, a.z)};
}
template <class V>
TANDEM_INLINE Vec3<V> select(BoolOf<V> choice, Vec3<V> a, Vec3<V> b) {
    return {select(choice, a.x, b.x), select(choice, a.y, b.y), select(choice, a.z, b.z)};
}
template <class V>
TANDEM_INLINE V largest_magnitude(Vec3<V> a) {
    return greatest(greatest(absolute(a.x), absolute(a.y)), absolute(a.z));
}
template <class V>
TANDEM_INLINE Vec3<V> splat(const Vec3<RealOf<V>>& a) {
    return {V(a.x), V(a.y), V(a.z)};
}

// p' = L p + c, rows of [L | c].
template <class Real>
struct Affine {
    std::array<Vec3<Real>, 3> rows{};
    Vec3<Real> shift{};
};
template <class V>
TANDEM_INLINE Vec3<V> apply_linear(const Affine<RealOf<V>>& map, Vec3<V> a) {
    return {dot(splat<V>(map.rows[0]), a), dot(splat<V>(map.rows[1]), a), dot(splat<V>(map.rows[2]), a)};
}
template <class V>
TANDEM_INLINE Vec3<V> apply(const Affine<RealOf<V>>& map, Vec3<V> p) {
    const auto row = [&](const Vec3<RealOf<V>>& r, RealOf<V> c) {
        return fma(V(r.x), p.x, fma(V(r.y), p.y, fma(V(r.z), p.z, V(c))));
    };
    return {row(map.rows[0], map.shift.x), row(map.rows[1], map.shift.y), row(map.rows[2], map.shift.z)};
}

}  // namespace tandem::cpu
