// One path: the loop of MODEL.md section 9.
#pragma once

#include "common/render/path_trace.h"
#include "cpu_ref/first_tracer/lights.h"

namespace tandem::first {

class PathTracer {
public:
    PathTracer(const Scene& scene, const RenderSettings& settings)
        : scene_(scene), settings_(settings), world_(scene_, settings_), lights_(scene_, world_) {}
    PathTracer(const PathTracer&) = delete;  // lights_ refers to its neighbours
    [[nodiscard]] const RenderSettings& settings() const { return settings_; }

    // The radiance that a sample of a pixel finds. `vertices`, if any, get what befell the path.
    [[nodiscard]] dvec3 radiance(
        std::uint32_t pixel, std::uint64_t sample, std::vector<TracedVertex>* vertices = nullptr) const {
        Path path{pixel, sample, camera_ray(scene_.camera, settings_, pixel, sample)};
        PathEnd end = PathEnd::goes_on;
        for (std::uint32_t k = 0; end == PathEnd::goes_on; ++k) {
            TracedVertex seen{
                .origin = path.ray.origin, .direction = path.ray.direction, .throughput = path.throughput};
            seen.end = end = advance(path, k, seen);
            seen.radiance = path.light;
            seen.next_direction = path.ray.direction;
            seen.next_throughput = path.throughput;
            if (vertices != nullptr) vertices->push_back(seen);
        }
        return path.light;
    }

private:
    struct Path {
        std::uint32_t pixel;
        std::uint64_t sample;
        Ray ray;
        dvec3 throughput{1.0}, light{0.0};  // A and L
        double density = 0.0;  // of the ray's direction where it was scattered; 0: only sampled, or a camera's
    };

    // One turn of the loop: to vertex k, and to the ray that leaves it.
    PathEnd advance(Path& path, std::uint32_t k, TracedVertex& seen) const {
        const std::optional<Hit> hit = world_.closest_hit(path.ray);
        if (!hit) {
            const double up = 0.5 * (path.ray.direction.y + 1.0);  // section 8.1
            path.light += path.throughput * glm::mix(scene_.background.down, scene_.background.up, up);
            return PathEnd::left_scene;
        }
        const std::uint32_t number = world_.shapes[hit->primitive].material;
        const Material& material = scene_.materials[number];
        const Incidence in = incidence(material, path.ray.direction, *hit);
        seen.t = hit->t, seen.position = hit->point, seen.normal = hit->normal;
        seen.primitive = hit->primitive, seen.material = number;

        path.light += path.throughput * emitted(material, in.front) * weight_of_emission(path, *hit);
        if (material.kind == MaterialKind::emissive && !material.translucent) return PathEnd::emitter;  // section 7.5
        if (k == settings_.bounces) return PathEnd::bounces;

        const auto numbers_at = [&](std::uint32_t use) {
            const std::uint32_t block = dimension::first_vertex + dimension::blocks_per_vertex * k + use;
            return numbers(settings_, path.pixel, path.sample, block);
        };
        const bool diffuse = material.kind == MaterialKind::diffuse;
        if (diffuse && settings_.integrator == Integrator::next_event) {
            seen.light = next_event(path, in, *hit, numbers_at(dimension::light), seen);
            path.light += seen.light;
        }
        const Numbers u = numbers_at(dimension::scatter);
        const std::optional<Scattering> scattered = diffuse ? scatter_diffuse(in, u) : scatter_specular(in, u);
        if (!scattered) return PathEnd::absorbed;
        path.throughput *= scattered->weight;
        path.density = seen.pdf = scattered->density;
        const bool to_front = glm::dot(scattered->direction, hit->normal) > 0.0;
        path.ray = spawned_ray(world_, *hit, scattered->direction, to_front);
        return play_roulette(path, k, u.fourth);
    }

    // Section 9.2, rules 24 to 28: how much of a light counts that scattering has found, as next events may find it
    // too.
    [[nodiscard]] double weight_of_emission(const Path& path, const Hit& hit) const {
        if (settings_.integrator != Integrator::next_event || path.density == 0.0) return 1.0;
        const double sampled = lights_.density(path.ray, hit);
        if (sampled == 0.0) return 1.0;
        return settings_.mis ? power_heuristic(path.density, sampled) : 0.0;
    }

    // Section 9.2, rules 15 to 20 and 27: what a light, chosen by v, brings to a diffuse vertex.
    [[nodiscard]] dvec3 next_event(
        const Path& path, const Incidence& in, const Hit& hit, const Numbers& v, TracedVertex& seen) const {
        Ray shadow = spawned_ray(world_, hit, dvec3(0.0), in.front);
        const std::optional<LightSample> light = lights_.sample(shadow, v);
        if (!light) return dvec3(0.0);
        shadow.direction = light->direction;
        const double cosine = glm::dot(in.normal, light->direction);
        if (!(cosine > 0.0) || !world_.reaches(shadow, light->primitive, light->distance)) return dvec3(0.0);
        seen.next_event.direction = light->direction;
        const double weight = settings_.mis ? power_heuristic(light->density, cosine / pi) : 1.0;
        return path.throughput * (in.material.colour / pi) * cosine * light->radiance / light->density * weight;
    }

    // Section 9.3.
    [[nodiscard]] PathEnd play_roulette(Path& path, std::uint32_t k, double u4) const {
        const double greatest = std::max({path.throughput.x, path.throughput.y, path.throughput.z});
        if (greatest == 0.0) return PathEnd::absorbed;
        if (k + 1 < settings_.roulette_start) return PathEnd::goes_on;
        const double q = std::min(1.0, greatest);
        if (!(u4 < q)) return PathEnd::roulette;
        path.throughput /= q;
        return PathEnd::goes_on;
    }

    Scene scene_;
    RenderSettings settings_;
    World world_;
    Lights lights_;
};

}  // namespace tandem::first
