// Sampling of all lights of MODEL.md section 9.2; each lane is a path. They are those of light_sampling.h, ellipsoids,
// moving lights, and lights without a surface (sections 8.2 and 8.3).
#pragma once

#include "cpu_ref/path_tracer/light/ellipsoid_lights.h"
#include "cpu_ref/path_tracer/light/light_tree.h"

namespace tandem::cpu {

template <class Real>
struct LitSample : LightSample<Real> {
    Vec3<Lanes<Real>> radiance;  // of deltas: what arrives
    Mask<Real> delta;            // scattering never finds it: point, spot, sun
    Mask<Real> far;              // at an infinite distance
};

// Radiance of the background that is mixed of two colours (section 8.1), and its density over solid angle (8.2).
template <class Real>
TANDEM_INLINE Vec3<Lanes<Real>> mixed_background(const Tables<Real>& tables, const Vec3<Lanes<Real>>& direction) {
    using V = Lanes<Real>;
    const V a = V(Real(0.5)) * (direction.y + V(Real(1)));
    return splat<V>(tables.background_down) * V(V(Real(1)) - a) + splat<V>(tables.background_up) * a;
}
template <class Real>
struct MixBrightness {
    Real down, up;
};
template <class Real>
TANDEM_INLINE MixBrightness<Real> mix_brightness(const Tables<Real>& tables) {
    const auto sum = [](const Vec3<Real>& a) { return a.x + a.y + a.z; };
    return {sum(tables.background_down), sum(tables.background_up)};
}
template <class Real>
TANDEM_INLINE Lanes<Real> mix_density(const Tables<Real>& tables, Lanes<Real> a) {
    using V = Lanes<Real>;
    const auto [down, up] = mix_brightness(tables);
    return (V(down) + V(up - down) * a) * V(Real(1) / (static_cast<Real>(two_pi) * (down + up)));
}

// What the background sends along `direction`, in `lanes`.
template <class Real>
[[gnu::noinline]] Vec3<Lanes<Real>> background_radiance(
    const Tables<Real>& tables, const Vec3<Lanes<Real>>& direction, Mask<Real> lanes) {
    if (!tables.environment) return mixed_background(tables, direction);
    Vec3<Lanes<Real>> result;
    for (unsigned left = lanes.to_bits(); left != 0; left &= left - 1) {
        const int i = std::countr_zero(left);
        const glm::dvec3 light = tables.environment->radiance({static_cast<double>(direction.x[i]),
            static_cast<double>(direction.y[i]), static_cast<double>(direction.z[i])});
        result.x.v[i] = static_cast<Real>(light.x);
        result.y.v[i] = static_cast<Real>(light.y);
        result.z.v[i] = static_cast<Real>(light.z);
    }
    return result;
}

// P p of the background in `direction`; 0 where it is no sampled light.
template <class Real>
[[gnu::noinline]] Lanes<Real> background_density(
    const Tables<Real>& tables, const Vec3<Lanes<Real>>& direction, Mask<Real> lanes) {
    using V = Lanes<Real>;
    const V chance(tables.lights.background_chance);
    if (tables.lights.background_chance == Real(0)) return chance;
    if (!tables.environment) return chance * mix_density(tables, V(V(Real(0.5)) * (direction.y + V(Real(1)))));
    V density(Real(0));
    for (unsigned left = lanes.to_bits(); left != 0; left &= left - 1) {
        const int i = std::countr_zero(left);
        density.v[i] = static_cast<Real>(tables.environment->density({static_cast<double>(direction.x[i]),
            static_cast<double>(direction.y[i]), static_cast<double>(direction.z[i])}));
    }
    return chance * density;
}

template <class Real>
[[gnu::noinline]] void sample_background(
    const Tables<Real>& tables, Mask<Real> lanes, Lanes<Real> v1, Lanes<Real> v2, LitSample<Real>& sample) {
    using V = Lanes<Real>;
    const V zero(Real(0)), one(Real(1)), two(Real(2));
    Vec3<V> direction{zero, one, zero};
    V density = zero;
    if (tables.environment) {
        for (unsigned left = lanes.to_bits(); left != 0; left &= left - 1) {
            const int i = std::countr_zero(left);
            const auto chosen = tables.environment->sample(static_cast<double>(v1[i]), static_cast<double>(v2[i]));
            direction.x.v[i] = static_cast<Real>(chosen.direction.x);
            direction.y.v[i] = static_cast<Real>(chosen.direction.y);
            direction.z.v[i] = static_cast<Real>(chosen.direction.z);
            density.v[i] = static_cast<Real>(chosen.density);
        }
    } else {
        const auto [down, up] = mix_brightness(tables);
        const V root = sqrt(greatest(V(V(down * down) + v1 * V(up * up - down * down)), zero));
        const V divisor = V(down) + root;
        const V a = select(divisor > zero, least(V(v1 * V(down + up) / divisor), one), zero);
        const V y = two * a - one, rho = two * sqrt(V(a * (one - a)));
        const auto [c, s] = cosine_sine_turns(v2);
        direction = {rho * c, y, rho * s};
        density = mix_density(tables, a);
    }
    density = density * V(tables.lights.background_chance);
    const V infinity(std::numeric_limits<Real>::infinity());
    sample.direction = select(lanes, direction, sample.direction);
    sample.density = select(lanes, density, sample.density);
    sample.distance = select(lanes, infinity, sample.distance);
    sample.reach = select(lanes, infinity, sample.reach);
    sample.radiance = select(lanes, background_radiance(tables, direction, lanes), sample.radiance);
    sample.usable = select_mask(lanes, lanes & (density > zero), sample.usable);
    sample.far = sample.far | lanes;
}

// Section 8.3, from the surface itself: that rays start off it would show in the distance to a near light.
template <class Real>
[[gnu::noinline]] void sample_punctual(const Tables<Real>& tables, const Vec3<Lanes<Real>>& from, Mask<Real> lanes,
    Ints<Real> light, Ints<Real> kind, LitSample<Real>& sample) {
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    const V zero(Real(0)), one(Real(1));
    const LightTable<Real>& lights = tables.lights;
    const Mask<Real> sun = lanes & (kind == Ints<Real>(static_cast<U>(LightKind::sun)));
    const Mask<Real> spot = lanes & (kind == Ints<Real>(static_cast<U>(LightKind::spot)));
    const Vec3<V> axis = lights.direction[light], offset = lights.position[light] - from;
    const V square = dot(offset, offset), distance = sqrt(square);
    const Vec3<V> direction = select(sun, -axis, offset * V(one / distance));
    const V place = (-dot(axis, direction) - lights.outer_cosine[light]) * lights.inverse_cosine_range[light];
    const V t = least(greatest(place, zero), one);
    const V smooth = planted(PlantedBug::spot_falloff_linear) ? t : t * t * (V(Real(3)) - (t + t));
    const V falloff = select(spot, smooth, one);
    const V strength = select(sun, one, falloff / (planted(PlantedBug::point_falloff_linear) ? distance : square)),
            infinity(std::numeric_limits<Real>::infinity());
    sample.direction = select(lanes, direction, sample.direction);
    sample.density = select(lanes, lights.chance[light], sample.density);
    sample.distance = select(lanes, select(sun, infinity, distance), sample.distance);
    sample.reach = select(lanes, select(sun, infinity, distance), sample.reach);
    sample.radiance = select(lanes, lights.intensity[light] * strength, sample.radiance);
    sample.usable = select_mask(lanes, sun | (lanes & (square > zero) & (falloff > zero)), sample.usable);
    sample.far = sample.far | sun;
    sample.delta = sample.delta | lanes;
}

// Rules 5 and 31. chance: of the tree's choice, beside what the table says.
template <class Real>
TANDEM_INLINE TreeChoice<Real> choose_any_light(
    const LightTable<Real>& lights, const Receiver<Real>& receiver, Lanes<Real> v) {
    using V = Lanes<Real>;
    const V one(Real(1)), share(lights.near_share);
    if (lights.tree.count == 0) return {choose_light(lights, v), one};
    const Mask<Real> near = v < share;
    TreeChoice<Real> choice = choose_by_tree(
        lights.tree, TreeReceiver<Real>{receiver.point, receiver.facing, receiver.in_medium}, near, V(v / share));
    if (all(near)) return choice;
    choice.light = select(near, choice.light, choose_light(lights, v));
    choice.chance = select(near, choice.chance, one);
    return choice;
}

// `v` are the numbers of the light block; `base` is the receiver's point on its surface; `time` that of the path.
template <class Real>
TANDEM_INLINE LitSample<Real> sample_any_light(const Tables<Real>& tables, const Receiver<Real>& receiver,
    const Vec3<Lanes<Real>>& base, const RandomLanes<Real>& v, Lanes<Real> time) {
    using U = UnsignedOf<Real>;
    const LightTable<Real>& lights = tables.lights;
    const auto is = [](Ints<Real> kind, LightKind wanted) { return kind == Ints<Real>(static_cast<U>(wanted)); };
    const TreeChoice<Real> choice = choose_any_light(lights, receiver, v[0]);
    const Ints<Real> light = choice.light, kind = lights.kind[light];
    Receiver<Real> from = receiver;
    if (lights.any_moving) {  // all is as at rest from there
        const Vec3<Lanes<Real>> shift = lights.motion[light] * time;
        from.point = receiver.point - shift;
        from.displacement = largest_magnitude(shift);
    }
    LitSample<Real> sample{};
    sample.primitive = lights.primitive[light];
    sample.material = lights.material[light];
    const Mask<Real> distant = !(kind < Ints<Real>(static_cast<U>(LightKind::point)));
    const Mask<Real> round = is(kind, LightKind::sphere), background = is(kind, LightKind::background);
    const Mask<Real> stretched = is(kind, LightKind::ellipsoid), flat = !(round | stretched | distant);
    if (any(flat)) sample_patch<true>(tables, from, select(flat, light, Ints<Real>(U{0})), v[1], v[2], sample);
    if (any(round)) sample_sphere_light<true>(tables, from, round, light, v[1], v[2], sample);
    if (any(stretched)) sample_ellipsoid(tables, from, stretched, light, v[1], v[2], sample);
    sample.radiance = tables.materials.radiance[sample.material];
    if (any(distant)) {
        sample.usable = sample.usable & !distant;
        const Mask<Real> punctual = distant & !background;
        if (any(punctual)) sample_punctual(tables, base, punctual, light, kind, sample);
        if (any(background)) sample_background(tables, background, v[1], v[2], sample);
    }
    if (lights.tree.count > 0) sample.density = sample.density * choice.chance;
    return sample;
}

// As light_density, for all lights that have a surface; `from` where entities move: as at rest.
template <class Real>
TANDEM_INLINE Lanes<Real> any_light_density(const Tables<Real>& tables, const Receiver<Real>& from,
    const Hit<Real>& hit, const Surface<Real>& surface, const Vec3<Lanes<Real>>& direction) {
    const Lanes<Real> density = light_density(tables, from.point, from.primitive, from.inside, hit, surface, direction);
    if (!tables.lights.any_ellipsoid) return density;
    const Ints<Real> row = row_of(tables, hit.face);
    const Mask<Real> stretched =
        surface.curved & has_bit(tables.faces.curved[row], UnsignedOf<Real>{curved_bits::ellipsoid_light});
    if (none(stretched)) return density;
    return select(
        stretched, ellipsoid_density(tables, from, tables.faces.sphere[row], surface.primitive, direction), density);
}

}  // namespace tandem::cpu
