// Closed forms of direct light on a Lambertian surface. Lights are polygons (Lambert's formula), spheres, boxes and a
// sky that is linear in height, by scattering alone and by light sampling.
#include <numbers>

#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double pi = std::numbers::pi;
const dvec3 floor_colour(0.6, 0.3, 0.9);

// Irradiance per unit radiance at x, normal n, from a polygon wholly above the horizon [Lambert 1760].
double polygon_irradiance(const std::vector<dvec3>& polygon, const dvec3& x, const dvec3& n) {
    double sum = 0.0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const dvec3 a = glm::normalize(polygon[i] - x), b = glm::normalize(polygon[(i + 1) % polygon.size()] - x);
        sum += std::acos(glm::dot(a, b)) * glm::dot(glm::normalize(glm::cross(a, b)), n);
    }
    return 0.5 * std::abs(sum);
}

// Irradiance per unit radiance from a sphere at a distance of 1/sine radii, at `cosine` from the normal. The sphere may
// dip below the horizon. [Snyder 1996, as in Lagarde, de Rousiers: Moving Frostbite to physically based rendering,
// 2014]
double sphere_irradiance(double sine, double cosine) {
    if (cosine >= sine) return pi * sine * sine * cosine;
    const double theta_sine = std::sqrt(1.0 - cosine * cosine), x = std::sqrt(1.0 / (sine * sine) - 1.0);
    const double y = -x * (cosine / theta_sine), z = theta_sine * std::sqrt(1.0 - y * y);
    return (cosine * std::acos(y) - x * z) * sine * sine + std::atan(z / x);
}

// A grey floor at y = 0 seen from the side; the view holds no light.
SceneBuilder floor_scene() {
    return SceneBuilder().camera({3.0, 1.0, 0.5}, {0.2, 0.0, 0.1}, 4.0).floor(diffuse(floor_colour), 0.0, 20.0);
}

// Mean over the image of f(point on the floor).
double mean_over_floor(const Scene& scene, const std::function<double(const dvec3&)>& f) {
    const Camera& camera = scene.camera;
    const dvec3 forward = glm::normalize(camera.target - camera.position);
    const dvec3 right = glm::normalize(glm::cross(forward, camera.up)), upward = glm::cross(right, forward);
    const double h = std::tan(glm::radians(camera.vertical_field_degrees) / 2.0);
    return mean_over_square(
        [&](double u, double v) {
            const dvec3 q = forward + h * (2.0 * u - 1.0) * right + h * (1.0 - 2.0 * v) * upward;
            return dvec3(f(camera.position - (camera.position.y / q.y) * q));
        },
        64)
        .x;
}

void check_floor(const Scene& scene, const dvec3& expected) {
    auto& all = tracers();
    // With one bounce, next events are all the light that whitted has to find.
    for (const Integrator integrator : {Integrator::path, Integrator::next_event, Integrator::whitted}) {
        CAPTURE(static_cast<int>(integrator));
        check_mean(all, scene, settings_of(16, 1, integrator), 512, expected, 32.0);
    }
    RenderSettings without_mis = settings_of(16, 1, Integrator::next_event);
    without_mis.mis = false;
    check_mean(all, scene, without_mis, 512, expected, 32.0);
}

const dvec3 up(0.0, 1.0, 0.0);
const std::vector<dvec3> lamp{
    {-0.8, 1.2, -0.6}, {0.7, 1.2, -0.6}, {0.7, 1.2, 0.9}, {-0.8, 1.2, 0.9}};  // front side down

dvec3 lit_by_polygon(const Scene& scene, const std::vector<dvec3>& polygon, const dvec3& radiance) {
    const auto irradiance = [&](const dvec3& x) { return polygon_irradiance(polygon, x, up); };
    return floor_colour / pi * radiance * mean_over_floor(scene, irradiance);
}

}  // namespace

TEST_CASE("a floor under a polygon light obeys Lambert's formula, one-sided and two-sided") {
    const dvec3 radiance(5.0, 3.0, 1.0);
    for (const EmittingSides sides : {EmittingSides::both, EmittingSides::front}) {
        CAPTURE(static_cast<int>(sides));
        const Scene scene = floor_scene().quad(emitter(radiance, sides), lamp[0], lamp[1], lamp[2], lamp[3]).scene();
        check_floor(scene, lit_by_polygon(scene, lamp, radiance));
    }
}

TEST_CASE("a floor behind a one-sided light stays dark") {
    const Scene scene =
        floor_scene().quad(emitter(white, EmittingSides::front), lamp[3], lamp[2], lamp[1], lamp[0]).scene();
    check_floor(scene, black);
}

TEST_CASE("a tilted triangle light under a transform obeys Lambert's formula") {
    const dmat4 placed = moved({0.2, 1.5, 0.1}) * rotated(25.0, {1.0, 0.3, 0.2}) * scaled({1.5, 1.0, -0.8});
    const dvec3 corners[] = {{-0.5, 0.0, -0.5}, {0.6, 0.0, -0.4}, {0.1, 0.0, 0.7}};
    std::vector<dvec3> polygon;
    for (const dvec3& corner : corners) polygon.push_back(dvec3(placed * glm::dvec4(corner, 1.0)));
    const dvec3 radiance(4.0, 8.0, 2.0);
    const Scene scene = floor_scene().triangle(emitter(radiance), corners[0], corners[1], corners[2], placed).scene();
    check_floor(scene, lit_by_polygon(scene, polygon, radiance));
}

TEST_CASE("lights of unequal size and radiance add up") {
    const std::vector<dvec3> small{{0.9, 0.9, -1.2}, {1.2, 0.9, -1.2}, {1.2, 0.9, -0.9}, {0.9, 0.9, -0.9}};
    const dvec3 red(2.0, 0.1, 0.1), green(0.2, 40.0, 3.0);
    const Scene scene = floor_scene()
                            .quad(emitter(red), lamp[0], lamp[1], lamp[2], lamp[3])
                            .quad(emitter(green), small[0], small[1], small[2], small[3])
                            .scene();
    check_floor(scene, lit_by_polygon(scene, lamp, red) + lit_by_polygon(scene, small, green));
}

TEST_CASE("a box light shines by the faces that look at the floor") {
    const dvec3 lo(-0.9, 0.7, -0.6), hi(-0.3, 1.4, 0.4), radiance(3.0, 2.0, 1.0);
    const Scene scene = floor_scene().cuboid(emitter(radiance, EmittingSides::front), lo, hi).scene();
    const std::vector<dvec3> bottom{{lo.x, lo.y, lo.z}, {hi.x, lo.y, lo.z}, {hi.x, lo.y, hi.z}, {lo.x, lo.y, hi.z}};
    const std::vector<dvec3> right{{hi.x, lo.y, lo.z}, {hi.x, hi.y, lo.z}, {hi.x, hi.y, hi.z}, {hi.x, lo.y, hi.z}};
    // Every point of the view lies between the z of the box, and right of it: the others face away.
    check_floor(scene, lit_by_polygon(scene, bottom, radiance) + lit_by_polygon(scene, right, radiance));
}

TEST_CASE("a sphere light above a floor gives a L (rho/delta)^2 cos") {
    const dvec3 centre(-0.2, 1.3, -0.4), radiance(2.0, 4.0, 1.0);
    const double radius = 0.5;
    const auto irradiance = [&](const dvec3& x) {
        const double distance = glm::distance(centre, x);
        return sphere_irradiance(radius / distance, centre.y / distance);
    };
    for (const dmat4& placed : {moved(centre) * scaled(dvec3(radius)),
             moved(centre) * rotated(50.0, {1.0, 2.0, 3.0}) * scaled({-radius, radius, radius})}) {
        const Scene scene = floor_scene().sphere(emitter(radiance), black, 1.0, placed).scene();
        check_floor(scene, floor_colour / pi * radiance * mean_over_floor(scene, irradiance));
    }
}

TEST_CASE("a sphere light partly below the horizon gives Snyder's integral") {
    const dvec3 radiance(2.0, 4.0, 1.0);
    const double radius = 0.6;
    for (const double height : {0.3, -0.2}) {
        CAPTURE(height);
        const dvec3 centre(-1.2, height, 0.0);
        const auto irradiance = [&](const dvec3& x) {
            const double distance = glm::distance(centre, x);
            return sphere_irradiance(radius / distance, height / distance);
        };
        const Scene scene = floor_scene().sphere(emitter(radiance), centre, radius).scene();
        check_floor(scene, floor_colour / pi * radiance * mean_over_floor(scene, irradiance));
    }
}

TEST_CASE("a floor point at the centre of a luminous sphere shows a L, unless the sphere lies beyond the ray's end") {
    auto& all = tracers();
    const dvec3 radiance(1.0, 2.0, 3.0), sky(0.5, 0.25, 0.125);
    const Scene scene = SceneBuilder()
                            .camera({1.0, 1.0, 0.0}, black, 1.0)
                            .background(sky)
                            .floor(diffuse(floor_colour), 0.0, 2.0)
                            .sphere(emitter(radiance), black, 10.0)
                            .scene();
    for (const Integrator integrator : {Integrator::path, Integrator::next_event}) {
        CAPTURE(static_cast<int>(integrator));
        RenderSettings settings = settings_of(16, 1, integrator);
        check_mean(all, scene, settings, 128, floor_colour * radiance, 8.0);
        settings.ray_max = 9.0;
        check_mean(all, scene, settings, 128, floor_colour * sky, 8.0);
        settings.ray_max = 12.0;
        settings.ray_min = 10.5;  // the floor itself is passed over for the sphere behind it
        check_mean(all, scene, settings, 128, radiance, 8.0);
    }
}

TEST_CASE("a floor within a luminous ellipsoid, a moving sphere or a moving box shows a L") {
    auto& all = tracers();
    const dvec3 radiance(1.0, 2.0, 3.0);
    const dmat4 stretched = moved({0.5, 0.3, -0.2}) * rotated(50.0, {1.0, 2.0, 3.0}) * scaled({6.0, 9.0, 4.0});
    const auto around = [&](const dmat4& placed, bool box, const dvec3& motion) {
        SceneBuilder builder;
        builder.camera({1.0, 1.0, 0.0}, black, 1.0).floor(diffuse(floor_colour), 0.0, 2.0);
        if (box)
            builder.cuboid(emitter(radiance), dvec3(-1.0), dvec3(1.0), placed);
        else
            builder.sphere(emitter(radiance), black, 1.0, placed);
        Scene scene = builder.scene();
        scene.entities.back().motion = motion;
        return scene;
    };
    for (const Scene& scene : {around(stretched, false, black), around(stretched, false, {1.0, -0.5, 0.7}),
             around(scaled(dvec3(8.0)), false, {2.0, 1.0, -1.0}), around(scaled(dvec3(8.0)), true, {2.0, 1.0, -1.0})})
        for (const Integrator integrator : {Integrator::path, Integrator::next_event, Integrator::whitted}) {
            CAPTURE(static_cast<int>(integrator));
            check_mean(all, scene, settings_of(16, 1, integrator), 128, floor_colour * radiance, 8.0);
        }
}
