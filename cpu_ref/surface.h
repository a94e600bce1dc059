// The surface at a hit: point, normal, and how far rounding may have moved the point off it (MODEL.md section 5).
#pragma once

#include "cpu_ref/tables.h"

namespace tandem::cpu {

template <class Real>
struct Hit {
    Mask<Real> found;
    Lanes<Real> t;
    Ints<Real> face;  // 0 where nothing was found
};

template <class Real>
struct Surface {
    Vec3<Lanes<Real>> point, normal;  // normal: unit, to the front
    Lanes<Real> error_bound;          // of the point along the normal
    Ints<Real> primitive, material;
    Mask<Real> curved;
};

// Bound on the distance, along the normal, between a computed hit point p and what later rays take for its surface.
// With unit roundoff u = 2^-24 (2^-53), s = |p|_max + extent of the primitive:
// - plane: p is projected by p - (n.p - w) n. Evaluating n.p - w errs by at most 3u |n||p| + u|w| <= 4 sqrt(3) u s,
//   the subtraction by sqrt(3) u s.
// - sphere: p = L q + c errs by at most 3u (|L||q| + |c|) + u |p| <= 4 sqrt(3) u s.
// - the next ray evaluates a plane through p (a coplanar neighbour's, say): again 4 sqrt(3) u s, and that plane's
// rounded
//   unit normal tilts it by sqrt(3) u over its extent; so does the own one.
// Together below 11 sqrt(3) u s < 20 u s, and adding the offset rounds once more by u s.
template <class Real>
inline constexpr Real error_factor = Real(21) * (sizeof(Real) == 4 ? Real(0x1p-24) : Real(0x1p-53));

template <class Real>
TANDEM_INLINE Vec3<Lanes<Real>> apply_rows(
    const std::array<VectorColumn<Real>, 3>& rows, Ints<Real> index, Vec3<Lanes<Real>> a) {
    return {dot(rows[0][index], a), dot(rows[1][index], a), dot(rows[2][index], a)};
}

template <class Real>
TANDEM_INLINE void bend_to_sphere(const SphereTable<Real>& spheres, Ints<Real> sphere, Surface<Real>& surface) {
    const Vec3<Lanes<Real>> q = unit(apply_rows(spheres.to_local, sphere, surface.point) + spheres.local_shift[sphere]);
    const Vec3<Lanes<Real>> p = apply_rows(spheres.to_world, sphere, q) + spheres.centre[sphere];
    surface.point = select(surface.curved, p, surface.point);
    surface.normal = select(surface.curved, unit(apply_rows(spheres.normal_map, sphere, q)), surface.normal);
}

template <class Real>
TANDEM_INLINE Surface<Real> surface_at(const Tables<Real>& tables, const Ray<Lanes<Real>>& ray, const Hit<Real>& hit) {
    using V = Lanes<Real>;
    const FaceTable<Real>& faces = tables.faces;
    Surface<Real> surface;
    const Vec3<V> p = along(ray.origin, hit.t, ray.direction), n = faces.normal[hit.face];
    const V excess = dot(n, p) - faces.offset[hit.face];
    surface.point = along(p, -excess, n);
    surface.normal = n;
    surface.primitive = faces.primitive[hit.face];
    surface.material = faces.material[hit.face];
    surface.curved = Mask<Real>{};
    if (tables.planted(PlantedBug::normal_transform_wrong)) surface.normal = faces.shading_normal[hit.face];
    if (!tables.spheres.empty()) {
        surface.curved = has_bit(faces.curved[hit.face], UnsignedOf<Real>{1}) & hit.found;
        if (any(surface.curved)) {
            surface.point = select(surface.curved, p, surface.point);
            bend_to_sphere(tables.sphere_table, faces.sphere[hit.face], surface);
        }
    }
    surface.error_bound = V(error_factor<Real>) * (largest_magnitude(surface.point) + faces.extent[hit.face]);
    if (tables.planted(PlantedBug::self_hit_not_excluded)) surface.error_bound = V(Real(0));
    if (tables.planted(PlantedBug::epsilon_too_large)) surface.error_bound = V(static_cast<Real>(tables.size / 100.0));
    return surface;
}

// The same where entities move: found on the entity at rest by the ray moved back by `shift`, then moved there. The two
// shifts round by sqrt(3) u s each, s now with the shift's own size, and a later ray that is shifted in its turn by as
// much: below the bound at rest once more.
template <class Real>
TANDEM_INLINE Surface<Real> surface_in_motion(
    const Tables<Real>& tables, const Ray<Lanes<Real>>& ray, const Hit<Real>& hit, const Vec3<Lanes<Real>>& shift) {
    using V = Lanes<Real>;
    Ray<V> rest = ray;
    rest.origin = ray.origin - shift;
    Surface<Real> surface = surface_at(tables, rest, hit);
    const V size = largest_magnitude(shift), at_rest = surface.error_bound;
    surface.point = surface.point + shift;
    surface.error_bound = select(size > V(Real(0)), V(Real(2)) * (at_rest + V(error_factor<Real>) * size), at_rest);
    return surface;
}

}  // namespace tandem::cpu
