// Closed forms of lights beyond surfaces: suns, points, spots, and the background as ambient and as sampled light.
#include <numbers>

#include "tests/suite/effects.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double pi = std::numbers::pi;
const dvec3 colour(0.6, 0.3, 0.9), power(3.0, 1.0, 2.0), up(0.0, 1.0, 0.0);

// A floor seen at `aim`.
SceneBuilder floor_view(const Material& material) {
    return SceneBuilder()
        .camera(aim + dvec3(1.0, 2.0, 0.5), aim, narrow_field, {0.0, 0.0, 1.0})
        .floor(material, 0.0, 50.0);
}

void check_lit(std::vector<Tracer>& all, const Scene& scene, const dvec3& expected,
    Integrator integrator = Integrator::next_event) {
    check_every_pixel(all, scene, settings_of(4, 1, integrator), 64, expected, 128.0);
}

PunctualLight spot_light(const dvec3& position, const dvec3& direction, double inner, double outer) {
    PunctualLight light = point_light(position, power);
    light.kind = PunctualKind::spot;
    light.direction = glm::normalize(direction);
    light.inner_degrees = inner;
    light.outer_degrees = outer;
    return light;
}

// Mean of the sky over the cosine hemisphere of a normal.
dvec3 cosine_mean(const std::function<dvec3(const dvec3&)>& sky, const dvec3& normal, int steps) {
    const dvec3 tangent = glm::normalize(glm::cross(normal, {0.31, 0.2, 0.9})), bitangent = glm::cross(normal, tangent);
    return mean_over_square(
        [&](double u, double v) {
            const double r = std::sqrt(u), phi = 2.0 * pi * v;
            return sky(r * std::cos(phi) * tangent + r * std::sin(phi) * bitangent + std::sqrt(1.0 - u) * normal);
        },
        steps);
}

// Scattering alone, and light sampling with the background sampled or not.
void check_sky(std::vector<Tracer>& all, Scene scene, std::uint32_t bounces, const dvec3& expected) {
    for (const bool sampled : {false, true}) {
        CAPTURE(sampled);
        scene.background.sampled = sampled;
        for (const Integrator integrator : {Integrator::path, Integrator::next_event}) {
            CAPTURE(static_cast<int>(integrator));
            check_mean(all, scene, settings_of(16, bounces, integrator), 512, expected, 128.0);
        }
        RenderSettings without_mis = settings_of(16, bounces, Integrator::next_event);
        without_mis.mis = false;
        check_mean(all, scene, without_mis, 512, expected, 128.0);
        // Next events alone are all the light of one bounce.
        if (sampled && bounces == 1)
            check_mean(all, scene, settings_of(16, 1, Integrator::whitted), 512, expected, 128.0);
    }
}

// A sky of one bright texel beside dim ones, turned.
Background image_sky() {
    Pixels pixels = *some_pixels(6, 4);
    pixels.rgb[3 * 8 + 1] = 20.0F;
    Background background;
    background.image = std::make_shared<const Pixels>(std::move(pixels));
    background.image_scale = 1.5;
    background.rotation_degrees = 35.0;
    return background;
}

// B(d) of MODEL.md section 8.1 by the azimuth: a point at azimuth phi about +y, from x towards -z, has u = 1/2 +
// phi/2π.
dvec3 image_radiance(const Background& sky, const dvec3& d) {
    const double phi = std::atan2(-d.z, d.x) - glm::radians(sky.rotation_degrees);
    double u = 0.5 + phi / (2.0 * pi);
    u -= std::floor(u);
    return sky.image_scale * interpolated(*sky.image, u, std::acos(std::clamp(-d.y, -1.0, 1.0)) / pi, false);
}

}  // namespace

TEST_CASE("a floor under a sun shows E C cos / pi, and nothing from below it") {
    auto& all = tracers();
    const dvec3 direction(0.3, -1.0, 0.4);
    const Scene lit = with_light(floor_view(diffuse(colour)).scene(), sun(direction, power));
    check_lit(all, lit, colour / pi * power * -glm::normalize(direction).y);
    check_lit(all, with_light(floor_view(diffuse(colour)).scene(), sun(-direction, power)), black);
    const Scene shadowed = floor_view(diffuse(colour)).sphere(mirror(white), aim - 3.0 * direction, 1.0).scene();
    check_lit(all, with_light(shadowed, sun(direction, power)), black);
    // Two add up; each path samples one of them.
    check_mean(all, with_light(lit, sun({0.0, -1.0, 0.0}, white)), settings_of(16, 1, Integrator::next_event), 256,
        colour / pi * (power * -glm::normalize(direction).y + white), 128.0);
}

TEST_CASE("a floor under a point light shows I C cos / (pi r^2)") {
    auto& all = tracers();
    const dvec3 lamp(-0.7, 1.5, 0.4);
    const double r = glm::length(lamp);
    const Scene lit = with_light(floor_view(diffuse(colour)).scene(), point_light(aim + lamp, power));
    check_lit(all, lit, colour / pi * power * lamp.y / (r * r * r));
    check_lit(all, with_light(floor_view(diffuse(colour)).scene(), point_light(aim - lamp, power)), black);
    const auto with_blocker = [&](double at) {
        return with_light(floor_view(diffuse(colour)).sphere(glass(1.5), aim + at * lamp, 0.1).scene(),
            point_light(aim + lamp, power));
    };
    check_lit(all, with_blocker(0.5), black, Integrator::whitted);  // translucent bodies block
    const dvec3 beyond = colour / pi * power * lamp.y / (r * r * r);
    check_lit(all, with_blocker(1.5), beyond, Integrator::whitted);
}

TEST_CASE("no tracer leaves black without a word what a point light would reach through glass") {
    const Scene scene =
        with_light(floor_view(diffuse(colour)).sphere(glass(1.5), aim + dvec3(0.0, 1.0, 0.0), 0.1).scene(),
            point_light(aim + dvec3(0.0, 2.0, 0.0), power));
    for (Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        CHECK_THROWS_AS(
            (void)tracer.renderer->prepare(scene, settings_of(4, 1, Integrator::next_event)), UnsupportedError);
    }
}

TEST_CASE("a spot falls off between its inner and its outer angle") {
    const dvec3 lamp(-0.7, 1.5, 0.4);
    const double r = glm::length(lamp);
    const dvec3 full = colour / pi * power * lamp.y / (r * r * r);
    constexpr double cancelled = 16384.0;  // roundings: cosines are subtracted, down to a tenth and less
    for (const double degrees : {0.0, 10.0, 20.0, 27.0, 29.9, 31.0, 100.0}) {
        CAPTURE(degrees);
        const dvec3 axis = dvec3(rotated(degrees, {0.2, 0.3, 1.0}) * glm::dvec4(0.0, -1.0, 0.0, 0.0));
        const double cosine = glm::dot(axis, -lamp) / r;
        const double inner = std::cos(glm::radians(15.0)), outer = std::cos(glm::radians(30.0));
        const double t = std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0);
        const Scene scene = with_light(floor_view(diffuse(colour)).scene(), spot_light(aim + lamp, axis, 15.0, 30.0));
        auto& all = tracers();
        check_mean(
            all, scene, settings_of(4, 1, Integrator::next_event), 64, t * t * (3.0 - 2.0 * t) * full, cancelled);
    }
}

TEST_CASE("a punctual light beyond the ray's end, or before its beginning, is not reached") {
    const dvec3 lamp(0.0, 2.0, 0.0);
    const Scene scene = with_light(floor_view(diffuse(colour)).scene(), point_light(aim + lamp, power));
    auto& all = tracers();
    const struct {
        double ray_min, ray_max;
        dvec3 expected;
    } cases[] = {{0.0, 2.5, colour / pi * power / 4.0}, {1.9, 10.0, colour / pi * power / 4.0}, {2.1, 10.0, black}};
    for (const auto& [ray_min, ray_max, expected] : cases) {
        CAPTURE(ray_min);
        RenderSettings settings = settings_of(4, 1, Integrator::next_event);
        settings.ray_min = ray_min;
        settings.ray_max = ray_max;
        check_every_pixel(all, scene, settings, 64, expected, 128.0);
    }
}

TEST_CASE("punctual lights beside a lamp and a sampled sky add up") {
    // The lamp hides its part of the sky.
    auto& all = tracers();
    const dvec3 lamp_at(0.2, 1.1, -0.3), point(-0.9, 1.2, 0.6), from(0.5, -1.0, 0.3), glow(4.0, 2.0, 6.0),
        sky(0.3, 0.5, 0.2);
    const double radius = 0.4, distance = glm::length(lamp_at), r = glm::length(point);
    const double lamp_share = radius * radius / (distance * distance) * lamp_at.y / distance;
    Scene scene = floor_view(diffuse(colour)).background(sky).sphere(emitter(glow), aim + lamp_at, radius).scene();
    scene.background.sampled = true;
    scene = with_light(with_light(scene, point_light(aim + point, power)), sun(from, white));
    const dvec3 expected = colour * (lamp_share * glow + (1.0 - lamp_share) * sky + power * point.y / (pi * r * r * r) +
                                        white * -glm::normalize(from).y / pi);
    check_mean(all, scene, settings_of(16, 1, Integrator::next_event), 512, expected, 128.0);
}

TEST_CASE("whitted shows direct light and specular chains alone") {
    // The sky's light, found by scattering, does not show.
    const dvec3 direction(0.0, -1.0, 0.0);
    const Scene scene = with_light(floor_view(diffuse(colour)).background(white).scene(), sun(direction, power));
    auto& all = tracers();
    check_every_pixel(all, scene, settings_of(4, 5, Integrator::whitted), 64, colour / pi * power, 128.0);
    const Scene by_mirror =
        with_light(SceneBuilder()
                       .camera({1.0, 1.0, 0.1}, {0.0, 0.0, 0.1}, narrow_field)
                       .quad(mirror(colour), {-5.0, 0.0, 5.0}, {5.0, 0.0, 5.0}, {5.0, 0.0, -4.0}, {-5.0, 0.0, -4.0})
                       .quad(diffuse(colour), {-1.0, 0.1, 3.0}, {-1.0, 0.1, -3.5}, {-1.0, 5.0, -3.5}, {-1.0, 5.0, 3.0})
                       .scene(),
            sun({-1.0, -1.0, 0.0}, power));
    check_every_pixel(all, by_mirror, settings_of(4, 5, Integrator::whitted), 64,
        colour * colour / pi * power * std::sqrt(0.5), 128.0);
}

TEST_CASE("a tilted plane under a sky linear in height, sampled or not, shows the mean over its cosines") {
    auto& all = tracers();
    const dvec3 down(0.2, 3.0, 1.0), top(2.0, 0.1, 1.0);
    for (const double degrees : {0.0, 70.0, 160.0}) {
        CAPTURE(degrees);
        const dmat4 tilt = rotated(degrees, {1.0, 0.0, 0.3});
        const dvec3 normal = dvec3(tilt * glm::dvec4(up, 0.0));
        // By linearity: the mean direction over the cosines is 2/3 of the normal.
        const dvec3 expected = colour * glm::mix(down, top, 0.5 * (1.0 + 2.0 / 3.0 * normal.y));
        const Scene scene =
            SceneBuilder()
                .camera(3.0 * normal + dvec3(0.4, 0.1, 0.2), {0.02, 0.0, 0.0}, narrow_field, {0.3, 0.5, 1.0})
                .background(down, top)
                .cuboid(diffuse(colour), {-9.0, -0.5, -9.0}, {9.0, 0.0, 9.0}, tilt)
                .scene();
        check_sky(all, scene, 1, expected);
    }
}

TEST_CASE("an image of the sky is seen where it is, and turned") {
    auto& all = tracers();
    for (const dvec3& direction : {dvec3(1.0, 0.2, 0.3), dvec3(-0.4, -0.6, 0.7), dvec3(0.1, 2.0, 0.2),
             dvec3(-1.0, 0.1, -0.9), dvec3(0.05, -3.0, -0.1)}) {
        CAPTURE(direction.x);
        Scene scene = SceneBuilder().camera(black, direction, narrow_field, {0.3, 0.5, 1.0}).scene();
        scene.background = image_sky();
        check_every_pixel(
            all, scene, settings_of(4, 0), 64, image_radiance(scene.background, glm::normalize(direction)), 1000.0);
    }
}

TEST_CASE("a tilted plane under an image of the sky, sampled or not, shows the mean over its cosines") {
    auto& all = tracers();
    for (const double degrees : {0.0, 110.0}) {
        CAPTURE(degrees);
        const dmat4 tilt = rotated(degrees, {1.0, 0.0, 0.3});
        const dvec3 normal = dvec3(tilt * glm::dvec4(up, 0.0));
        Scene scene = SceneBuilder()
                          .camera(3.0 * normal + dvec3(0.4, 0.1, 0.2), {0.02, 0.0, 0.0}, narrow_field, {0.3, 0.5, 1.0})
                          .cuboid(diffuse(colour), {-9.0, -0.5, -9.0}, {9.0, 0.0, 9.0}, tilt)
                          .scene();
        scene.background = image_sky();
        const auto sky = [&](const dvec3& d) { return image_radiance(scene.background, d); };
        check_sky(all, scene, 1, colour * cosine_mean(sky, normal, 400));
    }
}

TEST_CASE("a medium under a sampled sky keeps the even sky's radiance") {
    auto& all = tracers();
    Scene scene = with_medium(SceneBuilder()
                                  .camera({0.0, 0.5, 3.0}, black, 30.0)
                                  .background(white)
                                  .sphere(diffuse(white), {0.0, 0.0, 0.0}, 0.5)
                                  .sphere(boundary(), {0.0, 0.9, 0.0}, 0.3)
                                  .scene(),
        medium_of(black, dvec3(2.0), 0.5));
    scene.background.sampled = true;
    check_mean(all, scene, settings_of(16, 100, Integrator::next_event), 256, white, 512.0);
}
