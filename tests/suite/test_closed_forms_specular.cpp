// Closed forms of mirrors and translucent bodies: Fresnel's and Schlick's reflectance, slabs, total internal
// reflection, absorption and fuzz.
#include <complex>

#include "common/scene/loader/scene_loader.h"
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// So small a field that the square of its angles, 3e-18, vanishes beside 1 in double precision: every ray is on the
// axis.
constexpr double narrow = 1e-7;  // degrees
const dvec3 red(1.0, 0.0, 0.0), green(0.0, 1.0, 0.0);

// Fresnel's reflectance of unpolarised light from index n1 to n2, by the angles themselves.
double fresnel(double n1, double n2, double angle) {
    if (angle == 0.0) return (n1 - n2) * (n1 - n2) / ((n1 + n2) * (n1 + n2));
    const double s = std::sin(angle) * n1 / n2;
    if (s >= 1.0) return 1.0;
    const double inner = std::asin(s), difference = angle - inner, sum = angle + inner;
    return 0.5 *
           (std::pow(std::sin(difference) / std::sin(sum), 2.0) + std::pow(std::tan(difference) / std::tan(sum), 2.0));
}

double schlick(double n1, double n2, double angle) {
    const double s = std::sin(angle) * n1 / n2;
    if (s >= 1.0) return 1.0;
    const double x = std::cos(n1 > n2 ? std::asin(s) : angle), r0 = fresnel(n1, n2, 0.0);
    return r0 + (1.0 - r0) * std::pow(1.0 - x, 5.0);
}

// Looks at the point (0.31, 0, 0.17) of the plane y = 0 from `angle` off its normal, above (+) or below (-).
SceneBuilder looking_at_plane(double angle, double distance) {
    const dvec3 point(0.31, 0.0, 0.17);
    return SceneBuilder().camera(
        point + distance * dvec3(std::sin(angle), std::cos(angle), 0.0), point, narrow, {0.0, 0.0, 1.0});
}

// Reflectance of a metal in air for unpolarised light, by complex numbers.
double metal_reflectance(std::complex<double> index, double cosine) {
    const std::complex<double> inner = std::sqrt(index * index - (1.0 - cosine * cosine));
    return 0.5 * (std::norm((cosine - inner) / (cosine + inner)) +
                     std::norm((index * index * cosine - inner) / (index * index * cosine + inner)));
}

// The mean over a square film of what is seen at the cosine −d_y. Midpoints err by h²; that term is taken out.
dvec3 over_film(const Camera& camera, const std::function<dvec3(double)>& seen) {
    const dvec3 f = glm::normalize(camera.target - camera.position), r = glm::normalize(glm::cross(f, camera.up));
    const dvec3 v = glm::cross(r, f);
    const double h = std::tan(glm::radians(0.5 * camera.vertical_field_degrees));
    const auto pixel = [&](double x, double y) {
        return seen(-glm::normalize(f + h * (2.0 * x - 1.0) * r + h * (1.0 - 2.0 * y) * v).y);
    };
    return (4.0 * mean_over_square(pixel, 400) - mean_over_square(pixel, 200)) / 3.0;
}

const dvec3 slab_lo(-20.0, -1.0, -20.0), slab_hi(20.0, 0.0, 20.0);

}  // namespace

TEST_CASE("a slab of index 1.5 reflects 0.0769 and transmits 0.9231 at normal incidence") {
    const double r = 0.04, reflected = 2.0 * r / (1.0 + r), transmitted = (1.0 - r) / (1.0 + r);
    CHECK(reflected == doctest::Approx(0.0769).epsilon(0.001));
    auto& all = tracers();
    // Down-going rays end in red, up-going ones in green.
    const Scene scenes[] = {
        looking_at_plane(0.0, 3.0).background(red, green).cuboid(glass(1.5), slab_lo, slab_hi).scene(),
        looking_at_plane(0.0, 3.0).background(red, green).triangle_box(glass(1.5), slab_lo, slab_hi).scene(),
        looking_at_plane(0.0, 3.0).background(red, green).sphere(glass(1.5), {0.31, -0.4, 0.17}, 0.4).scene()};
    for (const Scene& scene : scenes) {
        CAPTURE(&scene - scenes);
        check_mean(all, scene, settings_of(16, 40), 256, {transmitted, reflected, 0.0}, 32.0);
    }
}

TEST_CASE("a slab cut off after D events shows the partial sums of its reflections") {
    const double r = 0.04, t = 1.0 - r;
    auto& all = tracers();
    const Scene scene = looking_at_plane(0.0, 3.0).background(red, green).cuboid(glass(1.5), slab_lo, slab_hi).scene();
    const dvec3 partial[] = {black, {0.0, r, 0.0}, {t * t, r, 0.0}, {t * t, r + t * t * r, 0.0}};
    for (std::uint32_t bounces = 0; bounces < 4; ++bounces) {
        CAPTURE(bounces);
        check_mean(all, scene, settings_of(16, bounces), 256, partial[bounces], 32.0);
    }
}

TEST_CASE("a prism turns light by total internal reflection") {
    // Light enters from above, meets the slope at 45 degrees, and leaves through the side at right angles. What the
    // side reflects goes back the same way. The sky to the side is half red, half green.
    const double r = 0.04, returned = 2.0 * r / (1.0 + r), turned = (1.0 - r) / (1.0 + r);
    const dvec3 a(0.0, 0.0, 1.0), b(1.0, 0.0, 1.0), c(1.0, -1.0, 1.0), back(0.0, 0.0, 2.0);
    const Scene scene = SceneBuilder()
                            .camera({0.53, 3.0, 0.1}, {0.53, 0.0, 0.1}, narrow, {0.0, 0.0, 1.0})
                            .background(red, green)
                            .quad(glass(1.5), a, b, b - back, a - back)
                            .quad(glass(1.5), b, c, c - back, b - back)
                            .quad(glass(1.5), c, a, a - back, c - back)
                            .triangle(glass(1.5), a, c, b)
                            .triangle(glass(1.5), a - back, b - back, c - back)
                            .scene();
    auto& all = tracers();
    check_mean(all, scene, settings_of(16, 40), 256, {0.5 * turned, 0.5 * turned + returned, 0.0}, 64.0);
}

TEST_CASE("one reflection has Fresnel's or Schlick's reflectance") {
    auto& all = tracers();
    for (const Fresnel model : {Fresnel::exact, Fresnel::schlick}) {
        for (const double index : {1.5, 0.8}) {
            for (const double degrees : {0.0, 45.0, 75.0}) {
                CAPTURE(static_cast<int>(model));
                CAPTURE(index);
                CAPTURE(degrees);
                const double angle = glm::radians(degrees);
                const double expected =
                    model == Fresnel::exact ? fresnel(1.0, index, angle) : schlick(1.0, index, angle);
                const Scene scene = looking_at_plane(angle, 3.0)
                                        .background(white)
                                        .cuboid(glass(index, model), slab_lo, slab_hi)
                                        .scene();
                check_mean(all, scene, settings_of(8, 1), 512, dvec3(expected), 64.0);
            }
        }
    }
}

TEST_CASE(
    "light leaves the dense side by one less Fresnel's or Schlick's reflectance, and not beyond the critical angle") {
    auto& all = tracers();
    for (const Fresnel model : {Fresnel::exact, Fresnel::schlick}) {
        for (const double degrees : {0.0, 30.0, 41.0, 43.0}) {  // the critical angle is 41.8 degrees
            CAPTURE(static_cast<int>(model));
            CAPTURE(degrees);
            const double angle = glm::radians(degrees);
            const double reflected = model == Fresnel::exact ? fresnel(1.5, 1.0, angle) : schlick(1.5, 1.0, angle);
            const Scene scene = looking_at_plane(angle, -0.5)
                                    .background(white)
                                    .cuboid(glass(1.5, model), {-20.0, 0.0, -20.0}, {20.0, 0.0, 20.0})
                                    .scene();
            const Scene body =
                looking_at_plane(angle, -0.5).background(white).cuboid(glass(1.5, model), slab_lo, slab_hi).scene();
            check_mean(all, body, settings_of(8, 1), 512, dvec3(1.0 - reflected), 256.0);
            // The same plane from outside reflects as from air: index and side are told apart.
            if (degrees == 30.0) {
                const double outside = model == Fresnel::exact ? fresnel(1.0, 1.5, angle) : schlick(1.0, 1.5, angle);
                check_mean(all, scene, settings_of(8, 1), 512, dvec3(outside), 256.0);
            }
        }
    }
}

TEST_CASE("a translucent body takes (1 - alpha (1 - C)) at every surface") {
    const dvec3 colour(0.2, 0.5, 1.0), sky(1.0, 2.0, 4.0);
    auto& all = tracers();
    for (const double alpha : {0.0, 0.3, 1.0}) {
        CAPTURE(alpha);
        SceneBuilder builder = looking_at_plane(0.4, 3.0).background(sky);
        for (int body = 0; body < 3; ++body)
            builder.cuboid(glass(1.0, Fresnel::exact, alpha, colour), {-20.0, -1.5 * body - 1.0, -20.0},
                {20.0, -1.5 * body, 20.0});
        const dvec3 share = white - alpha * (white - colour);
        check_every_pixel(all, builder.scene(), settings_of(8, 12), 64, sky * glm::pow(share, dvec3(6.0)), 32.0);
    }
}

TEST_CASE("a translucent emitter adds alpha L at every surface that emits to the ray's side") {
    const dvec3 colour(0.2, 0.5, 0.9), glow(3.0, 2.0, 1.0), sky(1.0, 2.0, 4.0);
    const double alpha = 0.4;
    const dvec3 share = white - alpha * (white - colour);
    auto& all = tracers();
    for (const EmittingSides sides : {EmittingSides::both, EmittingSides::front}) {
        CAPTURE(static_cast<int>(sides));
        Material material = glass(1.0, Fresnel::exact, alpha, colour);
        material.kind = MaterialKind::emissive;
        material.radiance = glow;
        material.sides = sides;
        const Scene scene = looking_at_plane(0.4, 3.0).background(sky).cuboid(material, slab_lo, slab_hi).scene();
        const dvec3 leaving = sides == EmittingSides::both ? alpha * glow * share : black;
        check_every_pixel(all, scene, settings_of(8, 5), 64, alpha * glow + leaving + share * share * sky, 32.0);
    }
}

TEST_CASE("a fuzzy surface absorbs (1 - c/f)/2") {
    const dvec3 colour(0.2, 0.5, 1.0);
    auto& all = tracers();
    const struct { double cosine, fuzz; } cases[] = {{0.9, 0.5}, {0.3, 0.6}, {0.5, 1.0}, {0.1, 1.0}};
    for (const auto& [cosine, fuzz] : cases) {
        CAPTURE(cosine);
        CAPTURE(fuzz);
        const double kept = 1.0 - std::max(0.0, 0.5 * (1.0 - cosine / fuzz));
        const double angle = std::acos(cosine);
        const Scene reflecting =
            looking_at_plane(angle, 3.0).background(white).floor(mirror(colour, fuzz), 0.0, 50.0).scene();
        check_mean(all, reflecting, settings_of(8, 1), 512, kept * colour, 16.0);
        const Scene transmitting = looking_at_plane(angle, 3.0)
                                       .background(white)
                                       .floor(glass(1.0, Fresnel::exact, 1.0, colour, fuzz), 0.0, 50.0)
                                       .scene();
        check_mean(all, transmitting, settings_of(8, 1), 512, kept * colour, 16.0);
    }
}

// The scene files that a renderer of single precision can take: test_closed_forms_files.cpp holds all tracers to them.
TEST_CASE("the plates' mean radiance is that of Fresnel's equations over the film") {
    const auto shipped = [](const std::string& name) {
        return load_scene(TANDEM_SOURCE_DIR "/scenes/closed-forms/" + name + ".json");
    };
    const auto sky = [](const Scene& scene, double y) {
        return glm::mix(scene.background.down, scene.background.up, 0.5 * (1.0 + y));
    };
    const Scene gold = shipped("gold-plate"), pane = shipped("glass-plate");
    const Material& metal = gold.materials[gold.entities[0].material];
    const auto of_gold = [&](double c) {
        dvec3 reflectance;
        for (int i = 0; i < 3; ++i) reflectance[i] = metal_reflectance({metal.eta[i], metal.k[i]}, c);
        return reflectance * sky(gold, c);
    };
    const auto of_glass = [&](double c) {
        const double r = fresnel(1.0, 1.5, std::acos(c));
        return (1.0 - r) / (1.0 + r) * sky(pane, -c) + 2.0 * r / (1.0 + r) * sky(pane, c);
    };
    CHECK(glm::distance(over_film(gold.camera, of_gold), gold.expect->radiance) < 1e-9);
    CHECK(glm::distance(over_film(pane.camera, of_glass), pane.expect->radiance) < 1e-9);
}
