// The estimators of MODEL.md section 9 over a batch of samples. A pool of paths, each a lane of some packet, advances
// one vertex at a time. New camera rays replace finished paths, so that packets stay full. The path tracer is compiled
// for sets of effects (variants.h): an effect outside the set has no code and no state. Paths begin and end in
// path_pool.h. The light that they meet is added in path_lights.h, and rarer effects are in path_effects.h.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "cpu_ref/path_tracer/arithmetic/mixed.h"
#include "cpu_ref/path_tracer/camera.h"
#include "cpu_ref/path_tracer/geometry/accelerator.h"
#include "cpu_ref/path_tracer/light/distant_lights.h"
#include "cpu_ref/path_tracer/material/phase.h"
#include "cpu_ref/path_tracer/material/scattering.h"
#include "cpu_ref/path_tracer/path_recorder.h"

namespace tandem::cpu {

// Samples [first_sample, first_sample + sample_count) of pixels [first_pixel, first_pixel + pixel_count), or of the
// listed pixels. All samples are in one block of 64, so that their upper 32 bits agree.
struct Batch {
    std::uint32_t first_pixel = 0, pixel_count = 0;
    std::uint64_t first_sample = 0;
    std::uint32_t sample_count = 0;
    std::span<const std::uint32_t> listed = {};  // empty: all
    [[nodiscard]] std::uint32_t pixel(std::uint32_t place) const { return listed.empty() ? place : listed[place]; }
    [[nodiscard]] std::uint32_t paths() const { return pixel_count * sample_count; }
};

// Not used by a variant: no state.
struct NoState {};

// Real: of what says where things are. Shade: of how they look.
template <class Real, std::uint64_t effects, class Recorder = NoRecorder, class Shade = Real>
class PathTracer {
public:
    PathTracer(const Tables<Real>& tables, const Tables<Shade>& shading, const Accelerator<Real>& accelerator)
        : tables_(tables),
          shading_(shading),
          accelerator_(accelerator),
          simulated_(tables.settings.effects.value_or(compiled)),
          samples_lights_(tables.settings.integrator != Integrator::path && tables.lights.count > 0),
          weighs_(tables.settings.mis && tables.settings.integrator != Integrator::whitted) {}

    // Bytes of the state of one path, between two vertices.
    static constexpr std::uint64_t bytes_per_path();
    // Bytes of all paths that are on their way at once.
    static constexpr std::uint64_t bytes_of_paths();

    [[nodiscard]] Recorder& recorder() { return recorder_; }

    // Writes the radiance of path (pixel - first_pixel) * sample_count + (sample - first_sample) to radiance[that].
    // Returns early, with `radiance` unfinished, once a stop is requested.
    void run(const Batch& batch, std::span<std::array<Real, 3>> radiance, const std::stop_token& stop) {
        batch_ = batch;
        radiance_ = radiance;
        next_path_ = 0;
        free_.clear();
        for (std::uint32_t slot = 0; slot < slot_count; ++slot) {
            free_.push_back(slot);
            paths_.vertex[slot] = idle;
        }
        for (std::uint32_t round = 0;; ++round) {
            refill();
            bool busy = false;
            for (std::uint32_t first = 0; first < slot_count; first += width) busy = advance(first) || busy;
            if (!busy && next_path_ == batch_.paths()) return;
            if (round % 64 == 63 && stop.stop_requested()) return;
        }
    }

private:
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    using I = Ints<Real>;
    using M = Mask<Real>;
    using S = Lanes<Shade>;
    using ShadeInts = Ints<Shade>;
    using ShadeMask = Mask<Shade>;
    static constexpr std::uint32_t width = lane_count<Real>;
    static constexpr std::uint32_t slot_count = 8 * width;
    static constexpr U idle = static_cast<U>(~U{0});

    static constexpr EffectSet compiled = EffectSet::from_bits(effects);
    static constexpr bool has(Effect effect) { return compiled.has(effect); }
    static constexpr bool moving = has(Effect::entity_motion) || has(Effect::camera_motion);
    static constexpr bool textured = has(Effect::checker) || has(Effect::noise) || has(Effect::image_texture);
    static constexpr bool in_media = has(Effect::medium_absorption);
    static constexpr bool distant_lights =
        has(Effect::point_lights) || has(Effect::suns) || has(Effect::sampled_background);
    // Rays that go on through a surface.
    static constexpr bool crossing = has(Effect::translucent) || has(Effect::boundary);
    static constexpr bool microfacets = has(Effect::rough_conductor) || has(Effect::rough_translucent);
    // Any effect beyond the lean variants.
    static constexpr bool general = moving || textured || in_media || distant_lights || microfacets ||
                                    has(Effect::smooth_conductor) || has(Effect::interiors) || has(Effect::boundary) ||
                                    has(Effect::direct_only) || has(Effect::background_image) ||
                                    has(Effect::shading_normals);
    // Compiled in, and simulated by this job.
    [[nodiscard]] TANDEM_INLINE bool on(Effect effect) const { return has(effect) && simulated_.has(effect); }

    template <class Element>
    using Slots = std::array<Element, slot_count>;
    // State of the paths, a slot each.
    struct Pool {
        alignas(64) std::array<Slots<Real>, 3> origin, direction, throughput, radiance;
        // Density of the last scattering direction; 0: not from a diffuse vertex. Negative: the ray goes on through a
        // surface, and starts by so much before it (section 5.2).
        alignas(64) Slots<Real> density;
        alignas(64) Slots<U> pixel, sample, vertex, primitive, inside, path;
        struct Motion {
            alignas(64) Slots<Real> time;
        };
        struct Crossing {
            alignas(64) Slots<U> face;  // that the ray has left
        };
        struct Interiors {
            alignas(64) Slots<U> medium, count;
            alignas(64) std::array<Slots<U>, most_interiors> material;
            // How far along the ray its origin lies from the surface that it left (section 5.2): media begin there.
            // Negative: before it.
            alignas(64) Slots<Real> lead;
        };
        // The lit side of the vertex that the ray left, for light trees (section 9.2, rule 39).
        struct Side {
            alignas(64) std::array<Slots<Real>, 3> normal;
        };
        [[no_unique_address]] std::conditional_t<moving, Motion, NoState> motion;
        [[no_unique_address]] std::conditional_t<crossing, Crossing, NoState> crossed;
        [[no_unique_address]] std::conditional_t<general, Interiors, NoState> interiors;
        [[no_unique_address]] std::conditional_t<general, Side, NoState> side;
    };

    static Vec3<V> load3(const std::array<Slots<Real>, 3>& from, std::uint32_t first) {
        return {load<Real>(&from[0][first]), load<Real>(&from[1][first]), load<Real>(&from[2][first])};
    }
    static void store3(std::array<Slots<Real>, 3>& to, std::uint32_t first, const Vec3<V>& value) {
        store<Real>(&to[0][first], value.x);
        store<Real>(&to[1][first], value.y);
        store<Real>(&to[2][first], value.z);
    }

    void refill();
    bool advance(std::uint32_t first);
    struct Vertex;
    template <class Geometric>
    TANDEM_INLINE static auto shaded(const Geometric& a) {
        return lanes_as<Shade>(a);
    }
    template <class Shaded>
    TANDEM_INLINE static auto geometric(const Shaded& a) {
        return lanes_as<Real>(a);
    }
    template <class X>
    [[nodiscard]] TANDEM_INLINE RandomLanes<X> numbers(const SampleId<X>& id, Ints<X> block) const;
    // Block `use` of the vertex.
    TANDEM_INLINE RandomLanes<Shade> shading_numbers(const Vertex& at, std::uint32_t use) const;
    [[nodiscard]] Vec3<S> background(const Vec3<V>& direction, std::uint32_t first, M lanes);
    [[nodiscard]] TANDEM_INLINE static Vec3<V> surface_side(const Vertex& at);
    void meet_vertex(Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit);
    [[nodiscard]] Hit<Real> closest_hit(std::uint32_t first, const Ray<V>& ray, M active) const;
    M meet(Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit, M found);
    void find_place(Vertex& at, std::uint32_t first, const Hit<Real>& hit, V projection);
    [[nodiscard]] V start_before(const Vertex& at, std::uint32_t first, M alive, M crossed, V side) const;
    void add_emission(Vertex& at, std::uint32_t first, const Hit<Real>& hit, const Ray<V>& ray);
    void add_direct_light(Vertex& at, M lanes, std::uint32_t first);
    template <class Sample>
    [[nodiscard]] M sees_sample(
        const Vertex& at, const Receiver<Real>& receiver, const Sample& sample, M lanes, V time);
    template <class Sample>
    void add_sample(Vertex& at, std::uint32_t first, const Vec3<V>& side, const Sample& sample, M lit);
    void scatter(Vertex& at, M lanes, std::uint32_t first);
    struct Outcome;
    [[nodiscard]] Outcome scatter_by_material(Vertex& at, ShadeMask all, const RandomLanes<Shade>& u) const;
    void spawn_ray(Vertex& at, std::uint32_t first, const Vec3<V>& direction, V density, M alive);
    void play_roulette(const Vertex& at, S number, Vec3<S>& throughput, ShadeMask& alive);
    void retire(std::uint32_t first, M ended);

    // path_effects.h
    [[nodiscard, gnu::noinline]] M cross_media(
        Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit, M active) const;
    void find_surface(Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit) const;
    [[gnu::noinline]] void find_vertex(Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit) const;
    [[gnu::noinline]] void apply_shading_normals(Vertex& at, M lanes) const;
    [[nodiscard, gnu::noinline]] ShadeMask on_one_side(const Vertex& at, const Vec3<S>& direction) const;
    [[gnu::noinline]] void apply_textures(Vertex& at, const Hit<Real>& hit, M lanes) const;
    [[gnu::noinline]] void meet_interfaces(Vertex& at, std::uint32_t first, M lanes) const;
    struct Response;
    [[nodiscard, gnu::noinline]] Response respond(
        const Vertex& at, const Vec3<S>& direction, S cosine, ShadeMask lanes) const;
    [[nodiscard]] Vec3<S> reflectance(ShadeInts material, S cosine) const;
    [[nodiscard, gnu::noinline]] Vec3<S> transmittance(
        std::uint32_t first, const Vec3<V>& origin, const Vec3<V>& direction, V distance, M lanes) const;
    [[gnu::noinline]] void scatter_specially(
        Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const;
    void pass_boundary(const Vertex& at, ShadeMask lanes, Outcome& outcome) const;
    void scatter_in_medium(const Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const;
    void reflect_on_conductor(const Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const;
    void scatter_rough_diffuse(const Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const;
    void scatter_on_rough_glass(const Vertex& at, ShadeMask lanes, const RandomLanes<Shade>& u, Outcome& outcome) const;
    [[gnu::noinline]] void change_interiors(Vertex& at, std::uint32_t first, M crossed, M& alive);
    [[gnu::noinline]] void undo_crossing(std::uint32_t first, M lanes);
    void store_interiors(std::uint32_t slot, const InteriorList& list);
    [[nodiscard]] InteriorList interior_list(std::uint32_t slot) const;

    // traced_path.cpp.in: for recorders that record.
    [[nodiscard]] static ShadeMask any_light(const Vec3<S>& throughput);
    struct SeenLight {  // as TracedLight
        Vec3<V> direction;
        Vec3<S> radiance;
        S density;
        Vec3<S> response, transmittance;
        S weight;
    };
    void record_aim(const Vec3<V>& direction, M lanes);
    void record_light(const SeenLight& light, const Vec3<S>& brought, M lit);
    template <class X>
    void record_at_hand(double TracedVertex::*figure, const X& value, M lanes);
    void record(const Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit, M missed, M active);
    [[nodiscard]] PathEnd end_of(const Vertex& at, int lane) const;

    const Tables<Real>& tables_;
    const Tables<Shade>& shading_;
    const Accelerator<Real>& accelerator_;
    const EffectSet simulated_;
    const bool samples_lights_;
    const bool weighs_;  // next events against scattering; else what is sampled is left to next events
    Batch batch_;
    std::span<std::array<Real, 3>> radiance_;
    std::uint32_t next_path_ = 0;
    std::vector<std::uint32_t> free_;
    Pool paths_{};
    [[no_unique_address]] Recorder recorder_;
};

// Everything about the vertices of one packet.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
struct PathTracer<Real, effects, Recorder, Shade>::Vertex {
    Surface<Real> surface;
    Vec3<V> direction, facing;  // incoming; shading normal on the side it comes from
    S cosine;
    M front;
    I bits, number;
    Vec3<S> colour, throughput, radiance;
    SampleId<Real> id;
    // For rays that started before a face and go on through it (section 5.2). It tells whether this hit is at that
    // face's place, and whether it is that face. `way` is the ray's way beyond it.
    struct Place {
        M same_place, same_face;
        V way;
        I face;
    };
    [[no_unique_address]] std::conditional_t<crossing, Place, NoState> place;
    struct More {
        M in_medium;
        V medium_distance;
        S anisotropy;
        S outside_index;
        Vec3<V> shift;  // of the entity at the path's time
    };
    [[no_unique_address]] std::conditional_t<general, More, NoState> more;
};

// What scattering makes of the paths of a packet. `absorbed` multiplies the throughput; 0 is the density of a specular
// direction.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
struct PathTracer<Real, effects, Recorder, Shade>::Outcome {
    Vec3<S> direction, absorbed;
    S density;
    ShadeMask alive;
};

template <class Real, std::uint64_t effects, class Recorder, class Shade>
template <class X>
TANDEM_INLINE RandomLanes<X> PathTracer<Real, effects, Recorder, Shade>::numbers(
    const SampleId<X>& id, Ints<X> block) const {
    RandomLanes<X> u = random_numbers<X>(tables_.settings, id, block);
    if constexpr (Recorder::records) {
        Lanes<X>& changed = u[recorder_.changed.number];
        const X step = std::ldexp(X(1), static_cast<int>(recorder_.changed.bit) - 32);
        for (int i = 0; i < lane_count<X>; ++i) {
            if (block.v[i] != recorder_.changed.block) continue;
            const bool set = std::fmod(changed.v[i], 2 * step) >= step;  // exact
            changed.v[i] += set ? -step : step;
        }
    }
    return u;
}

template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE RandomLanes<Shade> PathTracer<Real, effects, Recorder, Shade>::shading_numbers(
    const Vertex& at, std::uint32_t use) const {
    using W = UnsignedOf<Shade>;
    const SampleId<Shade> id{shaded(at.id.pixel), shaded(at.id.sample_low), shaded(at.id.sample_high)};
    return numbers<Shade>(id,
        shaded(at.number) * ShadeInts(W{dimension::blocks_per_vertex}) + ShadeInts(W{dimension::first_vertex} + use));
}

template <class Real, std::uint64_t effects, class Recorder, class Shade>
constexpr std::uint64_t PathTracer<Real, effects, Recorder, Shade>::bytes_per_path() {
    return sizeof(Pool) / slot_count;
}

template <class Real, std::uint64_t effects, class Recorder, class Shade>
constexpr std::uint64_t PathTracer<Real, effects, Recorder, Shade>::bytes_of_paths() {
    return sizeof(Pool);
}

// n_f, the surface's own normal on the side that the ray comes from (section 5.4).
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE Vec3<Lanes<Real>> PathTracer<Real, effects, Recorder, Shade>::surface_side(const Vertex& at) {
    if constexpr (has(Effect::shading_normals)) return select(at.front, at.surface.normal, -at.surface.normal);
    return at.facing;
}

// What the vertex is made of.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::meet_vertex(
    Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit) {
    if constexpr (general) {
        find_surface(at, first, ray, hit);
    } else {
        at.surface = surface_at(tables_, ray, hit);
    }
    const V projection = dot(at.direction, at.surface.normal);
    at.front = (at.surface.curved & !at.surface.left) | ((!at.surface.curved) & (projection < V(Real(0))));
    at.facing = select(at.front, at.surface.normal, -at.surface.normal);
    at.cosine = shaded(absolute(projection));
    at.bits = tables_.materials.bits[at.surface.material];
    at.colour = shading_.materials.colour[shaded(at.surface.material)];
    if constexpr (crossing) find_place(at, first, hit, projection);
    if constexpr (general) {
        find_vertex(at, first, ray, hit);
    } else {
        at.id = {load_ints<Real>(&paths_.pixel[first]), load_ints<Real>(&paths_.sample[first]),
            I(static_cast<U>(batch_.first_sample >> 32))};
    }
}

template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE Hit<Real> PathTracer<Real, effects, Recorder, Shade>::closest_hit(
    std::uint32_t first, const Ray<V>& ray, M active) const {
    const Departure<V> departure{
        load_ints<Real>(&paths_.primitive[first]), has_bit(load_ints<Real>(&paths_.inside[first]), U{1})};
    if constexpr (moving)
        return accelerator_.closest(ray, departure, active, load<Real>(&paths_.motion.time[first]));
    else
        return accelerator_.closest(ray, departure, active);
}

// The events at the vertices of `found` paths, up to the spawned ray. Returns the paths that go on.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE Mask<Real> PathTracer<Real, effects, Recorder, Shade>::meet(
    Vertex& at, std::uint32_t first, const Ray<V>& ray, const Hit<Real>& hit, M found) {
    meet_vertex(at, first, ray, hit);
    add_emission(at, first, hit, ray);
    constexpr unsigned scattering =
        general ? material_bits::scatters : material_bits::diffuse | material_bits::specular;
    const M scatters = has_bit(at.bits, U{scattering}) &
                       (at.number < I(static_cast<U>(std::min<std::uint32_t>(tables_.settings.bounces, 0x3FFFFFFEu)))) &
                       found;
    if (none(scatters)) return M{};
    constexpr unsigned receiving = general ? material_bits::receives : material_bits::diffuse;
    if constexpr (has(Effect::light_sampling))
        if (samples_lights_) add_direct_light(at, scatters & has_bit(at.bits, U{receiving}), first);
    M goes_on = scatters;
    if constexpr (has(Effect::direct_only))
        if (tables_.settings.integrator == Integrator::whitted) goes_on = goes_on & !has_bit(at.bits, U{receiving});
    scatter(at, goes_on, first);
    return scatters & (load_ints<Real>(&paths_.vertex[first]) == at.number + I(U{1}));
}

// One pass of the loop of section 9 for the paths in slots [first, first + width). False if all of them are idle.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
bool PathTracer<Real, effects, Recorder, Shade>::advance(std::uint32_t first) {
    Vertex at;
    at.number = load_ints<Real>(&paths_.vertex[first]);
    const M active = !(at.number == I(idle));
    if (none(active)) return false;
    at.direction = load3(paths_.direction, first);
    const Ray<V> ray = make_ray(load3(paths_.origin, first), at.direction, V(tables_.t_min), V(tables_.limit));
    Hit<Real> hit = closest_hit(first, ray, active);
    at.throughput = shaded(load3(paths_.throughput, first));
    at.radiance = shaded(load3(paths_.radiance, first));
    M missed = active & !hit.found, found = hit.found;
    if constexpr (general) {
        at.id = {load_ints<Real>(&paths_.pixel[first]), load_ints<Real>(&paths_.sample[first]),
            I(static_cast<U>(batch_.first_sample >> 32))};
        const M in_medium = cross_media(at, first, ray, hit, active);
        missed = missed & !in_medium;
        hit.found = hit.found & !in_medium;
        found = hit.found | in_medium;
    }
    if (planted(PlantedBug::background_late_missing)) missed = missed & !(at.number == I(U{2}));
    if (any(missed))
        at.radiance =
            select(shaded(missed), at.radiance + at.throughput * background(at.direction, first, missed), at.radiance);
    M ended = active;
    if (any(found)) ended = active & !meet(at, first, ray, hit, found);
    store3(paths_.radiance, first, geometric(at.radiance));
    if constexpr (Recorder::records) {
        record(at, first, ray, hit, missed, active);
        if (recorder_.first_only) ended = active;
    }
    if (any(ended)) retire(first, ended);
    return true;
}

// Ends paths without throughput, and those that roulette chooses (section 9.3).
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::play_roulette(
    const Vertex& at, S number, Vec3<S>& throughput, ShadeMask& alive) {
    const S zero(Shade(0)), one(Shade(1));
    const S strongest = greatest(greatest(throughput.x, throughput.y), throughput.z);
    alive = alive & !(strongest == zero);
    if (tables_.settings.roulette_start != no_roulette) {
        // Event number k + 1 is the vertex number plus one.
        const ShadeMask played = shaded(!(at.number + I(U{1}) < I(U{tables_.settings.roulette_start})));
        const S survival = least(one, strongest);
        if constexpr (Recorder::records)
            record_at_hand(&TracedVertex::survival, survival, geometric(ShadeMask(played & alive)));
        alive = alive & ((!played) | (number < survival));
        if (!planted(PlantedBug::roulette_not_divided))
            throughput = select(played, throughput * S(one / survival), throughput);
    }
}

// The direction, by the vertex's material.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE typename PathTracer<Real, effects, Recorder, Shade>::Outcome
PathTracer<Real, effects, Recorder, Shade>::scatter_by_material(
    Vertex& at, ShadeMask all, const RandomLanes<Shade>& u) const {
    using W = UnsignedOf<Shade>;
    const S zero(Shade(0)), one(Shade(1));
    const ShadeInts bits = shaded(at.bits), material = shaded(at.surface.material);
    const Vec3<S> facing = shaded(at.facing);
    const ShadeMask diffuse = has_bit(bits, W{material_bits::diffuse}) & all;
    Vec3<S> turned = facing;
    S density = zero;
    ShadeMask goes_on = all;
    if (any(diffuse)) {
        turned = scatter_diffuse<Shade>(facing, u);
        density = select(diffuse, sqrt(S(one - u[0])) * S(static_cast<Shade>(inverse_pi)), zero);
    }
    ShadeMask specular = all & !diffuse;
    if constexpr (general)
        specular =
            specular & has_bit(bits, W{material_bits::specular}) & !has_bit(bits, W{material_bits::rough_translucent});
    if (any(specular)) {
        const S* outside = nullptr;
        if constexpr (general) outside = &at.more.outside_index;
        const Scattered<Shade> scattered = scatter_specular(shading_, material, bits, specular, shaded(at.direction),
            has(Effect::shading_normals) ? facing : shaded(at.surface.normal), facing, at.cosine, shaded(at.front), u,
            outside);
        turned = select(diffuse, turned, scattered.direction);
        goes_on = (all & !specular) | scattered.alive;
    }
    const Vec3<S> absorbed = tables_.any_specular ? absorption(shading_, material, bits, at.colour) : at.colour;
    Outcome outcome{turned, absorbed, density, goes_on};
    if constexpr (general) scatter_specially(at, all & !(diffuse | specular), u, outcome);
    return outcome;
}

// Scattering, absorption and roulette; stores the state of paths that go on, with the next vertex number.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::scatter(Vertex& at, M lanes, std::uint32_t first) {
    const RandomLanes<Shade> u = shading_numbers(at, dimension::scatter);
    const ShadeMask all = shaded(lanes);
    Outcome outcome = scatter_by_material(at, all, u);
    if constexpr (has(Effect::shading_normals))
        if (on(Effect::shading_normals)) outcome.alive = outcome.alive & on_one_side(at, outcome.direction);
    if constexpr (crossing) {
        const ShadeMask passed = shaded(at.place.same_face) & all;
        if (any(passed)) {
            const S one(Shade(1));
            outcome.direction = select(passed, shaded(at.direction), outcome.direction);
            outcome.absorbed = select(passed, Vec3<S>{one, one, one}, outcome.absorbed);
            outcome.alive = outcome.alive | passed;
        }
    }
    Vec3<S> throughput = at.throughput * outcome.absorbed;
    if constexpr (Recorder::records)
        recorder_.scattered = geometric(ShadeMask(outcome.alive & any_light(throughput))).to_bits();
    play_roulette(at, u[3], throughput, outcome.alive);
    const M alive = geometric(outcome.alive);
    if (none(alive)) return;
    spawn_ray(at, first, geometric(outcome.direction), geometric(outcome.density), alive);
    store3(paths_.throughput, first, geometric(throughput));
    if (planted(PlantedBug::throughput_half))
        for (Slots<Real>& channel : paths_.throughput)
            for (std::uint32_t i = first; i < first + lane_count<Real>; ++i)
                channel[i] = static_cast<Real>(in_half(static_cast<double>(channel[i])));
}

// Stores the rays of the paths that go on, and what the next vertex asks of this one. Ends those in too many bodies.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
TANDEM_INLINE void PathTracer<Real, effects, Recorder, Shade>::spawn_ray(
    Vertex& at, std::uint32_t first, const Vec3<V>& direction, V density, M alive) {
    const V side = dot(direction, at.surface.normal);
    M inside = side < V(Real(0));
    if constexpr (general) inside = inside & !at.more.in_medium;
    Vec3<V> origin = leaving_origin(tables_, at.surface, select(inside, -at.surface.normal, at.surface.normal));
    if constexpr (crossing) {
        const M crossed = alive & ((at.front & inside) | !(at.front | inside));
        const V start = start_before(at, first, alive, crossed, side);
        const M before = start > V(Real(0));
        if (any(before)) {
            origin = select(before, along(at.surface.point, -start, direction), origin);
            density = select(before, -start, density);
            store_ints<Real>(&paths_.crossed.face[first], at.place.face);
        }
        if constexpr (general) {
            store<Real>(&paths_.interiors.lead[first], select(before, -start, at.surface.error_bound * absolute(side)));
            const M tracked = crossed & has_bit(at.bits, U{material_bits::tracked}) & !at.place.same_face;
            if (any(tracked)) change_interiors(at, first, tracked, alive);
        }
    }
    store3(paths_.origin, first, origin);
    store3(paths_.direction, first, direction);
    if constexpr (general)
        if (tables_.lights.tree.count > 0) store3(paths_.side.normal, first, surface_side(at));
    store<Real>(&paths_.density[first], density);
    store_ints<Real>(&paths_.primitive[first], at.surface.primitive);
    store_ints<Real>(&paths_.inside[first], select(inside, I(U{1}), I(U{0})));
    store_ints<Real>(&paths_.vertex[first], select(alive, at.number + I(U{1}), at.number));
}

}  // namespace tandem::cpu

#include "cpu_ref/path_tracer/path_crossing.h"
#include "cpu_ref/path_tracer/path_effects.h"
#include "cpu_ref/path_tracer/path_lights.h"
#include "cpu_ref/path_tracer/path_pool.h"
