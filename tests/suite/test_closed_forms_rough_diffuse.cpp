// Closed forms of rough diffuse surfaces (MODEL.md section 7.9), by Oren and Nayar's angles and by quadrature.
#include <numbers>

#include "tests/suite/effects.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double pi = std::numbers::pi;
const dvec3 clay(0.9, 0.6, 0.3);

dvec3 direction_at(double angle, double azimuth) {
    return {std::sin(angle) * std::cos(azimuth), std::cos(angle), std::sin(angle) * std::sin(azimuth)};
}

// Looks at `aim` from `angle` off the normal, azimuth 0.
SceneBuilder looking_down(double angle) {
    return SceneBuilder().camera(aim + 3.0 * direction_at(angle, 0.0), aim, narrow_field, {0.0, 0.0, 1.0});
}

// pi f/C.
double share(double sigma, double theta_i, double theta_o, double azimuth) {
    const double variance = sigma * sigma;
    const double a = 1.0 - 0.5 * variance / (variance + 0.33), b = 0.45 * variance / (variance + 0.09);
    return a + b * std::max(0.0, std::cos(azimuth)) * std::sin(std::max(theta_i, theta_o)) *
                   std::tan(std::min(theta_i, theta_o));
}

}  // namespace

TEST_CASE("a rough diffuse floor in the sun shows Oren and Nayar's share of the light, from either end") {
    auto& all = tracers();
    const dvec3 irradiance(3.0, 2.0, 1.0);
    for (const double sigma : {0.1, 0.4, 1.0})
        for (const auto& [eye, sun_angle, azimuth] :
            {std::array{1.0, 0.5, 0.3}, {0.5, 1.0, 0.3}, {1.3, 1.2, 1.0}, {0.7, 1.1, 2.5}, {0.0, 0.8, 0.0}}) {
            CAPTURE(sigma);
            CAPTURE(eye);
            CAPTURE(azimuth);
            const dvec3 expected =
                irradiance * clay * (std::cos(sun_angle) * share(sigma, eye, sun_angle, azimuth) / pi);
            const Scene scene = with_light(looking_down(eye).floor(rough_diffuse(clay, sigma), 0.0, 50.0).scene(),
                sun(-direction_at(sun_angle, azimuth), irradiance));
            check_every_pixel(all, scene, settings_of(4, 1, Integrator::next_event), 64, expected, 512.0);
        }
}

TEST_CASE("a rough diffuse floor keeps of an uneven sky what its quadrature says, by scattering and light sampling") {
    auto& all = tracers();
    const dvec3 down(2.0, 0.0, 1.0), up(0.5, 1.0, 2.0);
    for (const auto& [sigma, angle] : {std::pair{0.3, 1.2}, {0.8, 0.4}, {1.0, 1.3}}) {
        CAPTURE(sigma);
        const dvec3 mean = mean_over_square(
            [&, sigma = sigma, angle = angle](double u, double v) {
                const double cosine = std::sqrt(u), azimuth = 2.0 * pi * v;  // by the cosine
                return glm::mix(down, up, 0.5 * (cosine + 1.0)) * share(sigma, angle, std::acos(cosine), azimuth);
            },
            1000);
        Scene scene = looking_down(angle).background(down, up).floor(rough_diffuse(clay, sigma), 0.0, 50.0).scene();
        check_mean(all, scene, settings_of(8, 1), 512, clay * mean, 128.0);
        scene.background.sampled = true;
        check_mean(all, scene, settings_of(8, 1, Integrator::next_event), 512, clay * mean, 128.0);
    }
}

TEST_CASE("a rough diffuse surface of roughness 0 has the bits of a diffuse one") {
    for (Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        for (const Integrator integrator : {Integrator::path, Integrator::next_event}) {
            const auto image = [&](const Material& material) {
                const Scene scene = SceneBuilder()
                                        .camera({0.0, 1.5, 5.0}, {0.0, 0.5, 0.0}, 50.0)
                                        .background(dvec3(0.2), dvec3(0.5, 0.6, 0.9))
                                        .floor(material, 0.0, 20.0)
                                        .sphere(material, {0.0, 0.6, 0.0}, 0.5)
                                        .sphere(emitter(dvec3(4.0)), {1.0, 2.0, 0.5}, 0.3)
                                        .scene();
                const RenderSettings settings = settings_of(8, 4, integrator);
                return mean_of(render(tracer, scene, settings, 16));
            };
            CHECK(image(rough_diffuse(clay, 0.0)) == image(diffuse(clay)));
            CHECK(image(rough_diffuse(clay, 0.3)) != image(diffuse(clay)));
        }
    }
}
