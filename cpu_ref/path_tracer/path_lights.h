// The light that paths of the CPU path tracer meet (MODEL.md sections 8 and 9.2): the background, emitting surfaces,
// and next events. Included by path_tracer.h alone.
#pragma once

#include "cpu_ref/path_tracer/path_tracer.h"

namespace tandem::cpu {

// Section 8: B, and W_k where it is a light (section 9.2).
template <class Real, std::uint64_t effects, class Recorder, class Shade>
Vec3<Lanes<Shade>> PathTracer<Real, effects, Recorder, Shade>::background(
    const Vec3<V>& direction, [[maybe_unused]] std::uint32_t first, [[maybe_unused]] M lanes) {
    if constexpr (!has(Effect::background_image) && !has(Effect::sampled_background))
        return mixed_background(shading_, shaded(direction));
    const Vec3<S> light = background_radiance(shading_, shaded(direction), shaded(lanes));
    if (!samples_lights_ || !on(Effect::sampled_background)) return light;
    const V zero(Real(0)), one(Real(1)), scattered = load<Real>(&paths_.density[first]);
    const M found = lanes & (scattered > zero);
    if (none(found)) return light;
    const V sampled = background_density(tables_, direction, found);
    const M weighted = found & (sampled > zero);
    const V weight = select(weighted, weighs_ ? power_heuristic(scattered, sampled) : zero, one);
    if constexpr (Recorder::records) record_at_hand(&TracedVertex::found_weight, weight, lanes);
    return light * shaded(weight);
}

// Adds A L_e W_k.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::add_emission(
    Vertex& at, std::uint32_t first, const Hit<Real>& hit, const Ray<V>& ray) {
    M emits = hit.found & has_bit(at.bits, U{material_bits::emits}) &
              (at.front | has_bit(at.bits, U{material_bits::both_sides}));
    if constexpr (crossing) emits = emits & !at.place.same_face;
    if (none(emits)) return;
    Vec3<S> light = shading_.materials.radiance[shaded(at.surface.material)];
    if constexpr (has(Effect::light_sampling)) {
        const V zero(Real(0)), one(Real(1)), scattered = load<Real>(&paths_.density[first]);
        const I primitive = load_ints<Real>(&paths_.primitive[first]);
        const M inside = has_bit(load_ints<Real>(&paths_.inside[first]), U{1});
        const V sampled = [&] {
            if constexpr (general) {
                const bool moves = tables_.moves && !planted(PlantedBug::lamp_density_at_rest);
                const Vec3<V> from = moves ? ray.origin - at.more.shift : ray.origin;
                V density =
                    any_light_density(tables_, {from, at.direction, primitive, inside}, hit, at.surface, at.direction);
                if (const LightTree<Real>& tree = tables_.lights.tree; tree.count > 0) {
                    const M asked = emits & (scattered > zero) & (density > zero);
                    density =
                        density * chance_by_tree(tree,
                                      {ray.origin, load3(paths_.side.normal, first), primitive == I(U{no_primitive})},
                                      asked, tables_.faces.light[row_of(tables_, hit.face)]);
                }
                return density;
            } else {
                return light_density(tables_, ray.origin, primitive, inside, hit, at.surface, at.direction);
            }
        }();
        const M weighted = samples_lights_ ? emits & (scattered > zero) & (sampled > zero) : M{};
        if (any(weighted)) {
            const bool swapped = planted(PlantedBug::heuristic_swapped);
            const V heuristic = swapped ? power_heuristic(sampled, scattered) : power_heuristic(scattered, sampled);
            const V weight = select(weighted, weighs_ ? heuristic : zero, one);
            if constexpr (Recorder::records) record_at_hand(&TracedVertex::found_weight, weight, emits);
            light = light * shaded(weight);
        }
    }
    at.radiance = select(shaded(emits), at.radiance + at.throughput * light, at.radiance);
}

// Next event estimation of section 9.2.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::add_direct_light(
    Vertex& at, M lanes, [[maybe_unused]] std::uint32_t first) {
    if (none(lanes)) return;
    const RandomLanes<Real> v = numbers<Real>(
        at.id, at.number * I(U{dimension::blocks_per_vertex}) + I(U{dimension::first_vertex + dimension::light}));
    const Vec3<V> side = surface_side(at);
    Receiver<Real> receiver{leaving_origin(tables_, at.surface, side), side, at.surface.primitive, !at.front};
    if constexpr (general) receiver.in_medium = at.more.in_medium;
    V time(Real(0));
    if constexpr (moving) time = load<Real>(&paths_.motion.time[first]);
    const auto sample = [&] {
        if constexpr (general)
            return sample_any_light(tables_, receiver, at.surface.point, v, time);
        else
            return sample_light(tables_, receiver, v);
    }();
    const M lit = sees_sample(at, receiver, sample, lanes, time);
    if (any(lit)) add_sample(at, first, side, sample, lit);
}

// Whether the receiver can get light from the sampled point, and no surface is between them.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
template <class Sample>
TANDEM_INLINE Mask<Real> PathTracer<Real, effects, Recorder, Shade>::sees_sample(
    const Vertex& at, const Receiver<Real>& receiver, const Sample& sample, M lanes, V time) {
    const V zero(Real(0));
    M above = dot(at.facing, sample.direction) > zero, within = sample.distance < V(tables_.limit);
    if constexpr (has(Effect::shading_normals))
        if (!planted(PlantedBug::shading_guard_dropped))
            above = above & (dot(receiver.facing, sample.direction) > zero);
    if constexpr (general) {
        above = above | at.more.in_medium;
        within = within | sample.far;  // what a ray without a hit finds, wherever the interval of hits ends
    }
    const M reachable = lanes & sample.usable & above & (sample.distance >= V(tables_.t_min)) & within;
    if (none(reachable)) return M{};
    if constexpr (Recorder::records) record_aim(sample.direction, reachable);
    const V limit = least(V(tables_.limit), V(sample.reach * V(static_cast<Real>(planted_reach()))));
    const Ray<V> shadow = make_ray(receiver.point, sample.direction, V(tables_.t_min), limit);
    const Departure<V> departure{at.surface.primitive, receiver.inside};
    return reachable & !accelerator_.occluded(shadow, departure, sample.primitive, reachable, time);
}

// Adds A f cos L_e W_k / p of the sampled point.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
template <class Sample>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::add_sample(Vertex& at,
    [[maybe_unused]] std::uint32_t first, [[maybe_unused]] const Vec3<V>& side, const Sample& sample, M lit) {
    const S s_cosine = shaded(dot(at.facing, sample.direction)), density = shaded(sample.density);
    const ShadeMask s_lit = shaded(lit);
    S scattered = s_cosine * S(static_cast<Shade>(inverse_pi));  // f's C/pi times cos, and the density of scattering
    S transfer = scattered;
    Vec3<S> colour = at.colour;
    [[maybe_unused]] Vec3<S> transmitted{};
    if constexpr (general) {
        const Response response = respond(at, shaded(sample.direction), s_cosine, s_lit);
        scattered = response.density;
        transfer = response.transfer;
        const V lead = select(sample.delta, V(Real(0)), at.surface.error_bound * dot(side, sample.direction));
        transmitted = transmittance(first, at.surface.point, sample.direction, sample.distance + lead, lit);
        colour = response.colour;
    }
    S weight = weighs_ ? power_heuristic(density, scattered) : S(Shade(1));
    plant_in_next_event<Shade>({density, scattered, s_cosine, tables_.lights.count}, weight, transfer);
    if constexpr (general) {
        const S whole(Shade(1));
        weight = weighs_ ? select(shaded(sample.delta), whole, weight) : whole;
        const Vec3<S> light = shaded(sample.radiance) * S(transfer / density * weight);
        const Vec3<S> brought = at.throughput * (colour * transmitted) * light;
        if constexpr (Recorder::records)
            record_light({sample.direction, shaded(sample.radiance), density, colour * transfer, transmitted, weight},
                brought, lit);
        at.radiance = select(s_lit, at.radiance + brought, at.radiance);
    } else {
        const Vec3<S> light = shading_.materials.radiance[shaded(sample.material)] * S(transfer / density * weight);
        at.radiance = select(s_lit, at.radiance + at.throughput * colour * light, at.radiance);
    }
}

}  // namespace tandem::cpu
