// Hash, noise, checkers, images and coordinates of MODEL.md sections 5.1 and 7.0. The numbers of hash and noise were
// computed with a few lines of Python from the published algorithms.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "cpu_ref/path_tracer/material/textures.h"
#include "tests/scene_builder.h"

using namespace tandem;
using namespace tandem::cpu;
using glm::dvec2;
using glm::dvec3;

namespace {

Texture noise(NoiseStyle style, double amount = 1.0) {
    Texture texture;
    texture.kind = TextureKind::noise;
    texture.style = style;
    texture.amount = amount;
    texture.seed = 3;
    return texture;
}

// A scene of what `add` builds, its entities textured.
template <class Add>
TextureTable table_of(const Texture& texture, Add add) {
    test::SceneBuilder builder;
    add(builder);
    Scene scene = builder.scene();
    scene.textures.push_back(texture);
    for (Material& material : scene.materials) material.colour_texture = 0;
    return {scene, nullptr};
}

}  // namespace

TEST_CASE("pcg3d gives the words of the published hash") {
    using Words = std::array<std::uint32_t, 3>;
    CHECK(pcg3d({0, 0, 0}) == Words{0x9bafd7c6u, 0xa8e88a6bu, 0x3f15482cu});
    CHECK(pcg3d({1, 2, 3}) == Words{0xfa9f79a6u, 0x48f2f44cu, 0x596f5ab1u});
    CHECK(pcg3d({0xFFFFFFFFu, 0xFFFFFFFEu, 12345u}) == Words{0x070b1b9fu, 0x800afa00u, 0x4b9259f1u});
}

TEST_CASE("noise has its known values, also left of zero, and vanishes on the lattice") {
    CHECK(gradient_noise({0.25, -1.5, 7.125}, 5) == doctest::Approx(0.025513076509014354).epsilon(1e-13));
    CHECK(gradient_noise({-3.7, 0.2, 0.9}, 0) == doctest::Approx(0.1001928339092651).epsilon(1e-13));
    for (int i = -3; i < 3; ++i) CHECK(gradient_noise({i, 2.0 * i, 5.0 - i}, 7) == 0.0);
}

TEST_CASE("noise textures mix their colours by turbulence and marble as the formulas say") {
    const dvec3 q(0.3, 0.6, -0.45);
    CHECK(
        texture_colour(noise(NoiseStyle::turbulence), q, {}).x == doctest::Approx(0.15448594183939057).epsilon(1e-12));
    CHECK(
        texture_colour(noise(NoiseStyle::marble, 2.5), q, {}).x == doctest::Approx(0.3049344879762914).epsilon(1e-12));
    CHECK(texture_colour(noise(NoiseStyle::smooth), q, {}).x ==
          doctest::Approx(0.5 * (1.0 + gradient_noise(q, 3))).epsilon(1e-14));
}

TEST_CASE("a checker alternates over the cells, and an axis of frequency 0 has no part in it") {
    Texture checker;
    checker.frequency = {2.0, 2.0, 2.0};
    const auto second = [&](const dvec3& p) { return texture_colour(checker, p, {}).x == 1.0; };
    CHECK_FALSE(second({0.25, 0.25, 0.25}));
    CHECK(second({0.75, 0.25, 0.25}));
    CHECK(second({-0.25, 0.25, 0.25}));
    CHECK_FALSE(second({-0.25, 0.25, -0.25}));
    CHECK(second({-0.25, -0.25, -0.25}));
    checker.frequency.y = 0.0;
    CHECK(second({0.75, -0.25, 0.25}));
    CHECK_FALSE(second({0.25, -0.25, 0.25}));
}

TEST_CASE("images are bilinear between texel centres and repeat") {
    Pixels image{2, 2, {}};
    for (const float value : {0.0f, 1.0f, 2.0f, 3.0f}) image.rgb.insert(image.rgb.end(), 3, value);  // 0 1 over 2 3
    const auto at = [&](double u, double v, Rows rows) { return bilinear(image, u, v, rows).x; };
    CHECK(at(0.25, 0.75, Rows::repeated) == 0.0);
    CHECK(at(0.75, 0.25, Rows::repeated) == 3.0);
    CHECK(at(0.5, 0.5, Rows::repeated) == 1.5);
    CHECK(at(1.0, 0.75, Rows::repeated) == 0.5);  // columns repeat
    CHECK(at(-0.75, 0.75, Rows::held) == 0.0);    // also here
    CHECK(at(0.25, 1.0, Rows::repeated) == 1.0);  // rows repeat
    CHECK(at(0.25, 1.0, Rows::held) == 0.0);      // rows are held
    CHECK(at(0.25, 0.0, Rows::held) == 2.0);
}

TEST_CASE("spheres, cuboids and triangles have the coordinates of section 5.1") {
    Texture checker;
    checker.space = TextureSpace::coordinates;
    const TextureTable sphere = table_of(checker, [](auto& b) {
        b.sphere(test::diffuse(test::white), {1, 2, 3}, 2.0);
    });
    const auto close = [](const dvec2& a, const dvec2& b) { return glm::length(a - b) < 1e-12; };
    CHECK(close(sphere.coordinates(0, 0, {3, 2, 3}), {0.5, 0.5}));
    CHECK(close(sphere.coordinates(0, 0, {1, 2, 1}), {0.75, 0.5}));  // n = -z: atan2(1, 0)
    CHECK(close(sphere.coordinates(0, 0, {1, 4, 3}), {0.5, 1.0}));
    CHECK(close(sphere.coordinates(0, 0, {1, 2.0 - std::sqrt(2.0), 3.0 + std::sqrt(2.0)}), {0.25, 0.25}));
    const TextureTable box = table_of(checker, [](auto& b) {
        b.cuboid(test::diffuse(test::white), {0, 0, 0}, {2, 4, 8});
    });
    CHECK(close(box.coordinates(0, 0, {0, 1, 2}), {0.25, 0.25}));  // y, z
    CHECK(close(box.coordinates(0, 3, {1, 4, 6}), {0.5, 0.75}));   // x, z
    CHECK(close(box.coordinates(0, 5, {0.5, 1, 8}), {0.25, 0.25}));
    const TextureTable triangle = table_of(checker, [](auto& b) {
        b.triangle(test::diffuse(test::white), {0, 0, 0}, {2, 0, 0}, {0, 0, 4});
    });
    CHECK(close(triangle.coordinates(0, 0, {0.5, 0, 1}), {0.25, 0.25}));
}

TEST_CASE("textures are fixed to the object, whatever its transform") {
    Texture checker;
    const TextureTable table = table_of(checker, [](auto& b) {
        b.sphere(test::diffuse(test::white), {0, 0, 0}, 2.0, test::moved({10, 0, 0}) * test::scaled({2, 2, 2}));
    });
    CHECK(table.colour(0, 0, {11, 1, 1}) == dvec3(0.0));  // object (½, ½, ½)
    CHECK(table.colour(0, 0, {9, 1, 1}) == dvec3(1.0));
}
