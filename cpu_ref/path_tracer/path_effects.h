// The rarer effects of the path tracer: media, motion, textures, conductors and rough glass, nested bodies. Included by
// path_tracer.h alone; only the general variant has them.
#pragma once

#include "cpu_ref/path_tracer/path_tracer.h"

namespace tandem::cpu {

// What a vertex does with light from a direction: f cos is colour times transfer; density is that of scattering there.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
struct PathTracer<Real, effects, Recorder, Shade>::Response {
    Vec3<S> colour;
    S transfer, density;
};

template <class Real>
[[nodiscard]] glm::dvec3 vector_of_lane(const Vec3<Lanes<Real>>& a, int lane) {
    return {static_cast<double>(a.x[lane]), static_cast<double>(a.y[lane]), static_cast<double>(a.z[lane])};
}
template <class Real>
void set_lane(Vec3<Lanes<Real>>& a, int lane, const glm::dvec3& value) {
    a.x.v[lane] = static_cast<Real>(value.x);
    a.y.v[lane] = static_cast<Real>(value.y);
    a.z.v[lane] = static_cast<Real>(value.z);
}

// Section 10: weights the throughput by the medium on the way. Returns which paths scatter there, before their hits.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
Mask<Real> PathTracer<Real, effects, Recorder, Shade>::cross_media(
    Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit, M active) const {
    at.more.in_medium = M{};
    at.more.medium_distance = V(Real(0));
    at.more.anisotropy = S(Shade(0));
    at.more.outside_index = S(Shade(1));
    if (!on(Effect::medium_absorption)) return at.more.in_medium;
    const I medium = load_ints<Real>(&paths_.interiors.medium[first]);
    const M within = active & !(medium == I(U{no_index}));
    if (none(within)) return at.more.in_medium;
    const RandomLanes<Real> m = numbers<Real>(
        at.id, at.number * I(U{dimension::blocks_per_vertex}) + I(U{dimension::first_vertex + medium_of_vertex}));
    Vec3<S> weight{S(Shade(1)), S(Shade(1)), S(Shade(1))};
    unsigned scattered = 0;
    for_each_lane(within, [&](int lane) {
        const MediumForm& form = tables_.media[medium[lane]];
        const double lead = static_cast<double>(paths_.interiors.lead[first + static_cast<std::uint32_t>(lane)]);
        const double end = has_lane(hit.found, lane) ? static_cast<double>(hit.t[lane]) : tables_.settings.ray_max;
        const glm::dvec3 direction = vector_of_lane(ray.direction, lane);
        const MediumForm::Step step = form.advance({vector_of_lane(ray.origin, lane) - lead * direction, direction},
            std::max(0.0, end + lead), static_cast<double>(m[0][lane]), static_cast<double>(m[1][lane]));
        set_lane(weight, lane, step.weight);
        if (!step.scattered) return;
        scattered |= 1u << lane;
        at.more.medium_distance.v[lane] = static_cast<Real>(step.t - lead);
        at.more.anisotropy.v[lane] = static_cast<Shade>(form.anisotropy());
    });
    at.throughput = at.throughput * weight;
    at.more.in_medium = M::from_bits(scattered);
    return at.more.in_medium;
}

// Section 5.4: facing and cosine by the shading normal.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::apply_shading_normals(Vertex& at, M lanes) const {
    const Vec3<V> at_rest = at.surface.point - at.more.shift;
    for_each_lane(lanes, [&](int lane) {
        const std::optional<glm::dvec3> normal =
            tables_.shading_normals.at(static_cast<std::uint32_t>(at.surface.primitive[lane]),
                vector_of_lane(at_rest, lane), vector_of_lane(at.surface.normal, lane));
        if (!normal) return;
        const glm::dvec3 facing = has_lane(at.front, lane) ? *normal : -*normal;
        const double cosine = -glm::dot(vector_of_lane(at.direction, lane), facing);
        if (!(cosine > 0.0)) return;
        set_lane(at.facing, lane, facing);
        at.cosine.v[lane] = static_cast<Shade>(std::min(1.0, cosine));
    });
}

// Whether a direction is above both normals or above neither (section 5.4).
template <class Real, std::uint64_t effects, class Recorder, class Shade>
Mask<Shade> PathTracer<Real, effects, Recorder, Shade>::on_one_side(const Vertex& at, const Vec3<S>& direction) const {
    const S zero(Shade(0));
    const ShadeMask above = dot(direction, shaded(at.facing)) > zero;
    const ShadeMask outside = dot(direction, shaded(surface_side(at))) > zero;
    if (planted(PlantedBug::shading_guard_dropped)) return above | !above;
    return (above & outside) | !(above | outside);
}

// Surface and motion.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::find_surface(
    Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit) const {
    at.more.shift = Vec3<V>{V(Real(0)), V(Real(0)), V(Real(0))};
    if constexpr (moving) {
        if (tables_.moves) {
            at.more.shift = tables_.motion[tables_.faces.entity[row_of(tables_, hit.face)]] *
                            load<Real>(&paths_.motion.time[first]);
            if (tables_.meshes) at.more.shift = select(is_placed(tables_, hit.face), Vec3<V>{}, at.more.shift);
            at.surface = surface_in_motion(tables_, ray, hit, at.more.shift);
            return;
        }
    }
    at.surface = surface_at(tables_, ray, hit);
}

// Textures, bodies, and vertices in media, which look like points of a surface that faces the ray.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::find_vertex(
    Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit) const {
    if constexpr (has(Effect::shading_normals))
        if (on(Effect::shading_normals)) apply_shading_normals(at, hit.found);
    if constexpr (textured) {
        const M lanes = hit.found & has_bit(at.bits, U{material_bits::textured});
        if (any(lanes)) apply_textures(at, hit, lanes);
    }
    if constexpr (has(Effect::interiors)) {
        const M lanes = hit.found & has_bit(at.bits, U{material_bits::tracked});
        if (any(lanes)) meet_interfaces(at, first, lanes);
    }
    const M in_medium = at.more.in_medium;
    if (none(in_medium)) return;
    const V zero(Real(0));
    const S one(Shade(1));
    at.surface.point = select(in_medium, along(ray.origin, at.more.medium_distance, ray.direction), at.surface.point);
    at.surface.normal = select(in_medium, -at.direction, at.surface.normal);
    at.surface.error_bound = select(in_medium, zero, at.surface.error_bound);
    at.surface.primitive = select(in_medium, I(U{no_primitive}), at.surface.primitive);
    at.facing = select(in_medium, -at.direction, at.facing);
    at.front = at.front | in_medium;
    at.cosine = select(shaded(in_medium), one, at.cosine);
    at.bits = select(in_medium, I(U{material_bits::medium}), at.bits);
    at.colour = select(shaded(in_medium), Vec3<S>{one, one, one}, at.colour);
}

template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::apply_textures(Vertex& at, const Hit<Real>& hit, M lanes) const {
    const Vec3<V> at_rest = at.surface.point - at.more.shift;
    for_each_lane(lanes, [&](int lane) {
        const auto primitive = static_cast<std::uint32_t>(at.surface.primitive[lane]);
        const std::uint32_t face = face_within(tables_, primitive, static_cast<std::uint32_t>(hit.face[lane]));
        set_lane(at.colour, lane, tables_.textures.colour(primitive, face, vector_of_lane(at_rest, lane)));
    });
}

// f cos and the density of scattering, of vertices that receive light.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
typename PathTracer<Real, effects, Recorder, Shade>::Response PathTracer<Real, effects, Recorder, Shade>::respond(
    const Vertex& at, const Vec3<S>& direction, S cosine, ShadeMask lanes) const {
    using W = UnsignedOf<Shade>;
    const S diffuse = cosine * S(static_cast<Shade>(inverse_pi));
    Response response{at.colour, diffuse, diffuse};
    if constexpr (has(Effect::rough_conductor)) {
        const ShadeMask conductor = lanes & has_bit(shaded(at.bits), W{material_bits::rough_conductor});
        if (any(conductor)) {
            const Frame<S> frame = frame_about(shaded(at.facing));
            const ShadeInts material = shaded(at.surface.material);
            const Reflection<S> reflection = ggx_reflection(frame.to_local(-shaded(at.direction)),
                frame.to_local(direction), shading_.materials.roughness_squared[material]);
            response.colour = select(conductor, reflectance(material, reflection.cosine), response.colour);
            response.transfer = select(conductor, reflection.transfer, response.transfer);
            response.density = select(conductor, reflection.density, response.density);
        }
    }
    if constexpr (has(Effect::rough_diffuse)) {
        const ShadeMask rough =
            lanes & has_bit(shaded(at.bits), W{material_bits::of_kind(MaterialKind::rough_diffuse)});
        if (any(rough)) {
            const S factor = rough_diffuse_factor(shaded(at.facing), shaded(at.direction), direction,
                shading_.materials.roughness_squared[shaded(at.surface.material)]);
            response.transfer = select(rough, diffuse * factor, response.transfer);
        }
    }
    const ShadeMask in_medium = shaded(at.more.in_medium);
    if (any(lanes & in_medium)) {
        const S phase = phase_density(shaded(at.direction), direction, at.more.anisotropy);
        response.transfer = select(in_medium, phase, response.transfer);
        response.density = select(in_medium, phase, response.density);
    }
    return response;
}

template <class Real, std::uint64_t effects, class Recorder, class Shade>
Vec3<Lanes<Shade>> PathTracer<Real, effects, Recorder, Shade>::reflectance(ShadeInts material, S cosine) const {
    const Vec3<S> eta = shading_.materials.eta[material], k = shading_.materials.k[material];
    return {conductor_reflectance(cosine, eta.x, k.x), conductor_reflectance(cosine, eta.y, k.y),
        conductor_reflectance(cosine, eta.z, k.z)};
}

// T over `distance` of the medium that the paths are in.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
Vec3<Lanes<Shade>> PathTracer<Real, effects, Recorder, Shade>::transmittance(
    std::uint32_t first, const Vec3<V>& origin, const Vec3<V>& direction, V distance, M lanes) const {
    Vec3<S> result{S(Shade(1)), S(Shade(1)), S(Shade(1))};
    if (!on(Effect::medium_absorption) || planted(PlantedBug::medium_shadow_ignored)) return result;
    const I medium = load_ints<Real>(&paths_.interiors.medium[first]);
    for_each_lane(lanes & !(medium == I(U{no_index})), [&](int lane) {
        set_lane(result, lane,
            tables_.media[medium[lane]].transmittance(
                {vector_of_lane(origin, lane), vector_of_lane(direction, lane)}, static_cast<double>(distance[lane])));
    });
    return result;
}

// Section 7.8: straight on.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::pass_boundary(
    const Vertex& at, ShadeMask lanes, Outcome& outcome) const {
    using W = UnsignedOf<Shade>;
    const ShadeMask boundary = lanes & has_bit(shaded(at.bits), W{material_bits::boundary});
    if (none(boundary)) return;
    const S one(Shade(1));
    outcome.direction = select(boundary, shaded(at.direction), outcome.direction);
    outcome.absorbed = select(boundary, Vec3<S>{one, one, one}, outcome.absorbed);
}

// Section 10: by the phase function. Absorption has been weighed on the way (cross_media).
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::scatter_in_medium(
    const Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const {
    using W = UnsignedOf<Shade>;
    const ShadeMask medium = lanes & has_bit(shaded(at.bits), W{material_bits::medium});
    if (none(medium)) return;
    const S one(Shade(1));
    const Vec3<S> arriving = shaded(at.direction), w = sample_phase(arriving, at.more.anisotropy, u[0], u[1]);
    outcome.direction = select(medium, w, outcome.direction);
    outcome.absorbed = select(medium, Vec3<S>{one, one, one}, outcome.absorbed);
    outcome.density = select(medium, phase_density(arriving, w, at.more.anisotropy), outcome.density);
}

// Section 7.6: smooth and rough conductors.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::reflect_on_conductor(
    const Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const {
    using W = UnsignedOf<Shade>;
    const Vec3<S> arriving = shaded(at.direction), facing = shaded(at.facing);
    const ShadeInts bits = shaded(at.bits), material = shaded(at.surface.material);
    const ShadeMask smooth = lanes & has_bit(bits, W{material_bits::smooth_conductor});
    if (any(smooth)) {
        const Vec3<S> mirrored = unit(along(arriving, S(at.cosine + at.cosine), facing));
        outcome.direction = select(smooth, mirrored, outcome.direction);
        outcome.absorbed = select(smooth, reflectance(material, at.cosine), outcome.absorbed);
    }
    const ShadeMask rough = lanes & has_bit(bits, W{material_bits::rough_conductor});
    if (any(rough)) {
        const Microfaceted<Shade> scattered =
            scatter_conductor(arriving, facing, shading_.materials.roughness_squared[material], u);
        outcome.direction = select(rough, scattered.direction, outcome.direction);
        outcome.absorbed = select(rough, reflectance(material, scattered.cosine) * scattered.weight, outcome.absorbed);
        outcome.density = select(rough, scattered.density, outcome.density);
        outcome.alive = outcome.alive & ((!rough) | scattered.alive);
    }
}

// Section 7.9.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::scatter_rough_diffuse(
    const Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const {
    using W = UnsignedOf<Shade>;
    const ShadeMask rough = lanes & has_bit(shaded(at.bits), W{material_bits::of_kind(MaterialKind::rough_diffuse)});
    if (none(rough)) return;
    const Vec3<S> facing = shaded(at.facing), w = scatter_diffuse<Shade>(facing, u);
    const S density = sqrt(S(S(Shade(1)) - u[0])) * S(static_cast<Shade>(inverse_pi));
    outcome.direction = select(rough, w, outcome.direction);
    outcome.density = select(rough, density, outcome.density);
    const S factor = rough_diffuse_factor(
        facing, shaded(at.direction), w, shading_.materials.roughness_squared[shaded(at.surface.material)]);
    if (!planted(PlantedBug::rough_diffuse_unweighted))
        outcome.absorbed = select(rough, outcome.absorbed * factor, outcome.absorbed);
}

// Section 7.7.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::scatter_on_rough_glass(
    const Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const {
    using W = UnsignedOf<Shade>;
    const ShadeInts bits = shaded(at.bits), material = shaded(at.surface.material);
    const ShadeMask glass = lanes & has_bit(bits, W{material_bits::rough_translucent});
    if (none(glass)) return;
    const S eta = relative_index(shading_, material, shaded(at.front), &at.more.outside_index);
    const Microfaceted<Shade> scattered = scatter_rough_translucent(shaded(at.direction), shaded(at.facing),
        shading_.materials.roughness_squared[material], eta, has_bit(bits, W{material_bits::schlick}), u);
    outcome.direction = select(glass, scattered.direction, outcome.direction);
    outcome.absorbed = select(glass, outcome.absorbed * scattered.weight, outcome.absorbed);
    outcome.alive = outcome.alive & ((!glass) | scattered.alive);
}

// The materials that the lean variants lack, and media.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::scatter_specially(
    Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const {
    if (none(lanes)) return;
    pass_boundary(at, lanes, outcome);
    scatter_in_medium(at, lanes, u, outcome);
    reflect_on_conductor(at, lanes, u, outcome);
    scatter_rough_diffuse(at, lanes, u, outcome);
    scatter_on_rough_glass(at, lanes, u, outcome);
}

}  // namespace tandem::cpu
