// Kernels that pick the triangles a ray may meet before they test any find what kernels find that test every one.
#include <doctest/doctest.h>

#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/thorough.h"
#include "tests/vulkan/machine.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

// Triangles of the cube [0, 1]^3, corner i being at its bits; faces are cut either way.
const Triangles cube{{0, 4, 6}, {0, 6, 2}, {1, 3, 5}, {3, 7, 5}, {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3}, {0, 2, 3},
    {0, 3, 1}, {4, 5, 6}, {5, 7, 6}};

// An entity of triangles of a cube's corners.
void add_triangles(Scene& scene, const Triangles& triangles, const glm::dmat4& m, std::uint32_t material) {
    const auto first = static_cast<std::uint32_t>(scene.vertices.size());
    for (std::uint32_t i = 0; i < 8; ++i) scene.vertices.emplace_back(i & 1u, i >> 1 & 1u, i >> 2);
    Entity entity;
    entity.material = material;
    entity.first_primitive = static_cast<std::uint32_t>(scene.primitives.size());
    entity.primitive_count = static_cast<std::uint32_t>(triangles.size());
    entity.object_to_world = m;
    scene.entities.push_back(entity);
    for (const auto& [a, b, c] : triangles)
        scene.primitives.push_back({PrimitiveKind::triangle, {first + a, first + b, first + c}, 0.0});
}

glm::dmat4 turned(double degrees, glm::dvec3 axis, glm::dvec3 size, glm::dvec3 at) {
    return glm::scale(
        glm::rotate(glm::translate(glm::dmat4(1.0), at), glm::radians(degrees), glm::normalize(axis)), size);
}

struct Case {
    std::string name;
    glm::dmat4 m;
    glm::dvec3 eye, target;
    double field;
};

// From the harmless to where a face is as small as the rounding of its corners.
std::vector<Case> cases() {
    glm::dmat4 sheared = turned(20, {1, 2, 3}, {1, 1, 1}, {0, 0, 0});
    sheared[1] += 0.7 * sheared[0];
    sheared[2] -= 0.4 * sheared[1];
    const glm::dvec3 far{700, -300, 500};
    return {{"turned", turned(33, {1, 3, -2}, {1, 1, 1}, {-0.3, -0.4, -0.5}), {2, 2.5, 3}, {0, 0, 0}, 30},
        {"mirrored", turned(200, {1, 0, 2}, {-1, 0.5, 2}, {0.5, 0, -1}), {3, 2.5, 3}, {0, 0, 0}, 40},
        {"sheared", sheared, {3, 2.5, 3}, {0.5, 0.5, 0.5}, 40},
        {"plate", turned(33, {1, 3, -2}, {1, 1e-5, 1}, {-0.3, 0, -0.5}), {1, 1e-4, 3}, {0, 0, 0}, 30},
        {"rod", turned(70, {1, 3, -2}, {1e-4, 1, 1e-4}, {0, -0.5, 0}), {0.05, 0, 0.02}, {0, 0, 0}, 1},
        {"square to the axes", turned(0, {0, 1, 0}, {1, 1, 1}, {0, 0, 0}), {0.5, 0.5, 4}, {0.5, 0.5, 0}, 30},
        {"inside", turned(33, {1, 3, -2}, {9, 8, 7}, {-4, -4, -4}), {0.1, 0.2, 0}, {1, 0.4, 2}, 90},
        {"far", turned(33, {1, 3, -2}, {0.002, 0.003, 0.002}, far), far + glm::dvec3(40, 50, 60), far, 0.004},
        {"as small as its rounding", turned(33, {1, 3, -2}, {3e-4, 4e-4, 3e-4}, far), far + glm::dvec3(4, 5, 6), far,
            0.01}};
}

Estimate image_of(Machine& machine, const Scene& scene, CandidatePattern candidates, KernelShape kernel) {
    JobPatterns patterns;
    patterns.tracer.kernel = kernel;
    patterns.tracer.candidates = candidates;
    return machine.job(patterns, scene, settings_of(40, 5)).render({0, 12}, {}).estimate;
}

}  // namespace

TEST_CASE("Rays meet what they meet whichever triangles are tested in full") {
    Machine machine(true);
    const std::vector<Case> all = cases();
    for (std::size_t i = 0; i < all.size(); i += test::thorough() ? 1 : 2) {
        const Case& one = all[i];
        CAPTURE(one.name);
        SceneBuilder builder;
        builder.camera(one.eye, one.target, one.field).background(glm::dvec3(1.0), glm::dvec3(0.2, 0.5, 0.9));
        add_triangles(builder.scene(), cube, one.m, builder.material(glass(1.5)));
        // A second cube, open on one side, and a triangle in the way.
        add_triangles(builder.scene(), {cube.begin() + 2, cube.end()}, glm::translate(one.m, glm::dvec3(0.3, 0.9, 0.2)),
            builder.material(diffuse(glm::dvec3(0.8))));
        const auto placed = [&](glm::dvec3 v, double w) { return glm::dvec3(one.m * glm::dvec4(v, w)); };
        const glm::dvec3 below = placed({0.5, -0.2, 0.5}, 1), along = placed({4, 0, 0}, 0),
                         beside = placed({0, 0, 4}, 0);
        builder.triangle(1, {below - along - beside, below + along - beside, below + beside});
        const Estimate expected = image_of(machine, builder.scene(), CandidatePattern::every, KernelShape::stages);
        for (const KernelShape kernel : {KernelShape::stages, KernelShape::megakernel})
            CHECK(same_bits(image_of(machine, builder.scene(), CandidatePattern::edges, kernel), expected));
    }
}

// Devices that are no CPU render like this by themselves.
TEST_CASE("Candidates leave every shipped scene of few triangles as it is" * doctest::test_suite("full")) {
    Machine machine(false);
    int scenes = 0;
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".json") continue;
        const Scene scene = load_scene(entry.path());
        CAPTURE(scene.name);
        const RenderSettings settings = with_longer_side(default_settings(scene), 32);
        const auto image = [&](CandidatePattern candidates) {
            JobPatterns patterns;
            patterns.tracer.candidates = candidates;
            return machine.job(patterns, scene, settings).render({0, 8}, {}).estimate;
        };
        try {
            const Estimate picked = image(CandidatePattern::edges);
            const Estimate expected = image(CandidatePattern::every);
            ++scenes;
            CHECK(same_bits(picked, expected));
        } catch (const UnsupportedError&) {
            continue;  // no triangles, or too many
        }
    }
    CHECK(scenes >= 2);
}

TEST_CASE("Candidates are refused where there are none to pick") {
    Machine machine(false);
    SceneBuilder builder;
    builder.camera({3, 4, 5}, {0, 0, 0}).background(glm::dvec3(1.0), glm::dvec3(1.0));
    builder.sphere(builder.material(diffuse(glm::dvec3(0.8))), {0, 0, 0}, 1.0);
    CHECK_THROWS_WITH_AS(image_of(machine, builder.scene(), CandidatePattern::edges, KernelShape::stages),
        doctest::Contains("a few triangles"), UnsupportedError);
}
