// Coverage, normals and distances of every primitive, seen through images of few bounces.
#include <doctest/doctest.h>

#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "tests/vulkan/scenes.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

// A camera far away at +z with a narrow field. So its rays are parallel to within `field`, and its film spans [-1, 1]
// at z = 0.
constexpr double far_away = 1000.0;
SceneBuilder frontal() {
    SceneBuilder builder;
    builder.camera({0, 0, far_away}, {0, 0, 0}, 2.0 * std::atan(1.0 / far_away) * 180.0 / std::numbers::pi);
    return builder;
}

struct Share {
    double share, error;
};

// The share of the film that the emitter of `scene` covers.
Share coverage(const Scene& scene) {
    const Estimate estimate = render(scene, settings_of(32, 0), 256).estimate;
    return {image_mean(estimate), standard_error(estimate)};
}

constexpr double pi = std::numbers::pi;

}  // namespace

// Tolerances: five standard errors, and twice depth / far_away. The latter is the perspective of points up to `depth`
// before or behind z = 0.

TEST_CASE("a sphere covers the area of its disc") {
    SceneBuilder builder = frontal();
    builder.sphere(builder.material(emitter(glm::dvec3(1.0))), {0.1, 0.1, 0.0}, 0.7);
    const Share got = coverage(builder.scene());
    CHECK(std::abs(got.share - 0.49 * pi / 4.0) <= 5.0 * got.error + 2.0 * 0.7 / far_away);
}

TEST_CASE("an ellipsoid covers the area of its ellipse") {
    SceneBuilder builder = frontal();
    const glm::dmat4 m = glm::scale(glm::rotate(glm::dmat4(1.0), 0.5, {0, 0, 1}), glm::dvec3(0.8, -0.3, 0.5));
    builder.sphere(builder.material(emitter(glm::dvec3(1.0))), glm::dvec3(0.0), 1.0, m);
    const Share got = coverage(builder.scene());
    CHECK(std::abs(got.share - 0.24 * pi / 4.0) <= 5.0 * got.error + 2.0 * 0.5 / far_away);
}

TEST_CASE("a turned cuboid covers the area of its shadow") {
    SceneBuilder builder = frontal();
    const glm::dmat4 m = glm::rotate(glm::dmat4(1.0), 0.7, {0, 1, 0});
    builder.cuboid(builder.material(emitter(glm::dvec3(1.0))), {-0.4, -0.5, -0.3}, {0.4, 0.5, 0.3}, m);
    const Share got = coverage(builder.scene());
    const double width = 0.8 * std::cos(0.7) + 0.6 * std::sin(0.7);
    CHECK(std::abs(got.share - width / 4.0) <= 5.0 * got.error + 2.0 * 0.5 / far_away);
}

TEST_CASE("a flat cuboid covers its face and nothing from the edge") {
    SceneBuilder face = frontal(), edge = frontal();
    face.cuboid(face.material(emitter(glm::dvec3(1.0))), {-0.5, -0.5, 0.0}, {0.5, 0.5, 0.0});
    const Share got = coverage(face.scene());
    CHECK(std::abs(got.share - 0.25) <= 5.0 * got.error + 1e-6);
    edge.cuboid(edge.material(emitter(glm::dvec3(1.0))), {-0.5, 0.0, -0.5}, {0.5, 0.0, 0.5});
    CHECK(coverage(edge.scene()).share <= 2.0 * 0.5 / far_away);
}

TEST_CASE("a triangle covers its area from both sides") {
    for (const bool turned : {false, true}) {
        SceneBuilder builder = frontal();
        const std::uint32_t lamp = builder.material(emitter(glm::dvec3(1.0)));
        const glm::dvec3 a{-0.8, -0.7, 0.0}, b{0.9, -0.4, 0.0}, c{0.1, 0.8, 0.0};
        builder.triangle(lamp, {a, turned ? c : b, turned ? b : c});
        const Share got = coverage(builder.scene());
        const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
        CHECK(std::abs(got.share - area / 4.0) <= 5.0 * got.error + 1e-6);
    }
}

TEST_CASE("a fan of triangles has neither gaps nor overlaps at its edges") {
    // Opaque black triangles before a lamp: any light would have come through a shared edge.
    SceneBuilder builder;
    builder.camera({0.1, 0.07, 1.0}, {0.0, 0.0, 0.0}, 60.0).background(glm::dvec3(1.0), glm::dvec3(1.0));
    const std::uint32_t black = builder.material(diffuse(glm::dvec3(0.0)));
    constexpr int slices = 48;
    const auto rim = [](int i) {
        const double angle = 2.0 * pi * i / slices;
        return glm::dvec3(4.0 * std::cos(angle), 4.0 * std::sin(angle), 0.3 * std::sin(3.0 * angle));
    };
    for (int i = 0; i < slices; ++i) builder.triangle(black, {glm::dvec3(0.0), rim(i), rim(i + 1)});
    CHECK(image_mean(render(builder.scene(), settings_of(48, 1), 128).estimate) == 0.0);
}

TEST_CASE("normals of placed primitives follow the inverse transpose") {
    // A mirror under a shearing, mirrored placement sends the camera's ray in a known direction. The background's
    // height tells it: d_y = 2 B - 1.
    const glm::dmat4 m = glm::scale(
        glm::rotate(glm::dmat4(1.0), 0.9, glm::normalize(glm::dvec3(1, 1, 0.2))), glm::dvec3(-1.0, 3.0, 0.4));
    const glm::dmat3 normal_map = glm::transpose(glm::inverse(glm::dmat3(m)));
    for (const PrimitiveKind kind : {PrimitiveKind::triangle, PrimitiveKind::cuboid, PrimitiveKind::sphere}) {
        // The object-space point that is aimed at, and the normal there.
        const glm::dvec3 x =
            kind == PrimitiveKind::sphere ? glm::normalize(glm::dvec3(0.3, 0.2, 1.0)) : glm::dvec3(0.3, 0.2, 1.0);
        const glm::dvec3 n = glm::normalize(normal_map * (kind == PrimitiveKind::sphere ? x : glm::dvec3(0, 0, 1)));
        const glm::dvec3 p(m * glm::dvec4(x, 1.0));
        SceneBuilder builder;
        builder.camera(p + 2.0 * glm::normalize(n + glm::dvec3(0.05, -0.1, 0.02)), p, 1e-4);
        builder.background(glm::dvec3(0.0), glm::dvec3(1.0));
        const std::uint32_t silver = builder.material(mirror(glm::dvec3(1.0)));
        if (kind == PrimitiveKind::triangle)
            builder.triangle(silver, {glm::dvec3{-2, -2, 1}, {3, -2, 1}, {0, 3, 1}}, m);
        else if (kind == PrimitiveKind::cuboid)
            builder.cuboid(silver, {-1, -1, -1}, {1, 1, 1}, m);
        else
            builder.sphere(silver, glm::dvec3(0.0), 1.0, m);
        const glm::dvec3 d = glm::normalize(p - builder.scene().camera.position);
        const glm::dvec3 expected = d - 2.0 * glm::dot(d, n) * n;
        CAPTURE(static_cast<int>(kind));
        // The field of 1e-4 degrees spreads rays by 2e-6, over a curved mirror by a few times that; floats add 1e-6.
        CHECK(image_mean(render(builder.scene(), settings_of(4, 1), 16).estimate) ==
              doctest::Approx((expected.y + 1.0) / 2.0).epsilon(2e-5));
    }
}

TEST_CASE("a ray sees only what lies in its interval of distances") {
    SceneBuilder builder;
    builder.camera({0, 0, 0}, {0, 0, -1}, 1.0);
    for (const double z : {1.0, 2.0, 3.0})
        builder.quad(
            builder.material(emitter(glm::dvec3(z))), {glm::dvec3{-1, -1, -z}, {1, -1, -z}, {1, 1, -z}, {-1, 1, -z}});
    RenderSettings settings = settings_of(4, 0);
    CHECK(image_mean(render(builder.scene(), settings, 2).estimate) == 1.0);
    settings.ray_min = 1.5;
    CHECK(image_mean(render(builder.scene(), settings, 2).estimate) == 2.0);
    settings.ray_min = 2.5;
    settings.ray_max = 2.9;
    CHECK(image_mean(render(builder.scene(), settings, 2).estimate) == 0.0);
}

TEST_CASE("of two primitives at the same distance the one with the lower id is seen, whatever their kinds") {
    for (const bool triangle_first : {true, false}) {
        SceneBuilder builder;
        builder.camera({0, 0, 1}, {0, 0, 0}, 1e-6);
        const std::uint32_t one = builder.material(emitter(glm::dvec3(1.0)));
        const std::uint32_t two = builder.material(emitter(glm::dvec3(2.0)));
        // In so narrow a field d_z is -1 exactly, and all quotients are of powers of two: both distances are 1.
        if (!triangle_first) builder.cuboid(one, {-4, -4, 0}, {4, 4, 0});
        builder.triangle(triangle_first ? one : two, {glm::dvec3{-8, -8, 0}, {8, -8, 0}, {0, 8, 0}});
        if (triangle_first) builder.cuboid(two, {-4, -4, 0}, {4, 4, 0});
        CHECK(image_mean(render(builder.scene(), settings_of(4, 0), 16).estimate) == 1.0);
    }
}

TEST_CASE("a ray that goes into glass meets its far side, and at index 1 nothing happens at all") {
    for (const PrimitiveKind kind : {PrimitiveKind::sphere, PrimitiveKind::cuboid}) {
        SceneBuilder builder = frontal();
        const std::uint32_t clear = builder.material(glass(1.0));
        if (kind == PrimitiveKind::sphere)
            builder.sphere(clear, glm::dvec3(0.0), 0.8);
        else
            builder.cuboid(clear, glm::dvec3(-0.8), glm::dvec3(0.8));
        builder.background(glm::dvec3(0.5), glm::dvec3(0.5));
        // Two events are enough for every ray, in and out.
        CHECK(
            image_mean(render(builder.scene(), settings_of(32, 2), 16).estimate) == doctest::Approx(0.5).epsilon(1e-6));
        // With one, those that went in end there.
        CHECK(image_mean(render(builder.scene(), settings_of(32, 1), 16).estimate) < 0.4);
    }
}
