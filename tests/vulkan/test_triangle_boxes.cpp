// Boxes that are made of triangles: which sets of triangles are boxes, and that the triangles that a box says a ray may
// meet are all that it meets.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/vulkan/machine.h"
#include "vulkan/renderer/kernels/unrolled_primitives.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

// Triangles of the cube [0, 1]^3, corner i being at its bits; faces are cut either way.
const Triangles cube{{0, 4, 6}, {0, 6, 2}, {1, 3, 5}, {3, 7, 5}, {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3}, {0, 2, 3},
    {0, 3, 1}, {4, 5, 6}, {5, 7, 6}};

// An entity of triangles of a cube's corners, which `moved` may have changed.
void add_triangles(Scene& scene, const Triangles& triangles, const glm::dmat4& m, std::uint32_t material = 0,
    const std::function<glm::dvec3(glm::dvec3)>& moved = {}) {
    const auto first = static_cast<std::uint32_t>(scene.vertices.size());
    for (std::uint32_t i = 0; i < 8; ++i) {
        const glm::dvec3 corner(i & 1u, i >> 1 & 1u, i >> 2);
        scene.vertices.push_back(moved ? moved(corner) : corner);
    }
    Entity entity;
    entity.material = material;
    entity.first_primitive = static_cast<std::uint32_t>(scene.primitives.size());
    entity.primitive_count = static_cast<std::uint32_t>(triangles.size());
    entity.object_to_world = m;
    scene.entities.push_back(entity);
    for (const auto& [a, b, c] : triangles)
        scene.primitives.push_back({PrimitiveKind::triangle, {first + a, first + b, first + c}, 0.0});
}

std::vector<TriangleBox> boxes_of(const Scene& scene) {
    const SceneData data = flatten(scene, settings_of(8, 2), Acceleration::automatic);
    return find_triangle_boxes(data, describe_unrolled(data).corners);
}

std::vector<TriangleBox> boxes_among(
    const Triangles& triangles, const std::function<glm::dvec3(glm::dvec3)>& moved = {}, glm::dvec3 motion = {}) {
    SceneBuilder builder;
    builder.camera({3, 4, 5}, {0, 0, 0});
    builder.material(diffuse(glm::dvec3(0.5)));
    add_triangles(builder.scene, triangles, glm::dmat4(1.0), 0, moved);
    builder.scene.entities.back().motion = motion;
    return boxes_of(builder.scene);
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
    Patterns patterns;
    patterns.kernel = kernel;
    patterns.candidates = candidates;
    return machine.job(patterns, scene, settings_of(40, 5)).render({0, 12}, {}).estimate;
}

}  // namespace

TEST_CASE("The thesis's glass cube is a box, each half of a face where it is") {
    const Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / "cornell-thesis.json");
    const std::vector<TriangleBox> boxes = boxes_of(scene);
    REQUIRE(boxes.size() == 1);
    const TriangleBox& box = boxes[0];
    CHECK(is_selective(box));
    CHECK(std::set<std::uint8_t>(box.slots.begin(), box.slots.end()).size() == 12);
    const Entity& entity = scene.entities.back();
    const auto in_box = [&](glm::dvec3 vertex) {
        const glm::dvec3 world = glm::dvec3(entity.object_to_world * glm::dvec4(vertex, 1.0));
        glm::dvec3 result(0.0);
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t j = 0; j < 3; ++j)
                result[static_cast<int>(k)] += static_cast<double>(box.to_box[3 * k + j]) *
                                               (world[static_cast<int>(j)] - static_cast<double>(box.centre[j]));
        return result;
    };
    for (std::size_t place = 0; place < 12; ++place) {
        const Primitive& primitive = scene.primitives[entity.first_primitive + box.slots[place]];
        glm::dvec3 middle(0.0);
        for (const std::uint32_t vertex : primitive.index) middle += in_box(scene.vertices[vertex]) / 3.0;
        const std::size_t face = place / 2;
        const int k = static_cast<int>(face / 2);
        CHECK(middle[k] == doctest::Approx(face % 2 == 0 ? -1.0 : 1.0));
        const double i = middle[(k + 1) % 3], j = middle[(k + 2) % 3];
        const double across = (box.rising >> face & 1u) != 0 ? i - j : i + j;
        CHECK((place % 2 == 0 ? across : -across) > 0.5);
    }
}

TEST_CASE("Boxes may be open or turned over; what is bent, doubled, too much or moves is none") {
    CHECK(boxes_among(cube).size() == 1);
    const auto open = boxes_among({cube.begin() + 2, cube.end()});
    REQUIRE(open.size() == 1);
    CHECK(std::ranges::count(open[0].slots, no_triangle) == 2);
    Triangles inverted = cube;
    for (auto& [a, b, c] : inverted) std::swap(b, c);
    CHECK(boxes_among(inverted).size() == 1);

    CHECK(boxes_among(cube, [](glm::dvec3 p) { return p.x * p.y * p.z == 1.0 ? 1.01 * p : p; }).empty());
    CHECK(boxes_among(cube, [](glm::dvec3 p) { return glm::dvec3(p.x, p.y, 0.0); }).empty());
    CHECK(boxes_among(cube, {}, {0.1, 0, 0}).empty());
    for (const std::array<std::uint32_t, 3> extra :
        {std::array{0u, 4u, 6u}, {0u, 4u, 2u}, {1u, 2u, 4u}, {0u, 7u, 1u}}) {
        Triangles more = cube;
        more.push_back(extra);
        CHECK(boxes_among(more).empty());
    }
    Triangles twisted = cube;  // one face covered twice in one half, cut the other way
    twisted[1] = {0, 2, 4};
    CHECK(boxes_among(twisted).empty());
}

TEST_CASE("Two boxes and what is no box keep apart") {
    SceneBuilder builder;
    builder.camera({3, 4, 5}, {0, 0, 0});
    builder.material(diffuse(glm::dvec3(0.5)));
    add_triangles(builder.scene, cube, turned(10, {0, 1, 0}, {1, 1, 1}, {0, 0, 0}));
    builder.triangle(0, {{{-3, 0, -3}, {3, 0, -3}, {0, 0, 3}}});
    add_triangles(builder.scene, cube, turned(40, {0, 1, 0}, {1, 2, 1}, {2, 0, 0}));
    const std::vector<TriangleBox> boxes = boxes_of(builder.scene);
    REQUIRE(boxes.size() == 2);
    CHECK(*std::ranges::max_element(boxes[0].slots) == 11);
    CHECK(*std::ranges::min_element(boxes[1].slots) == 13);
}

TEST_CASE("Kernels use the boxes whose margin leaves something to tell") {
    const auto used = [](glm::dvec3 size, glm::dvec3 at) {
        SceneBuilder builder;
        builder.camera({3, 4, 5}, {0, 0, 0});
        builder.material(diffuse(glm::dvec3(0.5)));
        add_triangles(builder.scene, cube, turned(30, {1, 1, 0}, size, at));
        return !describe_unrolled(flatten(builder.scene, settings_of(8, 2), Acceleration::automatic)).boxes.empty();
    };
    CHECK(used({1, 1, 1}, {1, 2, 3}));
    CHECK(used({1, 0.05, 1}, {0, 0, 0}));
    CHECK_FALSE(used({1, 0.001, 1}, {0, 0, 0}));
    CHECK_FALSE(used({1, 1, 1}, {1e4, 0, 0}));
}

TEST_CASE("Rays meet what they meet whichever triangles are tested in full") {
    Machine machine(true);
    for (const Case& one : cases()) {
        CAPTURE(one.name);
        SceneBuilder builder;
        builder.camera(one.eye, one.target, one.field).background(glm::dvec3(1.0), glm::dvec3(0.2, 0.5, 0.9));
        add_triangles(builder.scene, cube, one.m, builder.material(glass(1.5)));
        // A second one, and triangles that are none, in the way.
        add_triangles(builder.scene, {cube.begin() + 2, cube.end()}, glm::translate(one.m, glm::dvec3(0.3, 0.9, 0.2)),
            builder.material(diffuse(glm::dvec3(0.8))));
        const auto placed = [&](glm::dvec3 v, double w) { return glm::dvec3(one.m * glm::dvec4(v, w)); };
        const glm::dvec3 below = placed({0.5, -0.2, 0.5}, 1), along = placed({4, 0, 0}, 0),
                         beside = placed({0, 0, 4}, 0);
        builder.triangle(1, {below - along - beside, below + along - beside, below + beside});
        REQUIRE(boxes_of(builder.scene).size() == 2);
        const Estimate expected = image_of(machine, builder.scene, CandidatePattern::every, KernelShape::stages);
        for (const KernelShape kernel : {KernelShape::stages, KernelShape::megakernel})
            for (const CandidatePattern candidates : {CandidatePattern::edges, CandidatePattern::boxes})
                CHECK(same_bits(image_of(machine, builder.scene, candidates, kernel), expected));
    }
}

// Devices that are no CPU render like this by themselves.
TEST_CASE("Candidates leave every shipped scene of few triangles as it is") {
    Machine machine(false);
    int edges = 0, boxes = 0;
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".json") continue;
        const Scene scene = load_scene(entry.path());
        CAPTURE(scene.name);
        const RenderSettings settings = with_longer_side(default_settings(scene), 32);
        const auto image = [&](CandidatePattern candidates) {
            Patterns patterns;
            patterns.candidates = candidates;
            return machine.job(patterns, scene, settings).render({0, 8}, {}).estimate;
        };
        try {
            const Estimate picked = image(CandidatePattern::edges);
            const Estimate expected = image(CandidatePattern::every);
            ++edges;
            CHECK(same_bits(picked, expected));
            const Estimate boxed = image(CandidatePattern::boxes);
            ++boxes;
            CHECK(same_bits(boxed, expected));
        } catch (const UnsupportedError&) {
            continue;  // no triangles, too many, or no box among them
        }
    }
    CHECK(edges >= 2);
    CHECK(boxes >= 1);
}

TEST_CASE("Candidates are refused where there are none to pick") {
    Machine machine(false);
    SceneBuilder builder;
    builder.camera({3, 4, 5}, {0, 0, 0}).background(glm::dvec3(1.0), glm::dvec3(1.0));
    builder.sphere(builder.material(diffuse(glm::dvec3(0.8))), {0, 0, 0}, 1.0);
    CHECK_THROWS_WITH_AS(image_of(machine, builder.scene, CandidatePattern::edges, KernelShape::stages),
        doctest::Contains("a few triangles"), UnsupportedError);
    builder.triangle(0, {{{-3, 0, -3}, {3, 0, -3}, {0, 0, 3}}});
    CHECK_THROWS_WITH_AS(image_of(machine, builder.scene, CandidatePattern::boxes, KernelShape::stages),
        doctest::Contains("no box"), UnsupportedError);
}
