// Closed forms of film, lens and ray interval.
#include <numbers>

#include "tests/suite/tracers.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double pi = std::numbers::pi;
const dvec3 glow(1.0, 2.0, 4.0);

// Looks along -z with a field of 90 degrees: the film is the square |x|, |y| < 1 of the plane z = -1.
SceneBuilder square_view() { return SceneBuilder().camera(black, {0.0, 0.0, -1.0}, 90.0); }

// The emitting half-plane n·(x, y) > offset of the plane at z.
SceneBuilder& half_plane(SceneBuilder& builder, double z, const dvec3& normal, double offset) {
    const dvec3 along(-normal.y, normal.x, 0.0), from = offset * normal + dvec3(0.0, 0.0, z);
    return builder.quad(emitter(glow), from - 90.0 * along, from - 90.0 * along + 90.0 * normal,
        from + 90.0 * along + 90.0 * normal, from + 90.0 * along);
}

}  // namespace

TEST_CASE("a triangle smaller than a pixel shows the fraction of the pixel that it covers, in that pixel alone") {
    // Near the upper right corner of its pixel in a film of 3 x 3: half a pixel's shift would lose it.
    const struct {
        std::uint32_t pixel;
        dvec3 centre;
    } places[] = {{4, {0.0, 0.0, -1.0}}, {2, {2.0 / 3.0, 2.0 / 3.0, -1.0}}, {3, {-2.0 / 3.0, 0.0, -1.0}}};
    const double area = 0.5 * 0.2 * 0.15, pixel_area = 4.0 / 9.0;
    auto& all = tracers();
    for (const auto& [pixel, centre] : places) {
        CAPTURE(pixel);
        const Scene scene = square_view()
                                .triangle(emitter(glow), centre + dvec3(0.1, 0.15, 0.0), centre + dvec3(0.3, 0.15, 0.0),
                                    centre + dvec3(0.2, 0.3, 0.0))
                                .scene();
        for (Tracer& tracer : all) {
            CAPTURE(tracer.name);
            const std::uint64_t samples = 4096;
            const Estimate estimate = render(tracer, scene, settings_of(3, 1), samples);
            const std::vector<double> mean = mean_of(estimate), variance = variance_of(estimate);
            for (std::uint32_t i = 0; i < 9; ++i) {
                CAPTURE(i);
                const double expected = i == pixel ? area / pixel_area : 0.0;
                const double allowed = sigmas * std::sqrt(variance[3 * i] / static_cast<double>(samples));
                CAPTURE(mean[3 * i]);
                CAPTURE(expected);
                CHECK(std::abs(mean[3 * i] - expected) <= allowed);
            }
        }
    }
}

TEST_CASE("pixel (0, 0) is the upper left one") {
    auto& all = tracers();
    const Scene scene =
        SceneBuilder()
            .camera({0.0, 0.0, 5.0}, black, 90.0)
            .quad(emitter(glow), {-90.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 90.0, 0.0}, {-90.0, 90.0, 0.0})
            .scene();
    for (Tracer& tracer : all) {
        CAPTURE(tracer.name);
        const std::vector<double> mean = mean_of(render(tracer, scene, settings_of(2, 1), 64));
        for (std::size_t i = 0; i < 4; ++i) CHECK(mean[3 * i] == (i == 0 ? glow.x : 0.0));
    }
}

TEST_CASE("a sky linear in height shows its mean over each pixel") {
    const dvec3 down(0.0, 1.0, 3.0), up(2.0, 1.0, 0.0);
    const Scene scene =
        SceneBuilder().camera(black, {1.0, 0.7, 0.3}, 80.0, {0.1, 1.0, 0.2}).background(down, up).scene();
    const dvec3 forward = glm::normalize(dvec3(1.0, 0.7, 0.3));
    const dvec3 right = glm::normalize(glm::cross(forward, {0.1, 1.0, 0.2})), upward = glm::cross(right, forward);
    const double h = std::tan(glm::radians(40.0));
    auto& all = tracers();
    for (Tracer& tracer : all) {
        CAPTURE(tracer.name);
        constexpr std::uint64_t samples = 1024;
        const Estimate estimate = render(tracer, scene, settings_of(4, 0), samples);
        const std::vector<double> mean = mean_of(estimate), variance = variance_of(estimate);
        for (int pixel = 0; pixel < 16; ++pixel) {
            CAPTURE(pixel);
            const dvec3 expected = mean_over_square(
                [&](double u, double v) {
                    const double x = (pixel % 4 + u) / 4.0, y = (pixel / 4 + v) / 4.0;
                    const dvec3 d =
                        glm::normalize(forward + h * (2.0 * x - 1.0) * right + h * (1.0 - 2.0 * y) * upward);
                    return glm::mix(down, up, 0.5 * (d.y + 1.0));
                },
                64);
            for (int channel = 0; channel < 3; ++channel) {
                const auto i = static_cast<std::size_t>(3 * pixel + channel);
                const double allowed = sigmas * std::sqrt(variance[i] / static_cast<double>(samples)) +
                                       16.0 * tracer.unit_roundoff * expected[channel];
                CHECK(std::abs(mean[i] - expected[channel]) <= allowed);
            }
        }
    }
}

TEST_CASE("a wide film keeps its vertical field") {
    auto& all = tracers();
    // |y| < 1/2 of the film's |y| < 1, at any width.
    const Scene scene =
        square_view()
            .quad(emitter(glow), {-90.0, -0.5, -1.0}, {90.0, -0.5, -1.0}, {90.0, 0.5, -1.0}, {-90.0, 0.5, -1.0})
            .scene();
    for (Tracer& tracer : all) {
        CAPTURE(tracer.name);
        RenderSettings settings = settings_of(4, 1);
        settings.width = 12;
        const std::vector<double> mean = mean_of(render(tracer, scene, settings, 64));
        for (std::size_t i = 0; i < 48; ++i) CHECK(mean[3 * i] == (i / 12 == 1 || i / 12 == 2 ? glow.x : 0.0));
    }
}

TEST_CASE("out of focus, an edge is blurred to a segment of the lens's disc") {
    // The disc of confusion at depth z has the radius R |1 - z/F|; beyond s of its radius lies (acos s - s sqrt(1 -
    // s²))/π.
    const double radius = 0.1, focus = 2.0, s = 0.3;
    const double fraction = (std::acos(s) - s * std::sqrt(1.0 - s * s)) / pi;
    auto& all = tracers();
    for (const double depth : {1.0, 5.0}) {
        for (const dvec3& normal : {dvec3(1.0, 0.0, 0.0), dvec3(0.0, 1.0, 0.0), dvec3(-0.6, -0.8, 0.0)}) {
            CAPTURE(depth);
            CAPTURE(normal.x);
            const double blur = radius * std::abs(1.0 - depth / focus);
            SceneBuilder builder = SceneBuilder().camera(black, {0.0, 0.0, -1.0}, 0.001).lens(radius, focus);
            half_plane(builder, -depth, normal, s * blur);
            check_mean(all, builder.scene(), settings_of(8, 1), 512, fraction * glow, 0.0);
        }
    }
}

TEST_CASE("in focus, an edge is sharp whatever the lens") {
    SceneBuilder builder = SceneBuilder().camera(black, {0.0, 0.0, -1.0}, 60.0).lens(0.7, 2.5);
    half_plane(builder, -2.5, {1.0, 0.0, 0.0}, 0.0);
    auto& all = tracers();
    for (Tracer& tracer : all) {
        CAPTURE(tracer.name);
        const std::vector<double> mean = mean_of(render(tracer, builder.scene(), settings_of(4, 1), 64));
        for (std::size_t i = 0; i < 16; ++i) CHECK(mean[3 * i] == (i % 4 >= 2 ? glow.x : 0.0));
    }
}

TEST_CASE("a lens as wide as its focus is far sees the mean of the sky over its cone") {
    // Looking straight up, d_y = F / sqrt(F² + ρ²); over the disc its mean is 2 F (sqrt(F² + R²) - F) / R².
    auto& all = tracers();
    for (const double ratio : {1.0, 2.0}) {
        CAPTURE(ratio);
        const Scene scene = SceneBuilder()
                                .camera(black, {0.0, 1.0, 0.0}, 0.001, {0.0, 0.0, 1.0})
                                .lens(3.0 * ratio, 3.0)
                                .background(black, glow)
                                .scene();
        const double height = 2.0 * (std::sqrt(1.0 + ratio * ratio) - 1.0) / (ratio * ratio);
        check_mean(all, scene, settings_of(8, 1), 512, 0.5 * (1.0 + height) * glow, 32.0);
    }
}

TEST_CASE("a one-sided emitter is black from behind, whatever its transform, and blocks what is behind it") {
    auto& all = tracers();
    const auto check = [&](const Scene& scene, const dvec3& expected) {
        check_every_pixel(all, scene, settings_of(8, 3), 64, expected, 2.0);
    };
    const Material one_sided = emitter(glow, EmittingSides::front);
    const dvec3 a(-9.0, -9.0, -1.0), b(9.0, -9.0, -1.0), c(0.0, 9.0, -1.0);
    const auto view = [] { return square_view().background(white); };
    check(view().triangle(one_sided, a, b, c).scene(), glow);
    check(view().triangle(one_sided, a, c, b).scene(), black);
    check(view().triangle(emitter(glow), a, c, b).scene(), glow);
    check(view().triangle(one_sided, a, b, c, scaled({-1.0, 1.0, 1.0})).scene(), glow);
    check(view().triangle(one_sided, a, c, b, scaled({1.0, -1.0, 1.0})).scene(), black);
    check(view().triangle(one_sided, a, b, c, moved({0.0, 0.0, -2.0}) * scaled({1.0, 1.0, -1.0})).scene(), black);
    for (const dmat4& placed : {dmat4(1.0), scaled({-1.0, 1.0, 2.0})}) {
        check(view().sphere(one_sided, black, 4.0, placed).scene(), black);
        check(view().cuboid(one_sided, dvec3(-4.0), dvec3(4.0), placed).scene(), black);
        check(view().triangle_box(one_sided, dvec3(-4.0), dvec3(4.0), placed).scene(), black);
    }
    check(view().cuboid(one_sided, {-9.0, -9.0, -3.0}, {9.0, 9.0, -2.0}).scene(), glow);
    check(view().sphere(one_sided, {0.0, 0.0, -30.0}, 28.0).scene(), glow);
}

TEST_CASE("the ray interval is closed to what lies beyond it") {
    auto& all = tracers();
    const Scene scene =
        SceneBuilder()
            .camera(black, {0.0, 0.0, -1.0}, 0.5)
            .background(white)
            .quad(emitter(glow), {-9.0, -9.0, -5.0}, {9.0, -9.0, -5.0}, {9.0, 9.0, -5.0}, {-9.0, 9.0, -5.0})
            .scene();
    const struct {
        double ray_min, ray_max;
        dvec3 expected;
    } cases[] = {{0.0, 4.9, white}, {0.0, 5.1, glow}, {4.9, 1e9, glow}, {5.1, 1e9, white}};
    for (const auto& [ray_min, ray_max, expected] : cases) {
        CAPTURE(ray_min);
        CAPTURE(ray_max);
        RenderSettings settings = settings_of(4, 2);
        settings.ray_min = ray_min;
        settings.ray_max = ray_max;
        check_every_pixel(all, scene, settings, 64, expected, 2.0);
    }
}
