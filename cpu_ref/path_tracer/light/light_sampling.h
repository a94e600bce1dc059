// The choice of a light and of a point on it, the density of that choice, and the MIS weight (MODEL.md section 9.2).
// Each lane is a path.
#pragma once

#include <limits>

#include "cpu_ref/path_tracer/arithmetic/sampling.h"
#include "cpu_ref/path_tracer/geometry/surface.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

// What is lit: a point, the primitive it lies on, and whether it is seen from inside that (convex) primitive.
template <class Real>
struct Receiver {
    Vec3<Lanes<Real>> point, facing;  // facing: the normal of the lit side
    Ints<Real> primitive;
    Mask<Real> inside;
    // Where lights move: by how much `point` was moved back, to where the light stands at rest, along the furthest
    // axis.
    Lanes<Real> displacement{};
    Mask<Real> in_medium{};  // there is no surface
};

template <class Real>
struct LightSample {
    Mask<Real> usable;
    Vec3<Lanes<Real>> direction;
    Lanes<Real> reach;  // distance within which anything but the light blocks
    Lanes<Real> distance;
    Lanes<Real> density;  // P_i p, over solid angle
    Ints<Real> primitive, material;
};

// The power heuristic's weight of a technique of density a against one of density b, overflow-safe. [Veach 1995]
template <class V>
TANDEM_INLINE V power_heuristic(V a, std::type_identity_t<V> b) {
    const V ratio = b / a;
    return V(RealOf<V>(1)) / fma(ratio, ratio, V(RealOf<V>(1)));
}

// Least index with v < cumulative[index] among `count` entries, the last if there is none.
template <class Real>
TANDEM_INLINE Ints<Real> choose_light(const LightTable<Real>& lights, Lanes<Real> v) {
    using U = UnsignedOf<Real>;
    if (planted(PlantedBug::light_choice_squared)) v = v * v;
    constexpr std::size_t linear_limit = 16;
    Ints<Real> chosen(U{0});
    if (lights.count <= linear_limit) {
        for (std::size_t i = 0; i + 1 < lights.count; ++i)
            chosen = select(v >= Lanes<Real>(lights.cumulative_list[i]), Ints<Real>(static_cast<U>(i + 1)), chosen);
        return chosen;
    }
    // Invariant: every entry below `chosen` is <= v.
    for (std::size_t step = std::bit_floor(lights.count - 1); step > 0; step /= 2) {
        const Ints<Real> probe = chosen + Ints<Real>(static_cast<U>(step));
        const Mask<Real> valid = probe < Ints<Real>(static_cast<U>(lights.count));
        const Ints<Real> row = select(valid, probe - Ints<Real>(U{1}), Ints<Real>(U{0}));
        chosen = select(valid & (v >= lights.cumulative[row]), probe, chosen);
    }
    return chosen;
}

// 1 - cos of the half angle under which a sphere of squared sine `s2` is seen.
template <class V>
TANDEM_INLINE V cone_height(V s2) {
    const V one(RealOf<V>(1));
    return s2 / (one + sqrt(greatest(V(one - s2), V(RealOf<V>(0)))));
}

inline constexpr double two_pi = 6.283185307179586476925286766559;
inline constexpr double inverse_pi = 0.31830988618379067153776752674503;

// Is the receiver inside the sphere? On its own surface only its side tells.
template <class Real>
TANDEM_INLINE Mask<Real> inside_sphere(
    const Receiver<Real>& from, Ints<Real> primitive, Lanes<Real> distance, Lanes<Real> radius) {
    const Mask<Real> own = from.primitive == primitive;
    return (own & from.inside) | ((!own) & (distance <= radius));
}

// Moves `patch` and `place` to the face of a cuboid, and the place on it, that v1 and v2 choose.
template <class Real>
TANDEM_INLINE void choose_cuboid_place(const LightTable<Real>& lights, Mask<Real> cuboid, Lanes<Real> v1,
    Lanes<Real> v2, Ints<Real>& patch, Point2<Lanes<Real>>& place) {
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    const V one(Real(1));
    const Ints<Real> first = select(cuboid, patch, Ints<Real>(U{0}));
    V low(Real(0)), high = one;
    Ints<Real> face(U{0});
    for (U f = 0; f < 6; ++f) {  // the face with low <= v1 < high
        const V bound =
            select(cuboid, lights.patch_cumulative[select(cuboid, first + Ints<Real>(f), Ints<Real>(U{0}))], one);
        const Mask<Real> passed = v1 >= bound;
        if (f < 5) face = select(passed, Ints<Real>(static_cast<U>(f + 1)), face);
        low = select(passed, bound, low);
        high = select((!passed) & (bound < high), bound, high);
    }
    patch = select(cuboid, patch + face, patch);
    place = {select(cuboid, (v1 - low) / (high - low), place.x), select(cuboid, v2, place.y)};
}

// Is the point behind every face of the cuboid?
template <class Real>
TANDEM_INLINE Mask<Real> inside_cuboid(
    const Tables<Real>& tables, Mask<Real> cuboid, Ints<Real> light, const Vec3<Lanes<Real>>& point) {
    using U = UnsignedOf<Real>;
    const LightTable<Real>& lights = tables.lights;
    const Ints<Real> first = select(cuboid, lights.first_patch[light], Ints<Real>(U{0}));
    Mask<Real> inside = cuboid;
    for (U f = 0; f < 6; ++f) {
        const Ints<Real> face = lights.patch_face[select(cuboid, first + Ints<Real>(f), Ints<Real>(U{0}))];
        inside = inside & (dot(tables.faces.normal[face], point) <= tables.faces.offset[face]);
    }
    return inside;
}

template <bool moving = false, class Real>
TANDEM_INLINE void sample_patch(const Tables<Real>& tables, const Receiver<Real>& from, Ints<Real> light,
    Lanes<Real> v1, Lanes<Real> v2, LightSample<Real>& sample) {
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    const V zero(Real(0)), one(Real(1));
    const LightTable<Real>& lights = tables.lights;
    Ints<Real> patch = lights.first_patch[light];
    Point2<V> place = sample_triangle(planted(PlantedBug::triangle_light_uneven) ? v1 * v1 : v1, v2);
    Mask<Real> solid{};
    if (lights.any_cuboid) {
        solid = lights.kind[light] == Ints<Real>(static_cast<U>(PrimitiveKind::cuboid));
        choose_cuboid_place(lights, solid, v1, v2, patch, place);
    }
    const Ints<Real> face = lights.patch_face[patch];
    const Vec3<V> y = along(
        along(lights.patch_corner[patch], place.x, lights.patch_edge1[patch]), place.y, lights.patch_edge2[patch]);
    const Vec3<V> offset = y - from.point;
    const V square = dot(offset, offset), distance = sqrt(square);
    sample.direction = offset * V(one / distance);
    sample.distance = distance;
    const V cosine = -dot(tables.faces.normal[face], sample.direction), magnitude = absolute(cosine);
    const V area_density = tables.faces.light_density[face];
    sample.density = area_density * square / magnitude;
    if (planted(PlantedBug::jacobian_missing)) sample.density = area_density;
    V error = V(error_factor<Real>) * (largest_magnitude(y) + tables.faces.extent[face]);
    if constexpr (moving) error = error_in_motion(error, from.displacement);
    sample.reach = distance - error / magnitude;
    // From behind: both sides must emit, and a solid light be around the receiver.
    const Mask<Real> both = has_bit(tables.materials.bits[sample.material], U{material_bits::both_sides});
    const Mask<Real> own = from.primitive == sample.primitive;
    Mask<Real> behind_counts = both & (cosine < zero);
    if (lights.any_cuboid) {
        Mask<Real> around = own & from.inside;
        const Mask<Real> other = solid & !own;
        if (any(other & behind_counts)) around = around | (other & inside_cuboid(tables, solid, light, from.point));
        behind_counts = behind_counts & ((!solid) | around);
    }
    // A surface does not light its own outside: it is flat or convex.
    sample.usable = ((cosine > zero) | behind_counts) & !(own & !(solid & from.inside)) & (magnitude > zero);
}

template <bool moving = false, class Real>
TANDEM_INLINE void sample_sphere_light(const Tables<Real>& tables, const Receiver<Real>& from, Mask<Real> lanes,
    Ints<Real> light, Lanes<Real> v1, Lanes<Real> v2, LightSample<Real>& sample) {
    using V = Lanes<Real>;
    const V zero(Real(0)), one(Real(1));
    const Ints<Real> sphere = select(lanes, tables.lights.sphere[light], Ints<Real>(UnsignedOf<Real>{0}));
    const Vec3<V> centre = tables.sphere_table.centre[sphere];
    const V radius = tables.sphere_table.radius[sphere], chance = tables.sphere_table.chance[sphere];
    const Vec3<V> offset = centre - from.point;
    const V square = dot(offset, offset), delta = sqrt(square);
    const Mask<Real> inside = inside_sphere(from, sample.primitive, delta, radius) & lanes;

    const V k = cone_height(V(radius * radius / square));
    const V cosine = one - k * v1, sine_squared = k * v1 * (V(Real(2)) - k * v1), sine = sqrt(sine_squared);
    const auto [c, s] = cosine_sine_turns(v2);
    Vec3<V> direction = frame_about(offset * V(one / delta)).to_world({sine * c, sine * s, cosine});
    const V half_chord = sqrt(greatest(V(radius * radius - square * sine_squared), zero));
    V distance = (delta - radius) * (delta + radius) / (delta * cosine + half_chord);
    V density = chance / (V(static_cast<Real>(two_pi)) * k *
                             V(static_cast<Real>(planted_scale(PlantedBug::sphere_light_cone_scaled))));
    Mask<Real> usable = lanes & !(from.primitive == sample.primitive);
    if (any(inside)) {
        const Vec3<V> n = sample_sphere(v1, v2), to_y = along(offset, radius, n);
        const V r2 = dot(to_y, to_y), r = sqrt(r2);
        const Vec3<V> w = to_y * V(one / r);
        const V cosine_y = dot(n, w);
        const V area_density = chance / (V(static_cast<Real>(2.0 * two_pi)) * radius * radius);
        direction = select(inside, w, direction);
        distance = select(inside, r, distance);
        density = select(inside, area_density * r2 / cosine_y, density);
        const Mask<Real> both =
            has_bit(tables.materials.bits[sample.material], UnsignedOf<Real>{material_bits::both_sides});
        usable = (usable & !inside) | (inside & both & (cosine_y > zero));
    }
    sample.direction = select(lanes, direction, sample.direction);
    sample.distance = select(lanes, distance, sample.distance);
    sample.density = select(lanes, density, sample.density);
    V error = V(error_factor<Real>) * (largest_magnitude(centre) + radius);
    if constexpr (moving) error = error_in_motion(error, from.displacement);
    sample.reach = select(lanes, distance - error, sample.reach);
    sample.usable = select_mask(lanes, usable, sample.usable);
}

template <class Real>
TANDEM_INLINE Mask<Real> select_mask(Mask<Real> choice, Mask<Real> a, Mask<Real> b) {
    return (choice & a) | ((!choice) & b);
}

// `v` are the numbers of the light block.
template <class Real>
TANDEM_INLINE LightSample<Real> sample_light(
    const Tables<Real>& tables, const Receiver<Real>& from, const RandomLanes<Real>& v) {
    using U = UnsignedOf<Real>;
    const LightTable<Real>& lights = tables.lights;
    const Ints<Real> light = choose_light(lights, v[0]);
    LightSample<Real> sample;
    sample.primitive = lights.primitive[light];
    sample.material = lights.material[light];
    const Mask<Real> round =
        lights.any_sphere ? lights.kind[light] == Ints<Real>(static_cast<U>(PrimitiveKind::sphere)) : Mask<Real>{};
    if (!all(round)) sample_patch(tables, from, select(round, Ints<Real>(U{0}), light), v[1], v[2], sample);
    if (any(round)) sample_sphere_light(tables, from, round, light, v[1], v[2], sample);
    return sample;
}

// P_i p of the direction in which a ray from `from` hit the surface `hit` at distance t; 0 where it is no sampled
// light.
template <class Real>
TANDEM_INLINE Lanes<Real> light_density(const Tables<Real>& tables, const Vec3<Lanes<Real>>& from,
    Ints<Real> from_primitive, Mask<Real> from_inside, const Hit<Real>& hit, const Surface<Real>& surface,
    const Vec3<Lanes<Real>>& direction) {
    using V = Lanes<Real>;
    const Ints<Real> row = row_of(tables, hit.face);
    const V area_density = tables.faces.light_density[row];
    V density = area_density * hit.t * hit.t / absolute(dot(surface.normal, direction));
    if (planted(PlantedBug::jacobian_missing)) density = area_density;
    if (tables.lights.any_sphere && any(surface.curved)) {
        const Ints<Real> sphere = tables.faces.sphere[row];
        const V radius = tables.sphere_table.radius[sphere], chance = tables.sphere_table.chance[sphere];
        const Vec3<V> offset = tables.sphere_table.centre[sphere] - from;
        const V square = dot(offset, offset);
        const Receiver<Real> receiver{from, direction, from_primitive, from_inside};
        const Mask<Real> outside = !inside_sphere(receiver, surface.primitive, sqrt(square), radius);
        const V cone = chance / (V(static_cast<Real>(two_pi)) * cone_height(V(radius * radius / square)));
        density = select(surface.curved & outside, cone, density);
    }
    if (planted(PlantedBug::mixture_ignored)) density = density * V(static_cast<Real>(tables.lights.count));
    return density;
}

}  // namespace tandem::cpu
