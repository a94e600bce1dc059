#include "cpu_ref/bidirectional/paths.h"

#include <algorithm>
#include <cmath>

#include "common/render/random.h"
#include "cpu_ref/bidirectional/pixel_shares.h"
#include "cpu_ref/path_tracer/pixel_filter.h"

namespace tandem::cpu {
namespace {

using glm::dvec3;

// Blocks of section 3: the time; and of those kept, the light's point and ray, and its subpath's scattering.
constexpr std::uint32_t time_block = 1, light_point_block = 2, light_ray_block = 3, light_scatter = 3;

}  // namespace

// `forward`: the density over area with which this subpath came here. `reverse`: the density with which one from the
// other end would come here from the next vertex, once known. For a far light's point: over solid angle.
struct BidirectionalSampler::Vertex {
    Place place;
    Reached reached;  // surfaces
    Lobe lobe = Lobe::known;
    dvec3 throughput{0.0};  // of the subpath before it scatters here
    double forward = 0.0, reverse = 0.0;

    // The density over the area here of coming from a point, given that over solid angle there.
    [[nodiscard]] double over_area(double density, const dvec3& from) const {
        const dvec3 way = place.point - from;
        const double square = glm::dot(way, way);
        return density * std::abs(glm::dot(way, place.normal)) / (square * std::sqrt(square));
    }
};

std::uint64_t BidirectionalSampler::bytes_per_path() const {
    return (2 * std::uint64_t{settings_.bounces} + 3) * sizeof(Vertex);
}

struct BidirectionalSampler::Sample {
    Generator generator;
    std::uint64_t seed;
    std::uint32_t pixel;
    std::uint64_t number;
    std::stop_token stop;  // looked at between vertices and between ways: there are up to (bounces + 2)^2 of these
    double time = 0.0;
    dvec3 position{0.0}, ahead{0.0}, right{0.0}, up{0.0};  // the camera's, at the path's time
    Place lens;
    std::vector<Vertex> camera;  // the first hit, and on
    bool escaped = false;        // the ray beyond the last vertex
    dvec3 last_direction{0.0}, last_throughput{1.0};
    double last_density = 0.0;
    LightPoint light_point;
    std::vector<Vertex> light;  // the point on the light, and on

    [[nodiscard]] std::array<double, 4> numbers(std::uint32_t block) const {
        std::array<double, 4> result{};
        const RandomBlock words = random_block(generator, seed, pixel, number, block);
        for (std::size_t i = 0; i < 4; ++i) result[i] = to_unit<double>(words[i]);
        return result;
    }
    [[nodiscard]] dvec3 three_numbers(std::uint32_t block) const {
        const auto all = numbers(block);
        return {all[0], all[1], all[2]};
    }
};

// One way to have sampled a path: s vertices from the light, t - 1 surfaces from the camera, and the light's point. The
// densities that the connection decides are here, those of the subpaths in their vertices.
struct BidirectionalSampler::Weighing {
    std::size_t s, t;               // t counts the lens
    const LightPoint* light_point;  // x_0
    double light_density;           // of x_0 from the light
    double next_event_density;      // of x_0 as section 9.2 samples it for x_1
    bool light_is_hit;              // scattering could find x_0
    // From the light's end: of z_(t-1) and z_(t-2); from the camera's: of y_(s-1) and y_(s-2).
    double camera_end = 0.0, camera_before = 0.0, light_end = 0.0, light_before = 0.0;
};

BidirectionalSampler::BidirectionalSampler(RTCDevice device, const Scene& scene, const RenderSettings& settings)
    : settings_(settings),
      camera_(scene.camera),
      sky_(scene.background),
      materials_(scene.materials),
      caster_(device, scene, settings),
      emitters_(scene, caster_, sky_, scene.camera.position),
      film_height_(std::tan(0.5 * glm::radians(scene.camera.vertical_field_degrees))),
      film_width_(film_height_ * settings.width / settings.height) {}

double BidirectionalSampler::film_density(const Sample& sample, const dvec3& direction) const {
    const double cosine = glm::dot(direction, sample.ahead);
    return 1.0 / (4.0 * film_width_ * film_height_ * cosine * cosine * cosine);
}

// Adds the vertex that a ray from the path's end meets, if any.
bool BidirectionalSampler::extend(
    std::vector<Vertex>& path, const dvec3& direction, double density, double time) const {
    Vertex& last = path.back();
    const std::optional<Place> place = caster_.closest(last.place, direction, time);
    if (!place) return false;
    Vertex next;
    next.place = *place;
    const Material& material = materials_[place->material];
    const bool textured = material.colour_texture != no_index;
    const dvec3 colour = textured ? caster_.texture_colour(*place, time) : material.colour;
    next.reached = {&material, colour, place->normal, -direction};
    next.lobe = lobe_of(material);
    next.forward = next.over_area(density, last.place.point);
    path.push_back(next);
    return true;
}

void BidirectionalSampler::trace_from_camera(Sample& sample) const {
    const auto u = sample.numbers(dimension::film_and_lens);
    const double time = sample.time = sample.numbers(time_block)[0];
    sample.position = camera_.position + time * camera_.position_motion;
    sample.ahead = glm::normalize(camera_.target + time * camera_.target_motion - sample.position);
    sample.right = glm::normalize(glm::cross(sample.ahead, camera_.up));
    sample.up = glm::cross(sample.right, sample.ahead);
    const auto place = [&](double number) {
        return settings_.filter == PixelFilter::box ? number : place_by_filter(settings_.filter, number);
    };
    const double x = sample.pixel % settings_.width + place(u[0]), y = sample.pixel / settings_.width + place(u[1]);
    const dvec3 q = sample.ahead + film_width_ * (2.0 * x / settings_.width - 1.0) * sample.right +
                    film_height_ * (1.0 - 2.0 * y / settings_.height) * sample.up;
    sample.lens.point = sample.position;
    dvec3 direction = glm::normalize(q);
    if (camera_.lens_radius > 0.0) {
        const glm::dvec2 lens = camera_.lens_radius * disc_point(u[2], u[3]);
        sample.lens.point += lens.x * sample.right + lens.y * sample.up;
        direction = glm::normalize(sample.position + camera_.focus_distance * q - sample.lens.point);
    }

    std::vector<Vertex>& path = sample.camera;
    path.assign(1, Vertex{});
    path[0].place = sample.lens;
    double density = film_density(sample, direction);
    dvec3 throughput(1.0);
    for (std::uint32_t k = 0;; ++k) {
        sample.last_direction = direction;
        sample.last_throughput = throughput;
        sample.last_density = density;
        if (sample.stop.stop_requested()) return;
        sample.escaped = !extend(path, direction, density, sample.time);
        if (sample.escaped) return;
        Vertex& at = path.back();
        at.throughput = throughput;
        const Material& material = *at.reached.material;
        if (k == settings_.bounces || (material.kind == MaterialKind::emissive && !material.translucent)) return;
        const std::uint32_t block = dimension::first_vertex + dimension::blocks_per_vertex * k + dimension::scatter;
        const auto scattered = scatter_path(at.reached, sample.three_numbers(block), Transport::from_camera);
        if (!scattered) return;
        throughput *= scattered->weight;
        const double greatest = std::max({throughput.x, throughput.y, throughput.z});
        if (greatest == 0.0) return;
        if (k + 1 >= settings_.roulette_start) {  // section 9.3
            const double survival = std::min(1.0, greatest);
            if (!(sample.numbers(block)[3] < survival)) return;
            throughput /= survival;
        }
        direction = scattered->direction;
        density = scattered->density;
        Vertex& before = path[path.size() - 2];
        const Reached reverse{at.reached.material, at.reached.colour, at.reached.normal, direction};
        before.reverse = before.over_area(scattering_density(reverse, at.reached.back), at.place.point);
    }
}

void BidirectionalSampler::trace_from_light(Sample& sample) const {
    std::vector<Vertex>& path = sample.light;
    path.clear();
    if (emitters_.empty() || settings_.bounces == 0) return;
    sample.light_point = emitters_.sample(sample.three_numbers(light_point_block));
    const LightPoint& point = sample.light_point;
    const Emitters::Emission ray = emitters_.emit(point, sample.three_numbers(light_ray_block));
    if (!(ray.density > 0.0)) return;
    path.assign(1, Vertex{});
    path[0].place = ray.from;
    path[0].forward = emitters_.density(point);
    dvec3 direction = ray.direction;
    double density = ray.density;
    const double cosine = point.light->is_surface() ? std::abs(glm::dot(direction, point.place.normal)) : 1.0;
    dvec3 throughput = emitters_.emitted(point, direction) * (cosine / (path[0].forward * density));
    for (std::uint32_t k = 0; k < settings_.bounces && !sample.stop.stop_requested(); ++k) {
        if (throughput == dvec3(0.0) || !extend(path, direction, density, sample.time)) return;
        Vertex& at = path.back();
        at.throughput = throughput;
        if (k == 0 && point.light->is_far())  // its rays fill a disc evenly
            at.forward = density * std::abs(glm::dot(direction, at.place.normal));
        const Material& material = *at.reached.material;
        if (at.lobe == Lobe::sampled_only || (material.kind == MaterialKind::emissive && !material.translucent)) {
            path.pop_back();  // of no use: nothing is connected to it, nor goes on from it
            return;
        }
        if (k + 1 == settings_.bounces) return;
        const std::uint32_t block = dimension::first_vertex + dimension::blocks_per_vertex * k + light_scatter;
        const auto scattered = scatter_path(at.reached, sample.three_numbers(block), Transport::from_light);
        if (!scattered) return;
        throughput *= scattered->weight;
        direction = scattered->direction;
        density = scattered->density;
        Vertex& before = path[path.size() - 2];
        const Reached reverse{at.reached.material, at.reached.colour, at.reached.normal, direction};
        const double back = scattering_density(reverse, at.reached.back);
        const bool far = path.size() == 2 && point.light->is_far();
        before.reverse = far ? back : before.over_area(back, at.place.point);
    }
}

// The power heuristic over all ways to sample the path. A way's density relative to this one's is a product of ratios,
// over the vertices that the two sample from different ends.
double BidirectionalSampler::weight(const Sample& sample, const Weighing& way) const {
    const std::size_t k = way.s + way.t - 1;  // vertices x_0 … x_k, x_k on the lens
    const auto from_light = [&](std::size_t i) {
        if (i == 0) return way.light_density;
        if (i < way.s) return sample.light[i].forward;
        if (i == way.s) return way.camera_end;
        if (i == way.s + 1) return way.camera_before;
        return sample.camera[k - i].reverse;
    };
    const auto from_camera = [&](std::size_t i) {
        if (i >= way.s) return sample.camera[k - i].forward;
        if (i + 1 == way.s) return way.light_end;
        if (i + 2 == way.s) return way.light_before;
        return sample.light[i].reverse;
    };
    const auto lobe = [&](std::size_t i) { return i < way.s ? sample.light[i].lobe : sample.camera[k - i].lobe; };
    const auto is_possible = [&](std::size_t s) {
        if (s == 0) return way.light_is_hit;
        if (s == 1 && k == 1) return false;  // the light's point seen from the lens: found by scattering alone
        return (s == 1 || lobe(s - 1) == Lobe::known) && (s == k || lobe(s) == Lobe::known);
    };
    const auto density_of = [&](std::size_t s, double relative) {
        return s == 1 ? relative * way.next_event_density / way.light_density : relative;
    };
    const double own = density_of(way.s, 1.0);
    double sum = 1.0;
    const auto add = [&](std::size_t s, double relative) {
        if (!is_possible(s)) return;
        const double ratio = density_of(s, relative) / own;
        sum += ratio * ratio;
    };
    double relative = 1.0;
    for (std::size_t i = way.s; i < k; ++i) {
        if (i >= 2 && lobe(i - 1) == Lobe::sampled_only) break;  // light's subpaths do not scatter there
        relative *= from_light(i) / from_camera(i);
        add(i + 1, relative);
    }
    relative = 1.0;
    for (std::size_t i = way.s; i-- > 0;) {
        relative *= from_camera(i) / from_light(i);
        add(i, relative);
    }
    return 1.0 / sum;
}

// s = 0: the path from the camera meets what emits, at its vertex t - 1 (the lens being 0).
dvec3 BidirectionalSampler::emission_at(const Sample& sample, std::size_t t) const {
    const Vertex& at = sample.camera[t - 1];
    const Material& material = *at.reached.material;
    if (material.radiance == dvec3(0.0)) return dvec3(0.0);
    if (material.sides == EmittingSides::front && !at.reached.front()) return dvec3(0.0);
    const dvec3 light = at.throughput * (material.translucent ? material.alpha * material.radiance : material.radiance);
    const Emitter* emitter = emitters_.of_primitive(at.place.primitive);
    if (emitter == nullptr || t == 2) return light;
    const LightPoint point{emitter, at.place, {}};
    const Vertex& before = sample.camera[t - 2];
    Weighing way{.s = 0,
        .t = t,
        .light_point = &point,
        .light_density = emitters_.density(point),
        .next_event_density = emitters_.density_for(before.place, point),
        .light_is_hit = true};
    way.camera_before = before.over_area(emitters_.emission_density(point, at.reached.back), at.place.point);
    return light * weight(sample, way);
}

// s = 0: the path from the camera leaves the scene.
dvec3 BidirectionalSampler::sky_beyond(Sample& sample) const {
    const dvec3 light = sample.last_throughput * sky_.radiance(sample.last_direction);
    const Emitter* emitter = emitters_.of_sky();
    if (emitter == nullptr || sample.camera.size() == 1) return light;
    const LightPoint point{emitter, {}, sample.last_direction};
    const double density = emitters_.density(point);
    if (!(density > 0.0)) return light;
    const double front = std::abs(glm::dot(sample.last_direction, sample.camera.back().place.normal));
    sample.camera.emplace_back().forward = sample.last_density;  // the sky as the last vertex, for weight() alone
    const Weighing way{.s = 0,
        .t = sample.camera.size(),
        .light_point = &point,
        .light_density = density,
        .next_event_density = density,
        .light_is_hit = true,
        .camera_before = emitters_.emission_density(point, -sample.last_direction) * front};
    const double share = weight(sample, way);
    sample.camera.pop_back();
    return light * share;
}

// s = 1: a point on a light, sampled for the vertex t - 1.
dvec3 BidirectionalSampler::next_event(const Sample& sample, std::size_t t) const {
    const Vertex& at = sample.camera[t - 1];
    if (at.lobe != Lobe::known || emitters_.empty()) return dvec3(0.0);
    const std::uint32_t block =
        dimension::first_vertex + dimension::blocks_per_vertex * static_cast<std::uint32_t>(t - 2) + dimension::light;
    const LightPoint point = emitters_.sample_for(at.place, sample.three_numbers(block));
    const Emitter& light = *point.light;
    const dvec3 way = light.is_far() ? point.towards : point.place.point - at.place.point;
    const double square = glm::dot(way, way);
    const dvec3 to_light = way / std::sqrt(square);
    const dvec3 value = scattering_value(at.reached, to_light) * emitters_.emitted(point, -to_light);
    if (value == dvec3(0.0)) return dvec3(0.0);
    if (!(light.is_far() ? caster_.sees_far(at.place, to_light, sample.time)
                         : caster_.sees(at.place, point.place, sample.time)))
        return dvec3(0.0);
    double geometry = std::abs(glm::dot(to_light, at.place.normal)) / (light.is_far() ? 1.0 : square);
    if (light.is_surface()) geometry *= std::abs(glm::dot(to_light, point.place.normal));

    const double density = emitters_.density_for(at.place, point);
    Weighing weighing{.s = 1,
        .t = t,
        .light_point = &point,
        .light_density = emitters_.density(point),
        .next_event_density = density,
        .light_is_hit = light.is_hit()};
    Vertex end;
    end.place = point.place;
    const double scattered = scattering_density(at.reached, to_light);
    weighing.light_end = light.is_far() ? scattered : end.over_area(scattered, at.place.point);
    const double emission = emitters_.emission_density(point, -to_light);
    weighing.camera_end = light.is_far() ? emission * std::abs(glm::dot(to_light, at.place.normal))
                                         : at.over_area(emission, point.place.point);
    if (t > 2) {
        const Vertex& before = sample.camera[t - 2];
        const Reached reverse{at.reached.material, at.reached.colour, at.reached.normal, to_light};
        weighing.camera_before = before.over_area(scattering_density(reverse, at.reached.back), at.place.point);
    }
    return at.throughput * value * (geometry / density) * weight(sample, weighing);
}

// s >= 2 and t >= 2: vertex s - 1 of the light's subpath (its point being 0) and vertex t - 1 of the camera's.
dvec3 BidirectionalSampler::connection(const Sample& sample, std::size_t s, std::size_t t) const {
    const Vertex &y = sample.light[s - 1], &z = sample.camera[t - 1];
    if (y.lobe != Lobe::known || z.lobe != Lobe::known) return dvec3(0.0);
    const dvec3 way = y.place.point - z.place.point;
    const double square = glm::dot(way, way);
    const dvec3 to_light = way / std::sqrt(square);
    const dvec3 value = scattering_value(y.reached, -to_light) * scattering_value(z.reached, to_light);
    if (value == dvec3(0.0) || !caster_.sees(z.place, y.place, sample.time)) return dvec3(0.0);
    const double geometry = std::abs(glm::dot(to_light, y.place.normal) * glm::dot(to_light, z.place.normal)) / square;

    const LightPoint& point = sample.light_point;
    const Vertex &y_before = sample.light[s - 2], &z_before = sample.camera[t - 2];
    Weighing weighing{.s = s,
        .t = t,
        .light_point = &point,
        .light_density = sample.light[0].forward,
        .next_event_density = emitters_.density_for(sample.light[1].place, point),
        .light_is_hit = point.light->is_hit()};
    weighing.light_end = y.over_area(scattering_density(z.reached, to_light), z.place.point);
    weighing.camera_end = z.over_area(scattering_density(y.reached, -to_light), y.place.point);
    const Reached y_reverse{y.reached.material, y.reached.colour, y.reached.normal, -to_light};
    const Reached z_reverse{z.reached.material, z.reached.colour, z.reached.normal, to_light};
    const double back = scattering_density(y_reverse, y.reached.back);
    weighing.light_before = s == 2 && point.light->is_far() ? back : y_before.over_area(back, y.place.point);
    if (t > 2)
        weighing.camera_before = z_before.over_area(scattering_density(z_reverse, z.reached.back), z.place.point);
    return y.throughput * value * z.throughput * geometry * weight(sample, weighing);
}

// t = 1: vertex s - 1 of the light's subpath, seen through the lens.
void BidirectionalSampler::project(const Sample& sample, std::size_t s, const Splat& splat) const {
    const Vertex& y = sample.light[s - 1];
    if (y.lobe != Lobe::known) return;
    const dvec3 way = y.place.point - sample.lens.point;
    const double square = glm::dot(way, way);
    const dvec3 direction = way / std::sqrt(square);
    const double cosine = glm::dot(direction, sample.ahead);
    if (!(cosine > 0.0)) return;
    // Where the plane in focus is met, relative to the film's middle, at distance 1.
    const double focus = camera_.lens_radius > 0.0 ? camera_.focus_distance : 1.0;
    const dvec3 q = (sample.lens.point + (focus / cosine) * direction - sample.position) / focus;
    const double x = 0.5 * (glm::dot(q, sample.right) / film_width_ + 1.0) * settings_.width;
    const double y_down = 0.5 * (1.0 - glm::dot(q, sample.up) / film_height_) * settings_.height;
    const PixelShares columns(settings_.filter, x, settings_.width), rows(settings_.filter, y_down, settings_.height);
    if (columns.all().empty() || rows.all().empty()) return;
    const dvec3 value = scattering_value(y.reached, -direction);
    if (value == dvec3(0.0) || !caster_.sees(y.place, sample.lens, sample.time)) return;

    const LightPoint& point = sample.light_point;
    const Vertex& before = sample.light[s - 2];
    Weighing weighing{.s = s,
        .t = 1,
        .light_point = &point,
        .light_density = sample.light[0].forward,
        .next_event_density = emitters_.density_for(sample.light[1].place, point),
        .light_is_hit = point.light->is_hit()};
    const double film = film_density(sample, direction);
    weighing.light_end = y.over_area(film, sample.lens.point);
    const Reached reverse{y.reached.material, y.reached.colour, y.reached.normal, -direction};
    const double back = scattering_density(reverse, y.reached.back);
    weighing.light_before = s == 2 && point.light->is_far() ? back : before.over_area(back, y.place.point);
    // Every pixel's sample sends one subpath from the lights, so the mean over them undoes the film's share of a pixel.
    const double geometry = std::abs(glm::dot(direction, y.place.normal)) / square;
    const dvec3 brought = y.throughput * value * (geometry * film) * weight(sample, weighing);
    for (const PixelShare& row : rows.all())
        for (const PixelShare& column : columns.all())
            splat(row.index * settings_.width + column.index, (row.value * column.value) * brought);
}

dvec3 BidirectionalSampler::radiance(
    std::uint32_t pixel, std::uint64_t number, const Splat& splat, const std::stop_token& stop) const {
    thread_local Sample sample;  // keeps its vertices' memory
    sample.generator = settings_.generator;
    sample.seed = settings_.seed;
    sample.pixel = pixel;
    sample.number = number;
    sample.stop = stop;
    trace_from_camera(sample);
    trace_from_light(sample);
    dvec3 sum(0.0);
    if (sample.escaped) sum += sky_beyond(sample);
    const std::size_t most = std::size_t{settings_.bounces} + 2;  // s + t
    for (std::size_t t = 2; t <= sample.camera.size(); ++t) {
        if (stop.stop_requested()) return sum;
        sum += emission_at(sample, t);
        if (t < most) sum += next_event(sample, t);
        for (std::size_t s = 2; s <= sample.light.size() && s + t <= most; ++s) {
            if (stop.stop_requested()) return sum;
            sum += connection(sample, s, t);
        }
    }
    for (std::size_t s = 2; s <= sample.light.size(); ++s) {
        if (stop.stop_requested()) return sum;
        project(sample, s, splat);
    }
    return sum;
}

}  // namespace tandem::cpu
