// Ray-primitive intersection (MODEL.md section 5), for one ray or a packet of them against one primitive. Each kernel
// is told which rays left this very primitive: they skip it, or take the exit of the convex body that they are inside.
#pragma once

#include <cstdint>
#include <limits>

#include "cpu_ref/path_tracer/arithmetic/vec3.h"
#include "cpu_ref/path_tracer/geometry/settle.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

inline constexpr std::uint32_t no_primitive = 0xFFFFFFFFu;

template <class V>
struct Ray {
    Vec3<V> origin, direction;  // unit length
    Vec3<V> moment;             // origin x direction
    V t_min;                    // a hit has t_min <= t < limit
    V limit;
};
template <class V>
TANDEM_INLINE Ray<V> make_ray(Vec3<V> origin, Vec3<V> direction, V t_min, V limit) {
    return {origin, direction, cross(origin, direction), t_min, limit};
}

// Where a ray starts: the primitive it leaves (no_primitive: none) and whether it goes inside that primitive.
template <class V>
struct Departure {
    IndexOf<V> primitive;
    BoolOf<V> inside;
};

template <class V>
struct Candidate {
    BoolOf<V> hit;
    V t;
    IndexOf<V> face;  // relative to the primitive's first face
};

// Edges as Pluecker lines: edge a -> b passes the ray on the side of the sign of (b - a).(o x d) + (a x b).d.
// Where rounding leaves that sign in doubt, settle.h decides by the sign of the exact value for corners projected along
// the ray [Woop 2013]. Neighbours then agree on their shared edge, and all of a fan on its vertex. So no ray slips
// through. Doubt: u is the unit roundoff; E, A and O are the largest components of edges, corners and origin. e.(o x d)
// sums terms of at most 2 sqrt(3) E O in all, each off by 9u (edge 1, moment 2, sum 6). (a x b).d sums terms of 2
// sqrt(3) A E, off by 6u, and moments are off by 4 sqrt(3) u A^2. In all that is below u (32 E O + 21 A E + 7 A^2).
// Projecting rounds by 24 u E (O + A) in the same measure.
template <class Real>
struct TriangleForm {
    std::array<Vec3<Real>, 3> edge{}, edge_moment{}, corner{};
    Vec3<Real> normal{};  // unit, front
    Real offset = 0;      // plane normal.p = offset
    // A side is in doubt up to doubt_of_origin O + doubt_at_rest. NaN for a triangle of zero area: no side of it is
    // known.
    Real doubt_of_origin = 0, doubt_at_rest = std::numeric_limits<Real>::quiet_NaN();
};

// Unit sphere or box [-half, half]^3 in the coordinates that to_local yields.
template <class Real>
struct SphereForm {
    Affine<Real> to_local;
};
template <class Real>
struct CuboidForm {
    Affine<Real> to_local;
    Vec3<Real> half{};
};

// Does the line of the ray pass between the edges, these included? `perhaps` holds where `surely` does.
template <class V>
struct Passing {
    BoolOf<V> surely, perhaps;
};
template <class V>
TANDEM_INLINE Passing<V> passes_within(const TriangleForm<RealOf<V>>& triangle, const Ray<V>& ray) {
    const auto side = [&](std::size_t i) {
        const auto &e = triangle.edge[i], &m = triangle.edge_moment[i];
        const Vec3<V>&d = ray.direction, &l = ray.moment;
        return fma(
            V(e.x), l.x, fma(V(e.y), l.y, fma(V(e.z), l.z, fma(V(m.x), d.x, fma(V(m.y), d.y, V(V(m.z) * d.z))))));
    };
    V s0 = side(0), s1 = side(1), s2 = side(2);
    if (planted(PlantedBug::triangle_edge_lost)) s0 = s0 - (s0 + s1 + s2) * V(static_cast<RealOf<V>>(planted_amount()));
    const V doubt = fma(V(triangle.doubt_of_origin), largest_magnitude(ray.origin), V(triangle.doubt_at_rest));
    const V below = -doubt;
    return {static_cast<BoolOf<V>>(
                ((s0 > doubt) & (s1 > doubt) & (s2 > doubt)) | ((s0 < below) & (s1 < below) & (s2 < below))),
        static_cast<BoolOf<V>>(
            ((s0 >= below) & (s1 >= below) & (s2 >= below)) | ((s0 <= doubt) & (s1 <= doubt) & (s2 <= doubt)))};
}

template <class V>
TANDEM_INLINE Candidate<V> intersect(
    const TriangleForm<RealOf<V>>& triangle, const Ray<V>& ray, BoolOf<V> departing, BoolOf<V> /*inside*/) {
    const Passing<V> passing = passes_within(triangle, ray);
    const Vec3<V> n = splat<V>(triangle.normal);
    V t = (V(triangle.offset) - dot(n, ray.origin)) / dot(n, ray.direction);
    BoolOf<V> within = passing.surely;
    const BoolOf<V> doubtful = static_cast<BoolOf<V>>(passing.perhaps & !passing.surely & !departing);
    if (any(doubtful)) [[unlikely]]
        settle(triangle.corner, ray.origin, ray.direction, doubtful, within, t);
    // A ray in the plane has t = NaN or infinite and misses, as limit <= infinity.
    return {static_cast<BoolOf<V>>(within & (t >= ray.t_min) & (t < ray.limit) & !departing), t, IndexOf<V>{0}};
}

// Does the ray meet it at all? As intersect, without its division: t is compared as a fraction.
template <class V>
TANDEM_INLINE BoolOf<V> blocks(
    const TriangleForm<RealOf<V>>& triangle, const Ray<V>& ray, BoolOf<V> departing, BoolOf<V> inside) {
    const Passing<V> passing = passes_within(triangle, ray);
    const BoolOf<V> doubtful = static_cast<BoolOf<V>>(passing.perhaps & !passing.surely & !departing);
    if (any(doubtful)) [[unlikely]]
        return intersect(triangle, ray, departing, inside).hit;
    const Vec3<V> n = splat<V>(triangle.normal);
    const V height = V(triangle.offset) - dot(n, ray.origin), slope = dot(n, ray.direction);
    const V steepness = absolute(slope), ahead = select(slope < V(RealOf<V>(0)), V(-height), height);
    return static_cast<BoolOf<V>>(
        passing.surely & (ahead >= ray.t_min * steepness) & (ahead < ray.limit * steepness) & !departing);
}

// The faces of a sphere, by the root that was taken. The sphere's normal there would not always tell. For a body that
// the map flattens, or a distant one, rounding moves the point to the other side.
namespace sphere_face {
inline constexpr std::uint32_t entered = 0, left = 1;
}

template <class V>
TANDEM_INLINE Candidate<V> intersect(
    const SphereForm<RealOf<V>>& sphere, const Ray<V>& ray, BoolOf<V> departing, BoolOf<V> inside) {
    using Real = RealOf<V>;
    const V zero(Real(0));
    const Vec3<V> o = apply(sphere.to_local, ray.origin), d = apply_linear(sphere.to_local, ray.direction);
    const V scale = V(Real(1)) / dot(d, d);
    const V middle = -dot(o, d) * scale;  // parameter of the point nearest to the centre
    const Vec3<V> nearest = along(o, middle, d);
    const V discriminant = V(Real(1)) - dot(nearest, nearest);
    const BoolOf<V> exits = departing & inside;
    const V half_chord = sqrt(V(greatest(discriminant, zero) * scale));
    // The root beyond the middle comes from the sum, the other from the product of both, |o|^2 - 1. So the side of the
    // start counts. Inside or outside decides the sign of that root, where middle - half_chord would be rounding alone.
    // It lies within half a chord of the start where rounding leaves little of either.
    const BoolOf<V> ahead = middle >= zero;
    const V far_root = select(ahead, middle + half_chord, middle - half_chord);
    const V product = (dot(o, o) - V(Real(1))) * scale;
    const V near_root = product / select(absolute(far_root) > zero, far_root, V(Real(1)));
    const V entry = select(ahead, least(greatest(near_root, -half_chord), far_root), far_root);
    const V exit = select(ahead, far_root, greatest(least(near_root, half_chord), far_root));
    const BoolOf<V> takes_entry = (entry >= ray.t_min) & !exits;
    // From inside the exit lies ahead, even where rounding says otherwise.
    const V t = select(takes_entry, entry, select(exits, greatest(exit, zero), exit));
    BoolOf<V> met = ((discriminant >= zero) | exits) & !(departing & !inside);
    if (planted(PlantedBug::sphere_inside_lost)) met = met & takes_entry;
    return {static_cast<BoolOf<V>>(met & (t >= ray.t_min) & (t < ray.limit)), t,
        select(takes_entry, IndexOf<V>{sphere_face::entered}, IndexOf<V>{sphere_face::left})};
}

template <class V>
struct Slabs {
    V entry, exit;
    IndexOf<V> entry_face, exit_face;
};

// Narrows by the slab |p_axis| <= half. A ray (all but) parallel to it is inside for ever or never.
template <class V>
TANDEM_INLINE void clip_slab(Slabs<V>& slabs, unsigned axis, V origin, V direction, RealOf<V> half) {
    using Real = RealOf<V>;
    const V infinity(std::numeric_limits<Real>::infinity()), zero(Real(0)), h(half);
    const BoolOf<V> parallel = !(absolute(direction) >= V(std::numeric_limits<Real>::min()));
    const BoolOf<V> ascending = direction > zero;
    const V inverse = V(Real(1)) / select(parallel, V(Real(1)), direction);
    const V low = (-h - origin) * inverse, high = (h - origin) * inverse;
    const BoolOf<V> within = absolute(origin) <= h;
    const V near = select(parallel, select(within, -infinity, infinity), select(ascending, low, high));
    const V far = select(parallel, select(within, infinity, -infinity), select(ascending, high, low));
    const IndexOf<V> low_face(2 * axis), high_face(2 * axis + 1);
    const BoolOf<V> enters = near > slabs.entry, leaves = far < slabs.exit;
    slabs.entry = select(enters, near, slabs.entry);
    slabs.entry_face = select(enters, select(ascending, low_face, high_face), slabs.entry_face);
    slabs.exit = select(leaves, far, slabs.exit);
    slabs.exit_face = select(leaves, select(ascending, high_face, low_face), slabs.exit_face);
}

// Faces are numbered -x +x -y +y -z +z.
template <class V>
TANDEM_INLINE Candidate<V> intersect(
    const CuboidForm<RealOf<V>>& cuboid, const Ray<V>& ray, BoolOf<V> departing, BoolOf<V> inside) {
    using Real = RealOf<V>;
    const V infinity(std::numeric_limits<Real>::infinity()), zero(Real(0));
    const Vec3<V> o = apply(cuboid.to_local, ray.origin), d = apply_linear(cuboid.to_local, ray.direction);
    Slabs<V> slabs{-infinity, infinity, IndexOf<V>{0}, IndexOf<V>{0}};
    clip_slab(slabs, 0, o.x, d.x, cuboid.half.x);
    clip_slab(slabs, 1, o.y, d.y, cuboid.half.y);
    clip_slab(slabs, 2, o.z, d.z, cuboid.half.z);
    const BoolOf<V> exits = departing & inside;
    const BoolOf<V> takes_entry = (slabs.entry >= ray.t_min) & !exits;
    const V t = select(takes_entry, slabs.entry, select(exits, greatest(slabs.exit, zero), slabs.exit));
    const BoolOf<V> met = ((slabs.entry <= slabs.exit) | exits) & !(departing & !inside);
    return {static_cast<BoolOf<V>>(met & (t >= ray.t_min) & (t < ray.limit)), t,
        select(takes_entry, slabs.entry_face, slabs.exit_face)};
}

template <class V, class Form>
TANDEM_INLINE BoolOf<V> blocks(const Form& form, const Ray<V>& ray, BoolOf<V> departing, BoolOf<V> inside) {
    return intersect(form, ray, departing, inside).hit;
}

}  // namespace tandem::cpu
