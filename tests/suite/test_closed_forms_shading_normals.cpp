// Closed forms of meshes with vertex normals (MODEL.md section 5.4): interpolation, transform, sides, and the guard.
#include <numbers>

#include "tests/suite/effects.h"

using namespace tandem;
using namespace tandem::test;

namespace {

constexpr double pi = std::numbers::pi;
const dvec3 clay(0.9, 0.6, 0.3), irradiance(3.0, 2.0, 1.0);
constexpr double roundings = 2000.0;

// A triangle whose normals differ from corner to corner, stretched and turned, and one of its points.
struct SmoothTriangle {
    std::array<dvec3, 3> corners{dvec3(-3.0, 0.2, 2.0), dvec3(4.0, -0.1, 1.0), dvec3(0.5, 0.3, -4.0)};
    std::array<dvec3, 3> normals{glm::normalize(dvec3(0.8, 1.0, 0.1)), glm::normalize(dvec3(0.3, 1.0, -0.4)),
        glm::normalize(dvec3(0.9, 0.7, 0.5))};
    dmat4 placed = moved({0.4, -0.2, 0.3}) * rotated(50.0, {1.0, 2.0, 3.0}) * scaled({0.8, 1.9, 0.7});
    dvec3 weights{0.45, 0.2, 0.35};

    [[nodiscard]] dvec3 mean(const std::array<dvec3, 3>& at) const {
        return weights[0] * at[0] + weights[1] * at[1] + weights[2] * at[2];
    }
    [[nodiscard]] glm::dmat3 normal_map() const { return glm::transpose(glm::inverse(glm::dmat3(placed))); }
    [[nodiscard]] dvec3 point() const { return dvec3(placed * glm::dvec4(mean(corners), 1.0)); }
    [[nodiscard]] dvec3 own_normal() const {
        return glm::normalize(normal_map() * glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
    }
    // n_s on the front side.
    [[nodiscard]] dvec3 shading_normal() const {
        const dvec3 n = glm::normalize(normal_map() * mean(normals));
        return glm::dot(n, own_normal()) < 0.0 ? -n : n;
    }
    // Off the normal by `angle`, towards the side to which n_s leans.
    [[nodiscard]] dvec3 towards_lean(double angle) const {
        const dvec3 n = own_normal(), s = shading_normal();
        return std::cos(angle) * n + std::sin(angle) * glm::normalize(s - glm::dot(s, n) * n);
    }
    // Seen along -eye.
    [[nodiscard]] Scene seen_from(const dvec3& eye, const Material& material, const dvec3& sky = black) const {
        const dvec3 across = std::abs(eye.y) < 0.9 ? dvec3(0.0, 1.0, 0.0) : dvec3(1.0, 0.0, 0.0);
        Scene scene = SceneBuilder()
                          .camera(point() + 2.0 * eye, point(), narrow_field, across)
                          .background(sky)
                          .triangle(material, corners, placed)
                          .scene();
        scene.normals.resize(3);
        for (std::size_t i = 0; i < 3; ++i) scene.normals[scene.primitives[0].index[i]] = normals[i];
        return scene;
    }
};

void check_in_sun(std::vector<Tracer>& all, const SmoothTriangle& mesh, const dvec3& eye, const dvec3& to_sun,
    double expected_cosine) {
    check_every_pixel(all, with_light(mesh.seen_from(eye, diffuse(clay)), sun(-to_sun, irradiance)),
        settings_of(3, 1, Integrator::next_event), 64, irradiance * clay * (expected_cosine / pi), roundings);
}

}  // namespace

TEST_CASE("a smooth triangle in the sun is lit by its interpolated normal, on the side that is seen") {
    auto& all = tracers();
    const SmoothTriangle mesh;
    const dvec3 n = mesh.own_normal(), n_s = mesh.shading_normal();
    REQUIRE(glm::dot(n, n_s) < 0.9);
    const dvec3 to_sun = glm::normalize(n + dvec3(0.3, -0.2, 0.1));
    check_in_sun(all, mesh, glm::normalize(n + 0.4 * n_s), to_sun, glm::dot(n_s, to_sun));
    check_in_sun(all, mesh, -n, -to_sun, glm::dot(n_s, to_sun));  // the back, where n_s is turned round
    SmoothTriangle turned = mesh;  // normals that point to the other side are those of this one
    for (dvec3& normal : turned.normals) normal = -normal;
    check_in_sun(all, turned, n, to_sun, glm::dot(n_s, to_sun));
    SmoothTriangle scaled_normals = mesh;  // the weighted sum alone counts, whatever its length
    for (dvec3& normal : scaled_normals.normals) normal *= 0.125;
    check_in_sun(all, scaled_normals, n, to_sun, glm::dot(n_s, to_sun));
    SmoothTriangle flat = mesh;
    flat.normals.fill(black);
    check_in_sun(all, flat, n, to_sun, glm::dot(n, to_sun));
}

TEST_CASE("no light comes from below the plane of a smooth triangle, nor from below its shading horizon") {
    auto& all = tracers();
    const SmoothTriangle mesh;
    const dvec3 eye = mesh.own_normal(), n_s = mesh.shading_normal();
    const double lean = std::acos(glm::dot(eye, n_s));
    const dvec3 below_plane = mesh.towards_lean(0.5 * pi + 0.5 * lean);
    REQUIRE(glm::dot(below_plane, n_s) > 0.0);
    check_in_sun(all, mesh, eye, below_plane, 0.0);
    const dvec3 below_horizon = mesh.towards_lean(-0.5 * pi + 0.5 * lean);
    REQUIRE(glm::dot(below_horizon, eye) > 0.0);
    check_in_sun(all, mesh, eye, below_horizon, 0.0);
}

TEST_CASE("seen from beyond its shading horizon, a smooth triangle is shaded by its plane") {
    auto& all = tracers();
    const SmoothTriangle mesh;
    const dvec3 n = mesh.own_normal();
    const dvec3 eye = mesh.towards_lean(-0.5 * pi + 0.5 * std::acos(glm::dot(n, mesh.shading_normal())));
    REQUIRE(glm::dot(eye, n) > 0.05);
    REQUIRE(glm::dot(eye, mesh.shading_normal()) < -0.05);
    check_in_sun(all, mesh, eye, n, 1.0);
}

TEST_CASE("a smooth diffuse triangle shows an even sky times (1 + cos)/2, by scattering and light sampling") {
    auto& all = tracers();
    const SmoothTriangle mesh;
    const dvec3 n = mesh.own_normal(), sky(1.0, 2.0, 3.0);
    const dvec3 expected = sky * clay * (0.5 * (1.0 + glm::dot(n, mesh.shading_normal())));
    for (const Material& material : {diffuse(clay), rough_diffuse(clay, 0.0)})
        for (const Integrator integrator : {Integrator::path, Integrator::next_event}) {
            Scene scene = mesh.seen_from(n, material, sky);
            scene.background.sampled = true;
            check_mean(all, scene, settings_of(8, 3, integrator), 1024, expected, roundings);
        }
}

TEST_CASE("smooth mirrors, conductors and glass turn light about the shading normal, if it stays on its side") {
    auto& all = tracers();
    const SmoothTriangle mesh;
    const dvec3 n = mesh.own_normal(), n_s = mesh.shading_normal(), down(2.0, 0.0, 1.0), up(0.5, 1.0, 2.0);
    const auto sky = [&](const dvec3& w) { return glm::mix(down, up, 0.5 * (w.y + 1.0)); };
    const auto seen_from = [&](const dvec3& eye, const Material& material) {
        Scene scene = mesh.seen_from(eye, material);
        scene.background.down = down;
        scene.background.up = up;
        return scene;
    };
    const dvec3 eye = glm::normalize(n + 1.5 * n_s);
    const dvec3 mirrored = -eye + 2.0 * glm::dot(eye, n_s) * n_s;
    REQUIRE(glm::dot(mirrored, n) > 0.0);
    for (const Material& material : {mirror(clay), conductor(dvec3(0.0), dvec3(1.0))})
        check_every_pixel(all, seen_from(eye, material), settings_of(3, 2), 64,
            sky(mirrored) * (material.kind == MaterialKind::specular ? clay : white), roundings);
    // Reflected into the surface, the path ends.
    const dvec3 aslant = mesh.towards_lean(-0.08 * pi);
    REQUIRE(glm::dot(aslant, n_s) > 0.0);
    REQUIRE(glm::dot(-aslant + 2.0 * glm::dot(aslant, n_s) * n_s, n) < 0.0);
    check_every_pixel(all, seen_from(aslant, mirror(clay)), settings_of(3, 2), 64, black, roundings);

    const double index = 1.5, c = glm::dot(eye, n_s), ct = std::sqrt(1.0 - (1.0 - c * c) / (index * index));
    const dvec3 refracted = -eye / index + (c / index - ct) * n_s;
    const double rs = (c - index * ct) / (c + index * ct), rp = (index * c - ct) / (index * c + ct);
    const double reflectance = 0.5 * (rs * rs + rp * rp);
    REQUIRE(glm::dot(refracted, n) < 0.0);
    check_mean(all, seen_from(eye, glass(index)), settings_of(4, 2), 1024,
        reflectance * sky(mirrored) + (1.0 - reflectance) * sky(refracted), roundings);
}
