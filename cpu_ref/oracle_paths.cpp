// MODEL.md sections 3.1, 4, 7, 8 and 9.1, transcribed as plainly as possible; no light sampling, no multiple importance
// sampling, and the standard library's trigonometry in place of the tracers' polynomials.
#include "cpu_ref/oracle_paths.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/error.h"
#include "common/random.h"

namespace tandem::oracle {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double two_pi = 2.0 * std::numbers::pi;

// Four numbers of one dimension block (MODEL.md section 3).
struct Numbers {
    double first, second, third, fourth;
};

Numbers numbers_of(const RandomBlock& words) {
    return {to_unit<double>(words[0]), to_unit<double>(words[1]), to_unit<double>(words[2]), to_unit<double>(words[3])};
}

// MODEL.md section 3.1.
dvec2 disc(double a, double b) { return std::sqrt(a) * dvec2(std::cos(two_pi * b), std::sin(two_pi * b)); }

dvec3 unit_sphere(double a, double b) {
    const double rho = 2.0 * std::sqrt(a * (1.0 - a));
    return {rho * std::cos(two_pi * b), rho * std::sin(two_pi * b), 1.0 - 2.0 * a};
}

dvec3 cosine_hemisphere(const dvec3& normal, double a, double b) {
    const double sign = normal.z >= 0.0 ? 1.0 : -1.0;
    const double p = -1.0 / (sign + normal.z), q = normal.x * normal.y * p;
    const dvec3 tangent(1.0 + sign * normal.x * normal.x * p, sign * q, -sign * normal.x);
    const dvec3 bitangent(q, sign + normal.y * normal.y * p, -normal.y);
    const dvec2 foot = disc(a, b);
    return glm::normalize(foot.x * tangent + foot.y * bitangent + std::sqrt(1.0 - a) * normal);
}

// How the ray meets the surface (MODEL.md section 7).
struct Incidence {
    dvec3 direction;  // d
    bool front;
    dvec3 near_normal;  // n_f
    double cosine;      // c
};

Incidence incidence_of(const dvec3& direction, const dvec3& front_normal) {
    const double along = glm::dot(direction, front_normal);
    const bool front = along < 0.0;
    return {direction, front, front ? front_normal : -front_normal, std::abs(along)};
}

// Section 7.4: the reflectance, and the refracted direction unless all is reflected.
struct Interface {
    double reflectance;
    dvec3 refracted;
};

Interface interface_of(const Material& material, const Incidence& in) {
    const double eta = in.front ? 1.0 / material.refractive_index : material.refractive_index;
    const double c = in.cosine, sine_squared = eta * eta * (1.0 - c * c);
    if (sine_squared > 1.0) return {1.0, dvec3(0.0)};  // total internal reflection: u3 < 1 always
    const double ct = std::sqrt(1.0 - sine_squared);
    const dvec3 refracted = eta * in.direction + (eta * c - ct) * in.near_normal;
    if (material.fresnel == Fresnel::schlick) {
        const double root = (1.0 - eta) / (1.0 + eta), r0 = root * root;
        return {r0 + (1.0 - r0) * std::pow(1.0 - (eta <= 1.0 ? c : ct), 5.0), refracted};
    }
    const double senkrecht = (eta * c - ct) / (eta * c + ct), parallel = (c - eta * ct) / (c + eta * ct);
    return {0.5 * (senkrecht * senkrecht + parallel * parallel), refracted};
}

// Sections 7.3 and 7.4: direction after a specular event, or nothing where fuzz absorbs the path.
std::optional<dvec3> specular_direction(const Material& material, const Incidence& in, const Numbers& u) {
    dvec3 base = in.direction + 2.0 * in.cosine * in.near_normal;
    if (material.translucent) {
        const Interface surface = interface_of(material, in);
        if (!(u.third < surface.reflectance)) base = surface.refracted;
    }
    base = glm::normalize(base);
    if (material.fuzz == 0.0) return base;
    const dvec3 blurred = base + material.fuzz * unit_sphere(u.first, u.second);
    if (glm::dot(blurred, blurred) < 0x1p-40) return std::nullopt;
    const dvec3 direction = glm::normalize(blurred);
    if (glm::dot(direction, in.near_normal) * glm::dot(base, in.near_normal) <= 0.0) return std::nullopt;
    return direction;
}

// Sections 7.2 to 7.5: radiance emitted towards where the ray comes from.
dvec3 emitted(const Material& material, bool front) {
    if (material.sides == EmittingSides::front && !front) return dvec3(0.0);
    return material.translucent ? material.alpha * material.radiance : material.radiance;
}

bool ends_path(const Material& material) { return material.kind == MaterialKind::emissive && !material.translucent; }

// Section 7.1.
dvec3 transmitted_share(const Material& material) {
    return material.translucent ? 1.0 - material.alpha * (1.0 - material.colour) : material.colour;
}

}  // namespace

PathSampler::PathSampler(const Scene& scene, const RenderSettings& settings)
    : settings_(settings),
      camera_(scene.camera),
      background_(scene.background),
      materials_(scene.materials),
      world_(scene),
      forward_(glm::normalize(camera_.target - camera_.position)),
      right_(glm::normalize(glm::cross(forward_, camera_.up))),
      upward_(glm::cross(right_, forward_)) {
    // Below this sine the direction of f x up is mostly rounding: its error is a few units of 2^-53.
    constexpr double least_sine = 0x1p-40;
    const double sine = glm::length(glm::cross(forward_, camera_.up)) / glm::length(camera_.up);
    if (!(sine > least_sine))  // also NaN, from a target at the position
        throw InputError("camera: its target is its position, or its up vector lies along the view; move one of them");
}

Ray PathSampler::camera_ray(std::uint32_t x, std::uint32_t y, std::uint64_t sample) const {
    const Numbers u =
        numbers_of(random_block(settings_.seed, y * settings_.width + x, sample, dimension::film_and_lens));
    const double width = settings_.width, height = settings_.height;
    const double h = std::tan(0.5 * glm::radians(camera_.vertical_field_degrees));
    const dvec3 q = forward_ + h * (width / height) * (2.0 * (x + u.first) / width - 1.0) * right_ +
                    h * (1.0 - 2.0 * (y + u.second) / height) * upward_;
    if (camera_.lens_radius == 0.0) return {camera_.position, glm::normalize(q)};
    const dvec2 lens = camera_.lens_radius * disc(u.third, u.fourth);
    const dvec3 origin = camera_.position + lens.x * right_ + lens.y * upward_;
    return {origin, glm::normalize(camera_.position + camera_.focus_distance * q - origin)};
}

dvec3 PathSampler::background(const dvec3& direction) const {
    return glm::mix(background_.down, background_.up, 0.5 * (direction.y + 1.0));
}

dvec3 PathSampler::radiance(std::uint32_t x, std::uint32_t y, std::uint64_t sample) const {
    const std::uint32_t pixel = y * settings_.width + x;
    dvec3 throughput(1.0), light(0.0);
    Ray ray = camera_ray(x, y, sample);
    for (std::uint32_t k = 0;; ++k) {
        const std::optional<Hit> hit = world_.closest_hit(ray, settings_.ray_min, settings_.ray_max);
        if (!hit) return light + throughput * background(ray.direction);
        const Material& material = materials_[hit->material];
        const Incidence in = incidence_of(ray.direction, hit->front_normal);
        light += throughput * emitted(material, in.front);
        if (k == settings_.bounces || ends_path(material)) return light;

        const Numbers u = numbers_of(random_block(settings_.seed, pixel, sample,
            dimension::first_vertex + dimension::blocks_per_vertex * k + dimension::scatter));
        const std::optional<dvec3> scattered = material.kind == MaterialKind::diffuse
                                                   ? cosine_hemisphere(in.near_normal, u.first, u.second)
                                                   : specular_direction(material, in, u);
        if (!scattered) return light;
        throughput *= transmitted_share(material);
        const double greatest = std::max({throughput.x, throughput.y, throughput.z});
        if (greatest == 0.0) return light;
        if (k + 1 >= settings_.roulette_start) {  // section 9.3
            const double survival = std::min(1.0, greatest);
            if (!(u.fourth < survival)) return light;
            throughput /= survival;
        }
        ray = {hit->position, *scattered, hit->primitive, glm::dot(*scattered, hit->front_normal) > 0.0};
    }
}

}  // namespace tandem::oracle
