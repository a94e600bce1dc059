// Textures at known points and in the mean, on every kind of primitive. Under an even sky a diffuse surface that
// nothing shadows shows its colour.
#include <array>
#include <cstdint>
#include <numbers>

#include "tests/suite/effects.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double pi = std::numbers::pi;

Texture image_texture(std::uint32_t width, std::uint32_t height) {
    Texture texture;
    texture.name = "image";
    texture.kind = TextureKind::image;
    texture.space = TextureSpace::coordinates;
    texture.image = some_pixels(width, height);
    return texture;
}

Texture pattern(TextureKind kind, const dvec3& frequency, TextureSpace space = TextureSpace::object) {
    Texture texture;
    texture.name = "pattern";
    texture.kind = kind;
    texture.space = space;
    texture.frequency = frequency;
    texture.first = {0.9, 0.1, 0.4};
    texture.second = {0.2, 0.8, 0.6};
    return texture;
}

// Looks at a point of a surface, whose normal there is `normal`.
SceneBuilder looking_at(const dvec3& point, const dvec3& normal) {
    const dvec3 across = std::abs(normal.y) < 0.9 ? dvec3(0.0, 1.0, 0.0) : dvec3(1.0, 0.0, 0.0);
    return SceneBuilder()
        .camera(point + 2.0 * glm::normalize(normal + 0.3 * across), point, narrow_field, across)
        .background(white);
}

// The corners of a quad have the coordinates of MODEL.md section 5.1.
Scene with_quad_coordinates(Scene scene) {
    scene.texture_coordinates = {{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}};
    return scene;
}

// Float coordinates are off by some 2^-22, and these textures change by up to 30 a unit of them.
constexpr double roundings = 1000.0;

void check_colour(std::vector<Tracer>& all, const Scene& scene, const dvec3& expected) {
    check_every_pixel(all, scene, settings_of(2, 1), 64, expected, roundings);
}

dvec3 through(const dmat4& m, const dvec3& p) { return dvec3(m * glm::dvec4(p, 1.0)); }
dvec3 normal_through(const dmat4& m, const dvec3& n) { return glm::transpose(glm::inverse(glm::dmat3(m))) * n; }

const dmat4 placed = moved({0.4, -0.2, 0.3}) * rotated(50.0, {1.0, 2.0, 3.0}) * scaled({0.8, 1.3, 0.9});

// pcg3d [Jarzynski, Olano 2020], listing of the paper's section 4, and the noise of MODEL.md section 7.0 on it.
dvec3 gradient(const glm::ivec3& corner, std::uint32_t seed) {
    std::array<std::uint32_t, 3> v{static_cast<std::uint32_t>(corner.x) + seed, static_cast<std::uint32_t>(corner.y),
        static_cast<std::uint32_t>(corner.z)};
    for (auto& x : v) x = x * 1664525u + 1013904223u;
    for (int round = 0; round < 2; ++round) {
        for (std::size_t i = 0; i < 3; ++i) v[i] += v[(i + 1) % 3] * v[(i + 2) % 3];
        if (round == 0)
            for (auto& x : v) x ^= x >> 16u;
    }
    dvec3 result;
    for (int i = 0; i < 3; ++i) result[i] = 2.0 * std::ldexp(v[static_cast<std::size_t>(i)] >> 8u, -24) - 1.0;
    return result;
}

double noise(const dvec3& q, std::uint32_t seed) {
    const glm::ivec3 cell(glm::floor(q));
    const dvec3 r = q - dvec3(cell);
    const auto corner = [&](int x, int y, int z) {
        return glm::dot(gradient(cell + glm::ivec3(x, y, z), seed), r - dvec3(x, y, z));
    };
    const auto along_x = [&](int y, int z) {
        return glm::mix(corner(0, y, z), corner(1, y, z), glm::smoothstep(0.0, 1.0, r.x));
    };
    const auto along_y = [&](int z) { return glm::mix(along_x(0, z), along_x(1, z), glm::smoothstep(0.0, 1.0, r.y)); };
    return glm::mix(along_y(0), along_y(1), glm::smoothstep(0.0, 1.0, r.z));
}

double turbulence(const dvec3& q, std::uint32_t seed, std::uint32_t octaves) {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < octaves; ++i)
        sum += std::ldexp(noise(std::ldexp(1.0, static_cast<int>(i)) * q, seed), -static_cast<int>(i));
    return std::abs(sum);
}

}  // namespace

TEST_CASE("an image on a quad and on a triangle is bilinear between its texels, and repeats") {
    auto& all = tracers();
    const Texture texture = image_texture(5, 3);
    const dvec3 a(-1.0, 0.0, 1.0), e(2.0, 0.0, 0.0), g(0.0, 0.0, -3.0);
    for (const glm::dvec2& at :
        {glm::dvec2(0.3, 0.45), glm::dvec2(0.02, 0.97), glm::dvec2(0.9, 0.1), glm::dvec2(0.55, 0.7)}) {
        CAPTURE(at.x);
        const dvec3 point = a + at.x * e + at.y * g;
        const Scene quad = looking_at(point, {0.0, 1.0, 0.0}).quad(diffuse(white), a, a + e, a + e + g, a + g).scene();
        check_colour(
            all, with_quad_coordinates(textured(quad, texture)), interpolated(*texture.image, at.x, at.y, true));
        // A triangle's own coordinates are its barycentric ones; its transform does not change them.
        const dvec3 half = a + 0.5 * at.x * e + 0.5 * at.y * g;
        const Scene triangle = looking_at(through(placed, half), normal_through(placed, {0.0, 1.0, 0.0}))
                                   .triangle(diffuse(white), a, a + e, a + g, placed)
                                   .scene();
        check_colour(all, textured(triangle, texture), interpolated(*texture.image, 0.5 * at.x, 0.5 * at.y, true));
    }
}

TEST_CASE("a sphere's coordinates go round its axis and up from its lower pole, in object space") {
    auto& all = tracers();
    const Texture texture = image_texture(8, 6);
    const dmat4& m = placed;
    for (const glm::dvec2& at :
        {glm::dvec2(0.1, 0.3), glm::dvec2(0.49, 0.6), glm::dvec2(0.8, 0.93), glm::dvec2(0.99, 0.5)}) {
        CAPTURE(at.x);
        // n of section 5.1 from (u, v).
        const double around = 2.0 * pi * (at.x - 0.5), height = -std::cos(pi * at.y), ring = std::sin(pi * at.y);
        const dvec3 n(ring * std::cos(around), height, -ring * std::sin(around));
        const dvec3 centre(0.2, 0.1, -0.3);
        const Scene scene = looking_at(through(m, centre + 0.7 * n), normal_through(m, n))
                                .sphere(diffuse(white), centre, 0.7, m)
                                .scene();
        check_colour(all, textured(scene, texture), interpolated(*texture.image, at.x, at.y, true));
    }
}

TEST_CASE("every face of a cuboid has the coordinates of its two remaining axes") {
    auto& all = tracers();
    const Texture texture = image_texture(4, 7);
    const dvec3 lo(-0.5, -0.2, 0.1), hi(0.4, 0.6, 0.9), share(0.15, 0.35, 0.85);
    const dmat4& m = placed;
    for (int face = 0; face < 6; ++face) {
        CAPTURE(face);
        const int axis = face / 2;
        dvec3 point = glm::mix(lo, hi, share), normal(0.0);
        point[axis] = face % 2 == 0 ? lo[axis] : hi[axis];
        normal[axis] = face % 2 == 0 ? -1.0 : 1.0;
        const double u = axis == 0 ? share.y : share.x, v = axis == 2 ? share.y : share.z;
        const Scene scene =
            looking_at(through(m, point), normal_through(m, normal)).cuboid(diffuse(white), lo, hi, m).scene();
        check_colour(all, textured(scene, texture), interpolated(*texture.image, u, v, true));
    }
}

TEST_CASE("a view of a whole image has the mean of its texels, and one of a whole checker the mean of its colours") {
    auto& all = tracers();
    const auto view = [] {
        return SceneBuilder()
            .camera(black, {0.0, 0.0, -1.0}, 90.0)
            .background(white)
            .quad(diffuse(white), {-1.0, -1.0, -1.0}, {1.0, -1.0, -1.0}, {1.0, 1.0, -1.0}, {-1.0, 1.0, -1.0});
    };
    const Texture image = image_texture(5, 3);
    dvec3 mean(0.0);
    for (std::size_t i = 0; i < image.image->rgb.size(); ++i)
        mean[static_cast<int>(i % 3)] += image.image->rgb[i] / 15.0;
    check_mean(all, with_quad_coordinates(textured(view().scene(), image)), settings_of(16, 1), 512, mean, 64.0);

    const Texture board = pattern(TextureKind::checker, {3.0, 2.0, 0.0}, TextureSpace::coordinates);
    check_mean(all, with_quad_coordinates(textured(view().scene(), board)), settings_of(16, 1), 512,
        0.5 * (board.first + board.second), 64.0);
}

TEST_CASE("a checker has its first colour where the sum of its cells is even, in object space") {
    auto& all = tracers();
    const Texture board = pattern(TextureKind::checker, {2.0, 5.0, 3.0});
    const dvec3 points[] = {{0.3, 0.0, 0.2}, {-0.3, 0.0, 0.2}, {0.6, 0.0, 0.5}, {0.6, 0.0, -0.5}, {1.1, 0.0, 0.4}};
    for (const double y : {0.1, 0.3}) {
        for (dvec3 point : points) {
            CAPTURE(point.x);
            point.y = y;
            const dvec3 cells = glm::floor(board.frequency * point);
            const bool even = std::fmod(std::abs(cells.x + cells.y + cells.z), 2.0) == 0.0;
            const Scene scene = looking_at(through(placed, point), normal_through(placed, {0.0, 1.0, 0.0}))
                                    .cuboid(diffuse(white), {-3.0, y - 1.0, -3.0}, {3.0, y, 3.0}, placed)
                                    .scene();
            check_colour(all, textured(scene, board), even ? board.first : board.second);
        }
    }
}

TEST_CASE("a checker leaves out an axis of frequency 0: a floor along it is no doubtful case") {
    auto& all = tracers();
    const Texture board = pattern(TextureKind::checker, {2.0, 0.0, 2.0});
    for (const double x : {0.2, 0.7, -0.2}) {
        CAPTURE(x);
        const Scene scene = looking_at({x, 0.0, 0.3}, {0.0, 1.0, 0.0}).floor(diffuse(white), 0.0, 4.0).scene();
        check_colour(all, textured(scene, board),
            std::fmod(std::abs(std::floor(2.0 * x)), 2.0) == 0.0 ? board.first : board.second);
    }
}

TEST_CASE("noise is that of the paper's hash and the model's text, at any point and seed") {
    auto& all = tracers();
    const dvec3 frequency(2.5, 1.5, 3.5);
    const std::pair<std::uint32_t, dvec3> places[] = {
        {0u, {0.31, 0.2, 0.73}}, {7u, {-1.24, 0.2, -0.41}}, {0xFFFFFFF0u, {1.87, 0.2, 1.13}}};
    for (const NoiseStyle style : {NoiseStyle::smooth, NoiseStyle::turbulence, NoiseStyle::marble}) {
        for (const auto& [seed, point] : places) {
            CAPTURE(static_cast<int>(style));
            CAPTURE(seed);
            CAPTURE(point.x);
            Texture texture = pattern(TextureKind::noise, frequency);
            texture.style = style;
            texture.seed = seed;
            texture.octaves = 5;
            texture.amount = 1.7;
            const dvec3 q = frequency * point;
            double share = 0.5 * (1.0 + noise(q, seed));
            if (style == NoiseStyle::turbulence) share = turbulence(q, seed, 5);
            if (style == NoiseStyle::marble)
                share = 0.5 * (1.0 + std::sin(2.0 * pi * (q.z + 1.7 * turbulence(q, seed, 5))));
            const Scene scene =
                looking_at(point, {0.0, 1.0, 0.0}).cuboid(diffuse(white), {-3.0, -0.8, -3.0}, {3.0, 0.2, 3.0}).scene();
            check_colour(
                all, textured(scene, texture), glm::mix(texture.first, texture.second, glm::clamp(share, 0.0, 1.0)));
        }
    }
}

TEST_CASE("a texture colours mirrors and stained glass as it does diffuse surfaces") {
    auto& all = tracers();
    const Texture texture = image_texture(5, 3);
    const dvec3 a(-1.0, 0.0, 1.0), e(2.0, 0.0, 0.0), g(0.0, 0.0, -3.0),
        colour = interpolated(*texture.image, 0.3, 0.4, true);
    for (const Material& material : {mirror(white), glass(1.0, Fresnel::exact, 0.5)}) {
        const Scene scene =
            looking_at(a + 0.3 * e + 0.4 * g, {0.0, 1.0, 0.0}).quad(material, a, a + e, a + e + g, a + g).scene();
        check_colour(all, with_quad_coordinates(textured(scene, texture)),
            material.translucent ? 0.5 * (white + colour) : colour);
    }
}
