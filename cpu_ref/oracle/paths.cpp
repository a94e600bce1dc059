// MODEL.md sections 4 and 9, transcribed as plainly as possible, without multiple importance sampling. Lights are
// sampled only where nothing else finds them, and for `whitted`.
#include "cpu_ref/oracle/paths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "cpu_ref/oracle/interiors.h"
#include "cpu_ref/oracle/lights.h"
#include "cpu_ref/oracle/media.h"
#include "cpu_ref/oracle/pixel_filter.h"
#include "cpu_ref/oracle/surfaces.h"
#include "cpu_ref/oracle/textures.h"

namespace tandem::oracle {
namespace {

using glm::dvec2;
using glm::dvec3;

// Blocks of section 3 beside those that common/render/random.h names.
constexpr std::uint32_t time_block = 1, medium_of_vertex = 2;

struct CameraFrame {
    dvec3 position, forward, right, upward;
};

CameraFrame frame_of(const Camera& camera, double time) {
    CameraFrame frame{};
    frame.position = camera.position + time * camera.position_motion;
    frame.forward = glm::normalize(camera.target + time * camera.target_motion - frame.position);
    frame.right = glm::normalize(glm::cross(frame.forward, camera.up));
    frame.upward = glm::cross(frame.right, frame.forward);
    return frame;
}

}  // namespace

struct PathSampler::Path {
    std::uint32_t pixel;
    std::uint64_t sample;
    Ray ray;
    Interiors interiors;
    dvec3 throughput{1.0}, light{0.0};
    // For a ray that goes on through a face (section 5.2): by how much it starts before that face. Then come the face's
    // material and normal, the side that the path came from, and the list as it was.
    double lead = 0.0;
    bool crossed_from_front = false;
    std::uint32_t crossed_material = no_index;
    dvec3 crossed_normal{0.0};
    Interiors interiors_before = interiors;
};

struct PathSampler::Vertex {
    dvec3 position;
    std::uint32_t primitive = no_primitive;  // none in a medium
    dvec3 front_normal{0.0};
    double rounding = 0.0;
    dvec3 lit_side{0.0};  // n_f of section 9.2; zero in a medium
};

struct PathSampler::VertexNumbers {
    Numbers scatter, light;
};

PathSampler::PathSampler(const Scene& scene, const RenderSettings& settings)
    : settings_(settings), scene_(scene), world_(scene), lights_(scene_, settings.light_sampling) {}

Ray PathSampler::camera_ray(std::uint32_t x, std::uint32_t y, std::uint64_t sample) const {
    const Camera& camera = scene_.camera;
    const std::uint32_t pixel = y * settings_.width + x;
    const Numbers u =
        numbers_of(random_block(settings_.generator, settings_.seed, pixel, sample, dimension::film_and_lens));
    const double time = numbers_of(random_block(settings_.generator, settings_.seed, pixel, sample, time_block)).first;
    const CameraFrame frame = frame_of(camera, time);
    const double width = settings_.width, height = settings_.height;
    const double h = std::tan(0.5 * glm::radians(camera.vertical_field_degrees));
    const double s_x = x + place_by_filter(settings_.filter, u.first);
    const double s_y = y + place_by_filter(settings_.filter, u.second);
    const dvec3 q = frame.forward + h * (width / height) * (2.0 * s_x / width - 1.0) * frame.right +
                    h * (1.0 - 2.0 * s_y / height) * frame.upward;
    Ray ray{frame.position, glm::normalize(q)};
    ray.time = time;
    if (camera.lens_radius == 0.0) return ray;
    const dvec2 lens = camera.lens_radius * disc(u.third, u.fourth);
    ray.origin += lens.x * frame.right + lens.y * frame.upward;
    ray.direction = glm::normalize(frame.position + camera.focus_distance * q - ray.origin);
    return ray;
}

const Medium* PathSampler::medium_of(const Path& path) const {
    const std::uint32_t medium = path.interiors.medium();
    return medium == no_index ? nullptr : &scene_.media[medium];
}

dvec3 PathSampler::colour_at(const Hit& hit) const {
    const Material& material = scene_.materials[hit.material];
    if (material.colour_texture == no_index) return material.colour;
    return texture_colour(scene_.textures[material.colour_texture], hit.object_point, hit.coordinates);
}

dvec3 PathSampler::arriving(
    const Path& path, const Vertex& vertex, const dvec3& direction, double distance, std::uint32_t light) const {
    if (std::isfinite(distance) && (distance < settings_.ray_min || distance > settings_.ray_max)) return dvec3(0.0);
    const bool to_front = glm::dot(direction, vertex.front_normal) > 0.0;
    const dvec3 origin = vertex.position + (to_front ? vertex.rounding : -vertex.rounding) * vertex.front_normal;
    const Ray shadow_ray{origin, direction, vertex.primitive, to_front, path.ray.time};
    const double end = std::min(settings_.ray_max, distance);
    const std::optional<Hit> between = world_.closest_hit(shadow_ray, settings_.ray_min, end);
    if (between && (light == no_primitive || between->primitive != light)) return dvec3(0.0);
    const Medium* medium = medium_of(path);
    return medium != nullptr ? transmittance(*medium, shadow_ray, end) : dvec3(1.0);
}

// Section 9.2 with p = 1: as every punctual light is summed, none is chosen. For `whitted` that is the whole light of a
// vertex, with w_light = 1 (9.5). What is sampled there, and how densely, is the mean's own.
template <class Share>
dvec3 PathSampler::direct_light(
    const Path& path, const Vertex& vertex, const Numbers& v, const Share& share, TracedVertex& seen) const {
    if (settings_.integrator == Integrator::whitted) {
        const std::optional<LightSample> sample = lights_.sample(vertex.position, vertex.lit_side, path.ray.time, v);
        if (!sample) return dvec3(0.0);
        const dvec3 part = share(sample->direction) * sample->irradiance;
        if (part == dvec3(0.0)) return part;
        seen.light =
            path.throughput * part * arriving(path, vertex, sample->direction, sample->distance, sample->primitive);
        if (seen.light != dvec3(0.0)) seen.next_event.direction = sample->direction;
        return seen.light;
    }
    dvec3 sum(0.0);
    for (const PunctualLight& light : scene_.lights) {
        const PunctualView view = punctual_view(light, vertex.position);
        const dvec3 part = share(view.direction) * view.irradiance;
        if (part != dvec3(0.0)) sum += part * arriving(path, vertex, view.direction, view.distance, no_primitive);
    }
    return path.throughput * sum;
}

PathEnd PathSampler::scatter_in_medium(
    Path& path, const Medium& medium, double distance, const VertexNumbers& numbers, TracedVertex& seen) const {
    const dvec3 old = path.ray.direction, position = path.ray.origin + distance * old;
    path.light += direct_light(
        path, {position}, numbers.light,
        [&](const dvec3& w) { return phase_function(medium.anisotropy, glm::dot(old, w)); }, seen);
    if (settings_.integrator == Integrator::whitted) return PathEnd::direct_light;
    const dvec3 direction = phase_direction(medium.anisotropy, old, numbers.scatter.first, numbers.scatter.second);
    path.ray = {position, direction, no_primitive, true, path.ray.time};
    path.lead = 0.0;
    seen.pdf = phase_function(medium.anisotropy, glm::dot(old, direction));
    return PathEnd::goes_on;
}

PathSampler::Place PathSampler::place_of(const Path& path, const Hit& hit) const {
    if (path.lead == 0.0 || hit.primitive == path.ray.left_primitive) return Place::elsewhere;
    const Incidence in = incidence_of(path.ray.direction, hit.front_normal);
    if (hit.t > 1.5 * path.lead + 2.0 * hit.rounding / in.cosine) return Place::elsewhere;
    if (hit.material == path.crossed_material && in.front == path.crossed_from_front) return Place::same_face;
    const double alignment = glm::dot(in.near_normal, path.crossed_normal);
    return std::abs(alignment) > 511.0 / 512.0 ? Place::same_place : Place::elsewhere;
}

PathEnd PathSampler::leave(Path& path, const Hit& hit, const dvec3& direction, Place place) const {
    const bool came_from_front = glm::dot(path.ray.direction, hit.front_normal) < 0.0;
    const bool goes_to_front = glm::dot(direction, hit.front_normal) > 0.0;
    const double way = hit.t - path.lead, steepness = std::abs(glm::dot(direction, hit.front_normal));
    path.ray = {leaving_origin(hit, goes_to_front), direction, hit.primitive, goes_to_front, path.ray.time};
    const double lead_before = path.lead, whole = 4.0 * hit.rounding / steepness;
    const bool crosses = came_from_front != goes_to_front;
    path.lead = 0.0;
    if (hit.rounding > 0.0) {
        const bool ranked = scene_.materials[hit.material].priority.value_or(0) != 0;
        if (crosses && place == Place::elsewhere && !ranked) path.lead = std::max(0.0, std::min(whole, 0.5 * way));
        // Once more through what lies there before this surface.
        if (!crosses && place == Place::same_place && lets_through(scene_.materials[hit.material]))
            path.lead = std::min(whole, 256.0 * hit.rounding) + lead_before;
    }
    if (path.lead > 0.0) {
        path.ray.origin = hit.position - path.lead * direction;
        path.crossed_from_front = !goes_to_front;
        path.crossed_material = hit.material;
        path.crossed_normal = hit.front_normal;
        path.interiors_before = path.interiors;
    }
    if (!crosses) return PathEnd::goes_on;
    if (place == Place::same_face || !is_tracked(scene_.materials[hit.material])) return PathEnd::goes_on;
    if (path.interiors.cross(hit.material, came_from_front)) return PathEnd::goes_on;
    path.light = dvec3(std::numeric_limits<double>::quiet_NaN());  // invalid (section 12)
    return PathEnd::invalid;
}

PathEnd PathSampler::scatter_at_surface(
    Path& path, const Hit& hit, const VertexNumbers& numbers, TracedVertex& seen) const {
    const Material& material = scene_.materials[hit.material];
    const Incidence in = incidence_of(path.ray.direction, hit.front_normal);
    const Place place = place_of(path, hit);
    if (place == Place::same_face) return leave(path, hit, in.direction, place);
    // What lets nothing through turns all back, and lights shine on it through what is before it.
    if (place == Place::same_place && !lets_through(material)) path.interiors = path.interiors_before;
    double outer_index = 1.0;
    if (is_tracked(material)) {
        const Interiors::Outside outside = path.interiors.outside_of(hit.material, in.front);
        if (outside.hides) return leave(path, hit, in.direction, place);
        outer_index = outside.refractive_index;
    }
    const double index = material.refractive_index / outer_index;
    const Incidence shaded = shaded_incidence(in, hit.vertex_normal);
    const Surface surface{material, colour_at(hit), in.front ? 1.0 / index : index, shaded};
    if (has_known_scattering(material)) {
        path.light += direct_light(
            path, {hit.position, hit.primitive, hit.front_normal, hit.rounding, in.near_normal}, numbers.light,
            [&](const dvec3& w) { return is_on_one_side(in, shaded, w) ? scattered_share(surface, w) : dvec3(0.0); },
            seen);
        if (settings_.integrator == Integrator::whitted) return PathEnd::direct_light;
    }
    const std::optional<Scattering> scattered = scatter(surface, numbers.scatter);
    if (!scattered || !is_on_one_side(in, shaded, scattered->direction)) return PathEnd::absorbed;
    seen.pdf = scattered->pdf;
    path.throughput *= scattered->weight;
    return leave(path, hit, scattered->direction, place);
}

PathEnd PathSampler::play_roulette(Path& path, std::uint32_t k, double number) const {
    const double greatest = std::max({path.throughput.x, path.throughput.y, path.throughput.z});
    if (greatest == 0.0) return PathEnd::absorbed;
    if (k + 1 >= settings_.roulette_start) {  // section 9.3
        const double survival = std::min(1.0, greatest);
        if (!(number < survival)) return PathEnd::roulette;
        path.throughput /= survival;
    }
    return PathEnd::goes_on;
}

PathEnd PathSampler::advance(Path& path, std::uint32_t k, TracedVertex& seen) const {
    const auto numbers = [&](std::uint32_t use) {
        return numbers_of(random_block(settings_.generator, settings_.seed, path.pixel, path.sample,
            dimension::first_vertex + dimension::blocks_per_vertex * k + use));
    };
    seen.origin = path.ray.origin;
    seen.direction = path.ray.direction;
    const std::optional<Hit> hit = world_.closest_hit(path.ray, settings_.ray_min, settings_.ray_max);
    const Medium* medium = medium_of(path);
    Flight flight;
    if (medium != nullptr) {
        const Numbers m = numbers(medium_of_vertex);
        Ray beyond = path.ray;
        beyond.origin += path.lead * beyond.direction;
        const double end = hit ? std::max(0.0, hit->t - path.lead) : settings_.ray_max;
        flight = fly(*medium, beyond, end, m.first, m.second);
        if (flight.scattered_at) *flight.scattered_at += path.lead;
        path.throughput *= flight.weight;
    }
    seen.throughput = path.throughput;
    seen.in_medium = flight.scattered_at.has_value();
    if (!seen.in_medium && !hit) {
        path.light += path.throughput * background_radiance(scene_.background, path.ray.direction);
        return PathEnd::left_scene;
    }
    seen.t = seen.in_medium ? *flight.scattered_at : hit->t;
    seen.position = seen.in_medium ? path.ray.origin + seen.t * path.ray.direction : hit->position;
    if (!seen.in_medium) {
        seen.normal = hit->front_normal;
        seen.primitive = hit->primitive;
        seen.material = hit->material;
        const Material& material = scene_.materials[hit->material];
        const bool front = glm::dot(path.ray.direction, hit->front_normal) < 0.0;
        const bool hidden = place_of(path, *hit) == Place::same_face ||
                            (is_tracked(material) && path.interiors.outside_of(hit->material, front).hides);
        if (!hidden) path.light += path.throughput * emitted(material, front);
        if (ends_path(material)) return PathEnd::emitter;
    }
    if (k == settings_.bounces) return PathEnd::bounces;

    const VertexNumbers u{numbers(dimension::scatter), numbers(dimension::light)};
    const PathEnd end = seen.in_medium ? scatter_in_medium(path, *medium, *flight.scattered_at, u, seen)
                                       : scatter_at_surface(path, *hit, u, seen);
    return end == PathEnd::goes_on ? play_roulette(path, k, u.scatter.fourth) : end;
}

PathTrace PathSampler::trace(std::uint32_t x, std::uint32_t y, std::uint64_t sample) const {
    Path path{y * settings_.width + x, sample, camera_ray(x, y, sample), Interiors(scene_)};
    PathTrace trace;
    PathEnd end = PathEnd::goes_on;
    for (std::uint32_t k = 0; end == PathEnd::goes_on; ++k) {
        TracedVertex& seen = trace.vertices.emplace_back();
        seen.end = end = advance(path, k, seen);
        seen.radiance = path.light;
        if (end != PathEnd::goes_on) break;
        seen.next_direction = path.ray.direction;
        seen.next_throughput = path.throughput;
    }
    trace.radiance = path.light;
    return trace;
}

dvec3 PathSampler::radiance(std::uint32_t x, std::uint32_t y, std::uint64_t sample, const std::stop_token& stop) const {
    Path path{y * settings_.width + x, sample, camera_ray(x, y, sample), Interiors(scene_)};
    TracedVertex seen;
    for (std::uint32_t k = 0; !stop.stop_requested() && advance(path, k, seen) == PathEnd::goes_on;) ++k;
    return path.light;
}

}  // namespace tandem::oracle
