// Closed forms whose paths all carry the same radiance: furnaces, mirror corridors, convex bodies under an even sky.
// They count bounces and give away a single ray that leaks or finds its own surface.
#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

// E (1 - a^(D+1)) / (1 - a): what an enclosure of albedo a that emits E shows after D bounces.
dvec3 furnace(const dvec3& emitted, const dvec3& albedo, double bounces) {
    return emitted * (white - glm::pow(albedo, dvec3(bounces + 1.0))) / (white - albedo);
}

// A path of D bounces rounds the albedo, D products, E and D + 1 sums.
double furnace_roundings(double bounces) { return 3.0 * bounces + 8.0; }

const dvec3 emitted(1.0, 2.0, 0.25), albedo(0.5, 0.8, 0.99);

SceneBuilder enclosure() { return SceneBuilder().camera({0.1, 0.05, -0.2}, {0.3, -0.2, -1.0}, 100.0); }

const dmat4 skewed = moved({0.1, 0.0, 0.1}) * rotated(33.0, {1.0, 2.0, 3.0}) * scaled({1.0, 2.5, 0.7});

void check_furnace(const Scene& scene, std::uint32_t bounces) {
    CAPTURE(bounces);
    auto& all = tracers();
    check_every_pixel(
        all, scene, settings_of(8, bounces), 64, furnace(emitted, albedo, bounces), furnace_roundings(bounces));
}

}  // namespace

TEST_CASE("a furnace holds E (1 - a^(D+1)) / (1 - a) at every depth D") {
    const Scene scene = enclosure().sphere(diffuse(albedo, emitted), {0.0, 0.0, 0.0}, 1.0).scene();
    for (const std::uint32_t bounces : {0u, 1u, 2u, 5u, 40u}) check_furnace(scene, bounces);
}

TEST_CASE("a furnace of a cuboid leaks nowhere") {
    check_furnace(enclosure().cuboid(diffuse(albedo, emitted), {-1.0, -0.6, -2.0}, {1.5, 0.7, 1.0}).scene(), 20);
}

TEST_CASE("a furnace of triangles leaks nowhere") {
    check_furnace(enclosure().triangle_box(diffuse(albedo, emitted), {-1.0, -0.6, -2.0}, {1.5, 0.7, 1.0}).scene(), 20);
}

TEST_CASE("a furnace of an ellipsoid leaks nowhere") {
    check_furnace(enclosure().sphere(diffuse(albedo, emitted), black, 1.0, skewed).scene(), 20);
}

TEST_CASE("a furnace of an oriented box leaks nowhere") {
    check_furnace(enclosure().cuboid(diffuse(albedo, emitted), dvec3(-1.0), dvec3(1.0), skewed).scene(), 20);
}

TEST_CASE("a sphere within a sphere and a box in a furnace keep its radiance") {
    const Material wall = diffuse(albedo, emitted);
    check_furnace(enclosure()
                      .sphere(wall, black, 2.0)
                      .sphere(wall, {0.4, 0.1, -1.0}, 0.3)
                      .cuboid(wall, {-0.8, -0.9, -1.2}, {-0.3, -0.4, -0.7}, rotated(20.0, {0.0, 1.0, 0.5}))
                      .scene(),
        20);
}

TEST_CASE("a furnace keeps its radiance far from the origin and at any size") {
    for (const double size : {1e-3, 1e3}) {
        CAPTURE(size);
        const dvec3 centre = size * dvec3(30.0, -20.0, 10.0);
        const Scene scene = SceneBuilder()
                                .camera(centre, centre + size * dvec3(0.1, 0.2, -1.0), 100.0)
                                .sphere(diffuse(albedo, emitted), centre, size)
                                .scene();
        check_furnace(scene, 12);
    }
}

TEST_CASE("roulette keeps the mean of a furnace") {
    const dvec3 grey(0.8);
    const Scene scene = enclosure().cuboid(diffuse(grey, white), dvec3(-1.0), dvec3(1.0)).scene();
    auto& all = tracers();
    for (const std::uint32_t start : {1u, 3u}) {
        CAPTURE(start);
        RenderSettings settings = settings_of(16, 30);
        settings.roulette_start = start;
        check_mean(all, scene, settings, 128, furnace(white, grey, 30), 100.0);
    }
}

TEST_CASE("roulette keeps the mean of a furnace whose channels differ") {
    const dvec3 colour(0.9, 0.5, 0.2);
    const Scene scene = enclosure().sphere(diffuse(colour, white), black, 1.0).scene();
    auto& all = tracers();
    RenderSettings settings = settings_of(16, 12);
    settings.roulette_start = 2;
    check_mean(all, scene, settings, 128, furnace(white, colour, 12), 50.0);
}

TEST_CASE("light sampling keeps the mean of a furnace, seen from within") {
    auto& all = tracers();
    const Material wall = diffuse(dvec3(0.5, 0.6, 0.7), white);
    const Scene scenes[] = {enclosure().sphere(wall, black, 1.0).scene(),
        enclosure().cuboid(wall, {-1.0, -0.6, -2.0}, {1.5, 0.7, 1.0}).scene(),
        enclosure().triangle_box(wall, {-1.0, -0.6, -2.0}, {1.5, 0.7, 1.0}, rotated(15.0, {1.0, 1.0, 0.0})).scene()};
    for (const Scene& scene : scenes) {
        CAPTURE(&scene - scenes);
        check_mean(
            all, scene, settings_of(16, 4, Integrator::next_event), 256, furnace(white, {0.5, 0.6, 0.7}, 4), 20.0);
    }
}

TEST_CASE("a mirror corridor shows F^k after k reflections, and nothing with fewer bounces allowed") {
    const dvec3 colour(0.9, 0.5, 1.0), glow(2.0, 1.0, 0.5);
    auto& all = tracers();
    for (const int k : {0, 1, 2, 5, 8}) {
        // Unfolded, the corridor -1 < x < 1 ends 4 away; the middle of its k-th image lies at x = 2 k.
        CAPTURE(k);
        const Scene scene =
            SceneBuilder()
                .camera(black, {2.0 * k, 0.02, -4.0}, 0.5)
                .cuboid(mirror(colour), {1.0, -9.0, -5.0}, {1.5, 9.0, 5.0})
                .quad(mirror(colour), {-1.0, -9.0, 5.0}, {-1.0, -9.0, -5.0}, {-1.0, 9.0, -5.0}, {-1.0, 9.0, 5.0})
                .quad(emitter(glow), {-2.0, -9.0, -4.0}, {2.0, -9.0, -4.0}, {2.0, 9.0, -4.0}, {-2.0, 9.0, -4.0})
                .scene();
        const auto bounces = static_cast<std::uint32_t>(k);
        const dvec3 expected = glow * glm::pow(colour, dvec3(k));
        check_every_pixel(all, scene, settings_of(4, bounces), 64, expected, 2.0 * k + 4.0);
        if (k > 0) check_every_pixel(all, scene, settings_of(4, bounces - 1), 64, black, 0.0);
    }
}

TEST_CASE("a pane of glass as thin as rounding is left by the face that a ray comes to") {
    const auto builder = [] { return SceneBuilder().camera({3.0, 2.5, 6.0}, black, 40.0).background(white); };
    auto& all = tracers();
    for (const double thickness : {1e-5, 1e-7}) {
        CAPTURE(thickness);
        const dvec3 low(-2.0, 0.5, -1.0), high(2.0, 0.5 + thickness, 1.0);
        check_every_pixel(all, builder().cuboid(glass(1.5), low, high).scene(), settings_of(8, 100), 64, white, 64.0);
        check_every_pixel(
            all, builder().cuboid(glass(1.5), low, high, skewed).scene(), settings_of(8, 100), 64, white, 64.0);
    }
}

TEST_CASE("a ray that starts on a ball of glass and goes inside enters it") {
    const Scene scene =
        SceneBuilder().camera({1.0, 0.0, 0.0}, black, 60.0).background(white).sphere(glass(1.5), black, 1.0).scene();
    auto& all = tracers();
    check_every_pixel(all, scene, settings_of(8, 100), 64, white, 64.0);
}

TEST_CASE("a convex diffuse body under an even sky shows a E") {
    const dvec3 colour(0.2, 0.5, 1.0), sky(1.0, 2.0, 3.0);
    const auto builder = [&] { return SceneBuilder().camera({2.0, 3.0, 4.0}, black, 5.0).background(sky); };
    const Scene scenes[] = {builder().sphere(diffuse(colour), black, 1.0).scene(),
        builder().cuboid(diffuse(colour), dvec3(-1.0), dvec3(1.0)).scene(),
        builder().triangle_box(diffuse(colour), dvec3(-1.0), dvec3(1.0)).scene(),
        builder().sphere(diffuse(colour), black, 1.0, skewed).scene(),
        builder().cuboid(diffuse(colour), dvec3(-1.0), dvec3(1.0), skewed).scene()};
    auto& all = tracers();
    for (const Scene& scene : scenes) {
        CAPTURE(&scene - scenes);
        check_every_pixel(all, scene, settings_of(16, 3), 64, colour * sky, 4.0);
    }
    check_every_pixel(all, scenes[0], settings_of(16, 0), 64, black, 0.0);
}
