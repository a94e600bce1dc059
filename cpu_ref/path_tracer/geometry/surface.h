// The surface at a hit: point, normal, and how far rounding may have moved the point off it (MODEL.md section 5).
#pragma once

#include "cpu_ref/path_tracer/geometry/face_lanes.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

template <class Real>
struct Surface {
    Vec3<Lanes<Real>> point, normal;  // normal: unit, to the front
    Lanes<Real> error_bound;          // of the point along the normal
    Ints<Real> primitive, material;
    Mask<Real> curved, left;  // of a sphere, and that from within
};

// Bound on the distance, along the normal, between a computed hit point p and what later rays take for its surface.
// Unit roundoff u = 2^-24 (2^-53). Sphere, s = |p|_max + extent: p = L q + c errs by at most 3u (|L||q| + |c|) + u |p|
// <= 4 sqrt(3) u s. The next ray evaluates a plane through p (a neighbour's, say): again 4 sqrt(3) u s. That plane's
// rounded unit normal tilts it by sqrt(3) u over its extent, and so does the own one. Together below 11 sqrt(3) u s <
// 20 u s, and adding the offset rounds once more by u s.
template <class Real>
inline constexpr Real unit_roundoff = sizeof(Real) == 4 ? Real(0x1p-24) : Real(0x1p-53);
template <class Real>
inline constexpr Real error_factor = Real(21) * unit_roundoff<Real>;

// Plane: rounding is relative to each term of n.p, so that a floor of any size at y = 0 is known exactly. Let m_i =
// (|e_j f_k| + |e_k f_j|)/|e x f| >= |n_i| for edges e, f, and a = sum over axes i of m_i (|p_i| + extent along i). p
// is projected by p - (n.p - w) n, n.p - w erring by at most 4u a, the subtraction by u a. A coplanar neighbour's plane
// is evaluated with 4u a again. Its normal and the own one tilt by u a each, products of rounded edges by 2u a more:
// 13u a. Normals are made in double, where the products round by 2^-53. In single precision the other terms have |n_i|
// <= 1 alone, and a needle no more than m_i = 4 + 2^-29 m_i. One u (|p|_max + 2^-10 extent) keeps rays off coplanar
// neighbours where all terms vanish, at 0 too.
template <class Faces, class Real>
TANDEM_INLINE Lanes<Real> plane_error(const Faces& faces, Ints<Real> face, const Vec3<Lanes<Real>>& p) {
    using V = Lanes<Real>;
    const Vec3<V> size{absolute(p.x), absolute(p.y), absolute(p.z)};
    const V a = dot(faces.terms[face], size) + faces.terms_of_extent[face];
    return V(Real(13) * unit_roundoff<Real>) * a +
           V(unit_roundoff<Real>) * greatest(largest_magnitude(p), V(Real(0x1p-10)) * faces.extent[face]);
}

// Bound on the error of points of entities displaced by `size`, from that at rest. Shifting the ray back, and the point
// there, rounds by sqrt(3) u s each, where s has the shift's own size too. A later ray may be shifted in its turn by as
// much. That is below the bound at rest once more.
template <class V>
TANDEM_INLINE V error_in_motion(V at_rest, std::type_identity_t<V> size) {
    return select(size > V(RealOf<V>(0)), V(RealOf<V>(2)) * (at_rest + V(error_factor<RealOf<V>>) * size), at_rest);
}

// By rounding, a hit next to an edge may lie beyond the neighbour there. A ray that leaves towards that neighbour would
// miss it, and get out of a closed mesh. So hits beyond an edge, or within a margin of it, are moved in the plane to
// that margin inside. It holds what the distance from an edge, or from the neighbour's plane, is off by near it. Let P
// = |p|_max. There are 4u of terms of at most 2 sqrt(3) P. The rounded normal and offset add 2 sqrt(3) u P, and so does
// the moved point. In all that is below 21u P. Where two edges of 45 degrees meet, a move from one takes all but 0.29
// of the other's: 72u P. A neighbour may also stand over the face at an angle. The ray starts up to twice the point's
// error e above the plane. It is on this side of the neighbour where the margin's sine of the angle exceeds 2 e times
// its cosine. 8 e do for angles whose tangent is above 1/4, 14 degrees. A triangle smaller than the margin is not moved
// out of. No move is more than a quarter of its least height, since what moves away from one edge moves as far towards
// others.
template <class Faces, class Real>
TANDEM_INLINE void draw_in(
    const Faces& faces, Ints<Real> face, Mask<Real> planar, const Lanes<Real>& error, Surface<Real>& surface) {
    using V = Lanes<Real>;
    const V margin =
        greatest(V(Real(72) * unit_roundoff<Real>) * largest_magnitude(surface.point), V(V(Real(8)) * error));
    std::array<V, 3> distance;
    std::array<Mask<Real>, 3> near;
    for (std::size_t i = 0; i < 3; ++i) {
        distance[i] = dot(faces.edge_normal[i][face], surface.point) + faces.edge_offset[i][face];
        near[i] = planar & (margin > distance[i]);
    }
    if (none(near[0] | near[1] | near[2])) [[likely]]
        return;
    const V most = V(Real(0.25)) * faces.least_height[face];
    for (std::size_t i = 0; i < 3; ++i) {
        const V move = least(margin, most) - distance[i];
        surface.point = select(
            near[i] & (move > V(Real(0))), along(surface.point, move, faces.edge_normal[i][face]), surface.point);
    }
}

template <class Real>
TANDEM_INLINE Vec3<Lanes<Real>> apply_rows(
    const std::array<VectorColumn<Real>, 3>& rows, Ints<Real> index, Vec3<Lanes<Real>> a) {
    return {dot(rows[0][index], a), dot(rows[1][index], a), dot(rows[2][index], a)};
}

template <class Real>
TANDEM_INLINE void bend_to_sphere(
    const SphereTable<Real>& spheres, Ints<Real> sphere, const Vec3<Lanes<Real>>& direction, Surface<Real>& surface) {
    using V = Lanes<Real>;
    Vec3<V> q = unit(apply_rows(spheres.to_local, sphere, surface.point) + spheres.local_shift[sphere]);
    // On the side that the root tells: else as far from the middle of the chord on the other one.
    const Vec3<V> d = apply_rows(spheres.to_local, sphere, direction);
    const V ahead = dot(q, d);
    const V zero(Real(0));
    const Mask<Real> wrong = surface.curved & ((surface.left & (ahead < zero)) | ((!surface.left) & (ahead > zero)));
    if (any(wrong)) [[unlikely]]
        q = select(wrong, unit(along(q, V(V(Real(-2)) * ahead / dot(d, d)), d)), q);
    const Vec3<Lanes<Real>> p = apply_rows(spheres.to_world, sphere, q) + spheres.centre[sphere];
    surface.point = select(surface.curved, p, surface.point);
    surface.normal = select(surface.curved, unit(apply_rows(spheres.normal_map, sphere, q)), surface.normal);
}

// moved: by how much at most the entity stands elsewhere than where it is met. faces: FaceTable or FaceLanes.
template <class Faces, class Real>
TANDEM_INLINE Surface<Real> surface_on(const Faces& faces, const Tables<Real>& tables, const Ray<Lanes<Real>>& ray,
    const Hit<Real>& hit, const Lanes<Real>& moved) {
    using V = Lanes<Real>;
    Surface<Real> surface;
    const Vec3<V> p = along(ray.origin, hit.t, ray.direction), n = faces.normal[hit.face];
    const V excess = dot(n, p) - faces.offset[hit.face];
    surface.point = along(p, -excess, n);
    surface.normal = n;
    surface.primitive = faces.primitive[hit.face];
    surface.material = faces.material[hit.face];
    surface.curved = surface.left = Mask<Real>{};
    if (!tables.spheres.empty()) {
        surface.curved = has_bit(faces.curved[hit.face], UnsignedOf<Real>{1}) & hit.found;
        if (any(surface.curved)) {
            surface.left = surface.curved & has_bit(faces.curved[hit.face], UnsignedOf<Real>{curved_bits::left});
            surface.point = select(surface.curved, p, surface.point);
            bend_to_sphere(tables.sphere_table, faces.sphere[hit.face], ray.direction, surface);
        }
    }
    const V error = plane_error(faces, hit.face, surface.point);
    draw_in(faces, hit.face, hit.found & !surface.curved, error_in_motion(error, moved), surface);
    // A sphere has no coplanar neighbours, and rays that leave it pass it over: moved, their origins would only get
    // into what touches it.
    surface.error_bound = select(surface.curved, V(Real(0)), error);
    const IntersectionSettings& chosen = tables.settings.intersection;
    if (chosen.guard != SelfIntersectionGuard::error_bound) [[unlikely]]
        surface.error_bound =
            V(chosen.guard == SelfIntersectionGuard::fixed_epsilon ? static_cast<Real>(chosen.epsilon) : Real(0));
    return surface;
}

template <class Real>
TANDEM_INLINE Surface<Real> surface_at(const Tables<Real>& tables, const Ray<Lanes<Real>>& ray, const Hit<Real>& hit,
    const Lanes<Real>& moved = Lanes<Real>(Real(0))) {
    if (tables.meshes) [[unlikely]]
        return surface_on(lanes_of_faces(tables, hit), tables, ray, hit, moved);
    return surface_on(tables.faces, tables, ray, hit, moved);
}

// The same where entities move: found on the entity at rest by the ray moved back by `shift`, then moved there.
template <class Real>
TANDEM_INLINE Surface<Real> surface_in_motion(
    const Tables<Real>& tables, const Ray<Lanes<Real>>& ray, const Hit<Real>& hit, const Vec3<Lanes<Real>>& shift) {
    using V = Lanes<Real>;
    Ray<V> rest = ray;
    rest.origin = ray.origin - shift;
    const V size = largest_magnitude(shift);
    Surface<Real> surface = surface_at(tables, rest, hit, size);
    surface.point = surface.point + shift;
    if (tables.settings.intersection.guard == SelfIntersectionGuard::error_bound)
        surface.error_bound = error_in_motion(surface.error_bound, size);
    return surface;
}

// Each coordinate moved by up to 256 representable numbers towards `side`, near 0 by a fixed way [Wächter 2019].
template <class Real>
[[gnu::noinline]] Vec3<Lanes<Real>> moved_by_ulps(const Vec3<Lanes<Real>>& point, const Vec3<Lanes<Real>>& side) {
    using Whole = std::conditional_t<sizeof(Real) == 4, std::int32_t, std::int64_t>;
    // The way near 0 is the article's for float, in proportion for double.
    constexpr Real steps = Real(256), near_zero = Real(1.0 / 32.0),
                   way = Real(0x1p-16) * unit_roundoff<Real> * Real(0x1p24);
    const auto move = [](Real p, Real n) {
        if (std::abs(p) < near_zero) return p + way * n;
        const auto step = static_cast<Whole>(steps * n);
        return std::bit_cast<Real>(static_cast<Whole>(std::bit_cast<Whole>(p) + (p < Real(0) ? -step : step)));
    };
    Vec3<Lanes<Real>> moved = point;
    for (int i = 0; i < lane_count<Real>; ++i) {
        moved.x.v[i] = move(point.x[i], side.x[i]);
        moved.y.v[i] = move(point.y[i], side.y[i]);
        moved.z.v[i] = move(point.z[i], side.z[i]);
    }
    return moved;
}

// Where a ray starts that leaves to `side`, the normal or its opposite (section 5.2; guards: 5.3).
template <class Real>
TANDEM_INLINE Vec3<Lanes<Real>> leaving_origin(
    const Tables<Real>& tables, const Surface<Real>& surface, const Vec3<Lanes<Real>>& side) {
    if (tables.settings.intersection.guard == SelfIntersectionGuard::ulp) [[unlikely]]
        return moved_by_ulps<Real>(surface.point, side);
    return along(surface.point, surface.error_bound, side);
}

}  // namespace tandem::cpu
