// Spheres stretched by their maps, as sampled lights (MODEL.md section 9.2); each lane is a path. They are sampled as
// unit spheres in their own coordinates. N maps directions from there to the world.
#pragma once

#include "cpu_ref/path_tracer/light/light_sampling.h"

namespace tandem::cpu {

// The receiver in the coordinates of the unit sphere.
template <class Real>
struct UnitSphereView {
    Vec3<Lanes<Real>> place;
    Lanes<Real> square;  // of its distance from the centre
    Mask<Real> inside;
    Lanes<Real> cone_density;  // of every direction of the cone, from outside
};

template <class Real>
TANDEM_INLINE UnitSphereView<Real> view_unit_sphere(
    const Tables<Real>& tables, const Receiver<Real>& from, Ints<Real> sphere, Ints<Real> primitive) {
    using V = Lanes<Real>;
    const V one(Real(1));
    const SphereTable<Real>& spheres = tables.sphere_table;
    const Vec3<V> place = apply_rows(spheres.to_local, sphere, from.point - spheres.centre[sphere]);
    const V square = dot(place, place);
    return {place, square, inside_sphere(from, primitive, sqrt(square), one),
        one / (V(static_cast<Real>(two_pi)) * cone_height(V(one / square)))};
}

template <class V>
TANDEM_INLINE V cube(V a) {
    return a * a * a;
}

// Bound on the distance along its normal between a sampled point and the ellipsoid as rays find it. It uses s = |c|_max
// + extent + |p - c|_max. Its points are known within error_factor (|c|_max + extent) (surface.h). The receiver's
// place, N^-1 (p - c), errs by less than 5u |N^-1| |p - c| before N takes it back. Cancellation in N^-1, which
// stretches what N flattens, happens along the short axes alone, and N shrinks it again.
template <class Real>
[[gnu::noinline]] void sample_ellipsoid(const Tables<Real>& tables, const Receiver<Real>& from, Mask<Real> lanes,
    Ints<Real> light, Lanes<Real> v1, Lanes<Real> v2, LightSample<Real>& sample) {
    using V = Lanes<Real>;
    const V zero(Real(0)), one(Real(1));
    const SphereTable<Real>& spheres = tables.sphere_table;
    const Ints<Real> sphere = select(lanes, tables.lights.sphere[light], Ints<Real>(UnsignedOf<Real>{0}));
    const UnitSphereView<Real> view = view_unit_sphere(tables, from, sphere, sample.primitive);
    const Vec3<V> x = view.place;
    const V delta = sqrt(view.square), k = cone_height(V(one / view.square));
    const V cosine = one - k * v1, sine_squared = k * v1 * (V(Real(2)) - k * v1), sine = sqrt(sine_squared);
    const auto [c, s] = cosine_sine_turns(v2);
    const auto frame = frame_about(x * V(-one / delta));
    Vec3<V> direction = frame.to_world({sine * c, sine * s, cosine});
    // At the rim rounding may leave less than nothing below the root.
    const V half_chord = sqrt(greatest(V(one - view.square * sine_squared), zero));
    V way = (delta - one) * (delta + one) / (delta * cosine + half_chord);
    V density = view.cone_density;
    // The nearest point to the centre, delta sin theta off it and square to the direction, less half a chord. The sum
    // x + way direction would be nothing but rounding where the receiver is far.
    const V aside = delta * sine * cosine - half_chord * sine;
    Vec3<V> y = frame.to_world({aside * c, aside * s, -delta * sine_squared - half_chord * cosine});
    Mask<Real> usable = lanes & !(from.primitive == sample.primitive);
    const Mask<Real> inside = view.inside & lanes;
    if (any(inside)) {
        const Vec3<V> n = sample_sphere(v1, v2), to_y = n - x;
        const V r2 = dot(to_y, to_y), r = sqrt(r2);
        const Vec3<V> w = to_y * V(one / r);
        const V cosine_y = dot(n, w);
        direction = select(inside, w, direction);
        way = select(inside, r, way);
        density = select(inside, r2 / (V(static_cast<Real>(2.0 * two_pi)) * cosine_y), density);
        y = select(inside, n, y);
        const Mask<Real> both =
            has_bit(tables.materials.bits[sample.material], UnsignedOf<Real>{material_bits::both_sides});
        usable = (usable & !inside) | (inside & both & (cosine_y > zero));
    }
    const Vec3<V> stretched = apply_rows(spheres.to_world, sphere, direction), centre = spheres.centre[sphere];
    const V stretch = length(stretched);
    const Vec3<V> towards = stretched * V(one / stretch);
    // Solid angles change by |det N| / |N w|^3; the radius is the cube root of |det N|.
    const V change = cube(V(stretch / spheres.radius[sphere]));
    sample.direction = select(lanes, towards, sample.direction);
    sample.distance = select(lanes, way * stretch, sample.distance);
    sample.density = select(lanes, spheres.chance[sphere] * density * change, sample.density);
    const V error = error_in_motion(V(V(error_factor<Real>) * (largest_magnitude(centre) + spheres.extent[sphere] +
                                                                  largest_magnitude(from.point - centre))),
        from.displacement);
    const V slope = absolute(dot(unit(apply_rows(spheres.normal_map, sphere, y)), towards));
    sample.reach = select(lanes, way * stretch - error / slope, sample.reach);
    sample.usable = select_mask(lanes, usable & (slope > zero), sample.usable);
}

// P p of a direction that meets the ellipsoid.
template <class Real>
[[gnu::noinline]] Lanes<Real> ellipsoid_density(const Tables<Real>& tables, const Receiver<Real>& from,
    Ints<Real> sphere, Ints<Real> primitive, const Vec3<Lanes<Real>>& direction) {
    using V = Lanes<Real>;
    const V zero(Real(0)), one(Real(1));
    const SphereTable<Real>& spheres = tables.sphere_table;
    const UnitSphereView<Real> view = view_unit_sphere(tables, from, sphere, primitive);
    const Vec3<V> shrunk = apply_rows(spheres.to_local, sphere, direction);
    const V shrinking = length(shrunk);  // 1/|N w|
    V density = view.cone_density;
    if (any(view.inside)) {
        const Vec3<V> w = shrunk * V(one / shrinking);
        const V b = dot(view.place, w);
        const Vec3<V> nearest = along(view.place, -b, w);
        const V cosine_y = sqrt(greatest(V(one - dot(nearest, nearest)), zero)), r = greatest(V(cosine_y - b), zero);
        const V within = select(cosine_y > zero, r * r / (V(static_cast<Real>(2.0 * two_pi)) * cosine_y), zero);
        density = select(view.inside, within, density);
    }
    const V change = cube(V(one / (shrinking * spheres.radius[sphere])));
    return spheres.chance[sphere] * density * change;
}

}  // namespace tandem::cpu
