// The estimators of MODEL.md section 9 over a batch of samples: a pool of paths, each a lane of some packet, advanced
// one vertex at a time; finished ones are replaced by new camera rays, so that packets stay full.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "cpu_ref/accelerator.h"
#include "cpu_ref/light_sampling.h"
#include "cpu_ref/scattering.h"

namespace tandem::cpu {

// Samples [first_sample, first_sample + sample_count) of pixels [first_pixel, first_pixel + pixel_count), all samples
// in one block of 64, so that their upper 32 bits agree.
struct Batch {
    std::uint32_t first_pixel = 0, pixel_count = 0;
    std::uint64_t first_sample = 0;
    std::uint32_t sample_count = 0;
    [[nodiscard]] std::uint32_t paths() const { return pixel_count * sample_count; }
};

// Camera ray of section 4; a zero-length one comes out with direction 0.
template <class Real>
struct CameraRay {
    Vec3<Lanes<Real>> origin, direction;
};
template <class Real>
TANDEM_INLINE CameraRay<Real> camera_ray(const Tables<Real>& tables, const SampleId<Real>& id) {
    using V = Lanes<Real>;
    using U = UnsignedOf<Real>;
    const CameraForm<Real>& camera = tables.camera;
    const RandomLanes<Real> u = random_numbers(tables.settings.seed, id, Ints<Real>(U{dimension::film_and_lens}));
    Ints<Real> x, y;
    for (int i = 0; i < lane_count<Real>; ++i) {
        const auto pixel = static_cast<std::uint32_t>(id.pixel.v[i]);
        y.v[i] = pixel / tables.settings.width;
        x.v[i] = pixel % tables.settings.width;
    }
    const V shift(Real(tables.planted(PlantedBug::half_pixel_shift) ? 0.5 : 0.0)), one(Real(1)), zero(Real(0));
    const V sx = to_real(x) + u[0] - shift, sy = to_real(y) + u[1] - shift;
    const V h = V(camera.half_width) * (V(camera.film_scale_x) * sx - one);
    const V v = V(camera.half_height) * (one - V(camera.film_scale_y) * sy);
    const Vec3<V> right = splat<V>(camera.right), up = splat<V>(camera.up);
    Vec3<V> q = along(along(splat<V>(camera.forward), h, right), v, up);
    Vec3<V> origin = splat<V>(camera.position);
    if (camera.lens_radius > Real(0)) {
        const auto [a, b] = sample_disc(u[2], u[3]);
        const Vec3<V> lens = (right * a + up * b) * V(camera.lens_radius);
        origin = origin + lens;
        q = q * V(camera.focus_distance) - lens;
    }
    const V square = dot(q, q);
    const Mask<Real> real_ray = square > zero;
    return {origin, select(real_ray, q * V(one / sqrt(square)), Vec3<V>{zero, zero, zero})};
}

template <class Real, bool next_event>
class PathTracer {
public:
    PathTracer(const Tables<Real>& tables, const Accelerator<Real>& accelerator)
        : tables_(tables), accelerator_(accelerator) {}

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
    static constexpr std::uint32_t width = lane_count<Real>;
    static constexpr std::uint32_t slot_count = 8 * width;
    static constexpr U idle = static_cast<U>(~U{0});

    template <class Element>
    using Slots = std::array<Element, slot_count>;
    // State of the paths, a slot each.
    struct Pool {
        alignas(64) std::array<Slots<Real>, 3> origin, direction, throughput, radiance;
        alignas(64) Slots<Real> density;  // of the last scattering direction; 0: not from a diffuse vertex
        alignas(64) Slots<U> pixel, sample, vertex, primitive, inside, path;
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
    [[nodiscard]] Vec3<V> background(const Vec3<V>& direction) const;
    struct Vertex;
    void add_emission(Vertex& at, std::uint32_t first, const Hit<Real>& hit, const Ray<V>& ray) const;
    void add_direct_light(Vertex& at, M lanes) const;
    void scatter(Vertex& at, M lanes, std::uint32_t first);
    void retire(std::uint32_t first, M ended);

    const Tables<Real>& tables_;
    const Accelerator<Real>& accelerator_;
    Batch batch_;
    std::span<std::array<Real, 3>> radiance_;
    std::uint32_t next_path_ = 0;
    std::vector<std::uint32_t> free_;
    Pool paths_{};
};

// Everything about the vertices of one packet.
template <class Real, bool next_event>
struct PathTracer<Real, next_event>::Vertex {
    Surface<Real> surface;
    Vec3<V> direction, facing;  // incoming; normal of the side it comes from
    V cosine;
    M front;
    I bits, number;
    Vec3<V> colour, throughput, radiance;
    SampleId<Real> id;
};

template <class Real, bool next_event>
void PathTracer<Real, next_event>::refill() {
    while (!free_.empty() && next_path_ < batch_.paths()) {
        const std::uint32_t count =
            std::min({width, static_cast<std::uint32_t>(free_.size()), batch_.paths() - next_path_});
        SampleId<Real> id;
        id.sample_high = I(static_cast<U>(batch_.first_sample >> 32));
        for (std::uint32_t i = 0; i < width; ++i) {
            const std::uint32_t path = next_path_ + std::min(i, count - 1);
            id.pixel.v[i] = batch_.first_pixel + path / batch_.sample_count;
            id.sample_low.v[i] = static_cast<std::uint32_t>(batch_.first_sample) + path % batch_.sample_count;
        }
        const CameraRay<Real> ray = camera_ray(tables_, id);
        const std::array<V, 6> values{
            ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x, ray.direction.y, ray.direction.z};
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::uint32_t slot = free_.back();
            free_.pop_back();
            for (std::size_t c = 0; c < 3; ++c) {
                paths_.origin[c][slot] = values[c].v[i];
                paths_.direction[c][slot] = values[c + 3].v[i];
                paths_.throughput[c][slot] = Real(1);
                paths_.radiance[c][slot] = Real(0);
            }
            paths_.density[slot] = Real(0);
            paths_.pixel[slot] = id.pixel.v[i];
            paths_.sample[slot] = id.sample_low.v[i];
            paths_.vertex[slot] = 0;
            paths_.primitive[slot] = no_primitive;
            paths_.inside[slot] = 0;
            paths_.path[slot] = next_path_ + i;
        }
        next_path_ += count;
    }
}

template <class Real, bool next_event>
void PathTracer<Real, next_event>::retire(std::uint32_t first, M ended) {
    for (unsigned left = ended.to_bits(); left != 0; left &= left - 1) {
        const std::uint32_t slot = first + static_cast<std::uint32_t>(std::countr_zero(left));
        std::array<Real, 3>& sum = radiance_[paths_.path[slot]];
        for (std::size_t c = 0; c < 3; ++c) sum[c] = paths_.radiance[c][slot];
        paths_.vertex[slot] = idle;
        free_.push_back(slot);
    }
}

// Section 8.
template <class Real, bool next_event>
Vec3<Lanes<Real>> PathTracer<Real, next_event>::background(const Vec3<V>& direction) const {
    const V a = V(Real(0.5)) * (direction.y + V(Real(1)));
    return splat<V>(tables_.background_down) * V(V(Real(1)) - a) + splat<V>(tables_.background_up) * a;
}

// One pass of the loop of section 9 for the paths in slots [first, first + width). False if all of them are idle.
template <class Real, bool next_event>
bool PathTracer<Real, next_event>::advance(std::uint32_t first) {
    Vertex at;
    at.number = load_ints<Real>(&paths_.vertex[first]);
    const M active = !(at.number == I(idle));
    if (none(active)) return false;
    at.direction = load3(paths_.direction, first);
    const Ray<V> ray = make_ray(load3(paths_.origin, first), at.direction, V(tables_.t_min), V(tables_.limit));
    const Departure<V> departure{
        load_ints<Real>(&paths_.primitive[first]), has_bit(load_ints<Real>(&paths_.inside[first]), U{1})};
    const Hit<Real> hit = accelerator_.closest(ray, departure, active);
    at.throughput = load3(paths_.throughput, first);
    at.radiance = load3(paths_.radiance, first);
    const M missed = active & !hit.found;
    if (any(missed)) at.radiance = select(missed, at.radiance + at.throughput * background(at.direction), at.radiance);
    M ended = missed;
    if (any(hit.found)) {
        at.surface = surface_at(tables_, ray, hit);
        const V projection = dot(at.direction, at.surface.normal), zero(Real(0));
        at.front = projection < zero;
        at.facing = select(at.front, at.surface.normal, -at.surface.normal);
        at.cosine = absolute(projection);
        at.bits = tables_.materials.bits[at.surface.material];
        at.id = {load_ints<Real>(&paths_.pixel[first]), load_ints<Real>(&paths_.sample[first]),
            I(static_cast<U>(batch_.first_sample >> 32))};
        at.colour = tables_.materials.colour[at.surface.material];
        add_emission(at, first, hit, ray);
        const M scatters =
            has_bit(at.bits, U{material_bits::diffuse | material_bits::specular}) &
            (at.number < I(static_cast<U>(std::min<std::uint32_t>(tables_.settings.bounces, 0x3FFFFFFEu)))) & hit.found;
        if (any(scatters)) {
            if constexpr (next_event)
                if (tables_.lights.count > 0)
                    add_direct_light(at, scatters & has_bit(at.bits, U{material_bits::diffuse}));
            scatter(at, scatters, first);
            ended = ended | !(load_ints<Real>(&paths_.vertex[first]) == at.number + I(U{1}));
            ended = (ended | !scatters) & active;
        } else {
            ended = active;
        }
    }
    store3(paths_.radiance, first, at.radiance);
    if (any(ended)) retire(first, ended);
    return true;
}

// Adds A L_e W_k.
template <class Real, bool next_event>
void PathTracer<Real, next_event>::add_emission(
    Vertex& at, std::uint32_t first, const Hit<Real>& hit, const Ray<V>& ray) const {
    const M emits = hit.found & has_bit(at.bits, U{material_bits::emits}) &
                    (at.front | has_bit(at.bits, U{material_bits::both_sides}));
    if (none(emits)) return;
    Vec3<V> light = tables_.materials.radiance[at.surface.material];
    const M translucent = has_bit(at.bits, U{material_bits::translucent});
    if (any(translucent & emits))
        light = select(translucent, light * tables_.materials.alpha[at.surface.material], light);
    if constexpr (next_event) {
        const V zero(Real(0)), one(Real(1)), scattered = load<Real>(&paths_.density[first]);
        const V sampled = light_density(tables_, ray.origin, load_ints<Real>(&paths_.primitive[first]),
            has_bit(load_ints<Real>(&paths_.inside[first]), U{1}), hit, at.surface, at.direction);
        const M weighted = emits & (scattered > zero) & (sampled > zero);
        if (any(weighted)) light = light * select(weighted, power_heuristic(scattered, sampled), one);
    }
    at.radiance = select(emits, at.radiance + at.throughput * light, at.radiance);
}

// Next event estimation of section 9.2 at diffuse vertices.
template <class Real, bool next_event>
void PathTracer<Real, next_event>::add_direct_light(Vertex& at, M lanes) const {
    if (none(lanes)) return;
    const V zero(Real(0));
    const RandomLanes<Real> v = random_numbers(tables_.settings.seed, at.id,
        at.number * I(U{dimension::blocks_per_vertex}) + I(U{dimension::first_vertex + dimension::light}));
    const Receiver<Real> receiver{
        along(at.surface.point, at.surface.error_bound, at.facing), at.facing, at.surface.primitive, !at.front};
    const LightSample<Real> sample = sample_light(tables_, receiver, v);
    const V cosine = dot(at.facing, sample.direction);
    const M reachable = lanes & sample.usable & (cosine > zero) & (sample.distance >= V(tables_.t_min)) &
                        (sample.distance < V(tables_.limit));
    if (none(reachable)) return;
    const V limit = least(V(tables_.limit), sample.reach);
    const Ray<V> shadow = make_ray(receiver.point, sample.direction, V(tables_.t_min), limit);
    I departed = at.surface.primitive;
    if (tables_.planted(PlantedBug::self_hit_not_excluded)) departed = I(U{no_primitive});
    const M lit = reachable & !accelerator_.occluded(shadow, {departed, receiver.inside}, sample.primitive, reachable);
    if (none(lit)) return;
    const V scattered = cosine * V(static_cast<Real>(inverse_pi));  // f's C/pi times cos, and the density of scattering
    V weight = power_heuristic(sample.density, scattered);
    if (tables_.planted(PlantedBug::mis_weights_unequal) && tables_.lights.count > 1) weight = weight * V(Real(0.5));
    V transfer = scattered;
    if (tables_.planted(PlantedBug::cosine_dropped)) transfer = V(static_cast<Real>(inverse_pi));
    if (tables_.planted(PlantedBug::inverse_pi_dropped)) transfer = cosine;
    const Vec3<V> light = tables_.materials.radiance[sample.material] * V(transfer / sample.density * weight);
    at.radiance = select(lit, at.radiance + at.throughput * at.colour * light, at.radiance);
}

// Scattering, absorption and roulette; stores the state of paths that go on, with the next vertex number.
template <class Real, bool next_event>
void PathTracer<Real, next_event>::scatter(Vertex& at, M lanes, std::uint32_t first) {
    const V zero(Real(0)), one(Real(1));
    const RandomLanes<Real> u = random_numbers(tables_.settings.seed, at.id,
        at.number * I(U{dimension::blocks_per_vertex}) + I(U{dimension::first_vertex + dimension::scatter}));
    const M diffuse = has_bit(at.bits, U{material_bits::diffuse}) & lanes;
    Vec3<V> direction = at.facing;
    V density = zero;
    M alive = lanes;
    if (any(diffuse)) {
        direction = scatter_diffuse(tables_, at.facing, u);
        density = select(diffuse, sqrt(V(one - u[0])) * V(static_cast<Real>(inverse_pi)), zero);
    }
    const M specular = lanes & !diffuse;
    if (any(specular)) {
        const Scattered<Real> scattered = scatter_specular(tables_, at.surface.material, at.bits, specular,
            at.direction, at.surface.normal, at.facing, at.cosine, at.front, u);
        direction = select(diffuse, direction, scattered.direction);
        alive = diffuse | scattered.alive;
    }
    const Vec3<V> absorbed =
        tables_.any_specular ? absorption(tables_, at.surface.material, at.bits, at.colour) : at.colour;
    Vec3<V> throughput = at.throughput * absorbed;
    const V strongest = greatest(greatest(throughput.x, throughput.y), throughput.z);
    alive = alive & !(strongest == zero);
    if (tables_.settings.roulette_start != no_roulette) {
        // Event number k + 1 is the vertex number plus one.
        const M played = !(at.number + I(U{1}) < I(U{tables_.settings.roulette_start}));
        const V survival = least(one, strongest);
        alive = alive & ((!played) | (u[3] < survival));
        if (!tables_.planted(PlantedBug::roulette_not_divided))
            throughput = select(played, throughput * V(one / survival), throughput);
    }
    if (none(alive)) return;
    const V side = dot(direction, at.surface.normal);
    const M inside = side < zero;
    const Vec3<V> origin =
        along(at.surface.point, V(select(inside, -at.surface.error_bound, at.surface.error_bound)), at.surface.normal);
    I primitive = at.surface.primitive;
    if (tables_.planted(PlantedBug::self_hit_not_excluded)) primitive = I(U{no_primitive});
    store3(paths_.origin, first, origin);
    store3(paths_.direction, first, direction);
    store3(paths_.throughput, first, throughput);
    store<Real>(&paths_.density[first], density);
    store_ints<Real>(&paths_.primitive[first], primitive);
    store_ints<Real>(&paths_.inside[first], select(inside, I(U{1}), I(U{0})));
    store_ints<Real>(&paths_.vertex[first], select(alive, at.number + I(U{1}), at.number));
}

}  // namespace tandem::cpu
