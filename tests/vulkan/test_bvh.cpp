// Trees over primitives: their shape on the host, and the same image bits as loops on the device.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/vector_relational.hpp>
#include <limits>

#include "common/render/random.h"
#include "tests/vulkan/scenes.h"
#include "vulkan/renderer/scene/bvh.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

double number(std::uint32_t i, std::uint32_t k) { return to_unit<double>(random_block(5, i, k / 4, 3)[k % 4]); }
glm::dvec3 point(std::uint32_t i, std::uint32_t k) { return {number(i, k), number(i, k + 1), number(i, k + 2)}; }

struct Tree {
    std::vector<gpu::BvhNode> nodes;
    std::uint32_t root = 0;
};

constexpr std::array qualities{HierarchyQuality::high, HierarchyQuality::medium, HierarchyQuality::low};

Tree tree_of(const std::vector<Box>& boxes, HierarchyQuality quality = HierarchyQuality::high) {
    Tree tree;
    tree.root = build_bvh(boxes, tree.nodes, quality);
    return tree;
}

// What a ray through the scene pays for inner nodes, up to a factor: the areas of their children's boxes.
double cost_of(const Tree& tree) {
    double cost = 0.0;
    for (const gpu::BvhNode& node : tree.nodes)
        for (const gpu::Vec3& half : {node.half0, node.half1})
            cost += double{half.x} * double{half.y} + double{half.y} * double{half.z} + double{half.z} * double{half.x};
    return cost;
}

bool holds(double centre, double half, double low, double high) {
    return centre - half <= low && centre + half >= high;
}
bool holds(const gpu::Vec3& centre, const gpu::Vec3& half, const Box& box) {
    return holds(centre.x, half.x, box.low.x, box.high.x) && holds(centre.y, half.y, box.low.y, box.high.y) &&
           holds(centre.z, half.z, box.low.z, box.high.z);
}

// Levels of inner nodes below `child`; counts each leaf and checks that the boxes on the way hold it.
struct Walk {
    const Tree& tree;
    const std::vector<Box>& boxes;
    std::vector<int> seen = std::vector<int>(boxes.size());
    std::vector<std::pair<gpu::Vec3, gpu::Vec3>> path{};
    bool all_held = true;

    std::uint32_t levels(std::uint32_t child) {
        if ((child & bvh_leaf) != 0) {
            const std::uint32_t leaf = child & ~bvh_leaf;
            ++seen.at(leaf);
            for (const auto& [centre, half] : path) all_held = all_held && holds(centre, half, boxes[leaf]);
            return 0;
        }
        const gpu::BvhNode& node = tree.nodes.at(child);
        path.emplace_back(node.centre0, node.half0);
        const std::uint32_t below0 = levels(node.child0);
        path.back() = {node.centre1, node.half1};
        const std::uint32_t below1 = levels(node.child1);
        path.pop_back();
        return 1 + std::max(below0, below1);
    }
};

void check_tree(const std::vector<Box>& boxes) {
    for (const HierarchyQuality quality : qualities) {
        CAPTURE(hierarchy_quality_names[static_cast<std::size_t>(quality)]);
        const Tree tree = tree_of(boxes, quality);
        Walk walk{tree, boxes};
        CHECK(walk.levels(tree.root) <= most_bvh_levels);
        CHECK(walk.all_held);
        CHECK(std::ranges::all_of(walk.seen, [](int count) { return count == 1; }));
    }
}

Estimate image(const Scene& scene, const RenderSettings& settings, Acceleration acceleration) {
    return default_renderer(acceleration).prepare(scene, settings)->render({0, 8}).estimate;
}

bool same_image(const Scene& scene) {
    for (const Integrator integrator : {Integrator::path, Integrator::next_event}) {
        RenderSettings settings = settings_of(32, 5, integrator);
        const Estimate loops = image(scene, settings, Acceleration::loops);
        if (image_mean(loops) == 0.0) return false;  // nothing would be compared
        for (const HierarchyQuality quality : qualities) {
            settings.hierarchy = quality;
            if (!same_bits(loops, image(scene, settings, Acceleration::trees))) return false;
        }
    }
    return true;
}

// A bumpy sheet of 2 n^2 triangles with shared edges, under a lamp.
Scene sheet(std::uint32_t n, double size) {
    SceneBuilder builder;
    builder.camera(size * glm::dvec3{0.3, 1.4, 1.6}, glm::dvec3(0.0)).background({0.2, 0.2, 0.2}, {0.5, 0.6, 0.9});
    const std::uint32_t grey = builder.material(diffuse(glm::dvec3(0.7)));
    const std::uint32_t silver = builder.material(mirror(glm::dvec3(0.9), 0.1));
    const auto at = [&](std::uint32_t i, std::uint32_t k) {
        const double x = 2.0 * i / n - 1.0, z = 2.0 * k / n - 1.0;
        return size * glm::dvec3(x, 0.2 * std::sin(7.0 * x) * std::cos(5.0 * z), z);
    };
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t k = 0; k < n; ++k)
            builder.quad((i + k) % 2 == 0 ? grey : silver, {at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)});
    builder.sphere(builder.material(emitter(glm::dvec3(5.0))), size * glm::dvec3{0.4, 1.0, -0.2}, 0.2 * size);
    return builder.scene();
}

// Small spheres, turned cuboids and ellipsoids on a great sphere.
Scene crowd(std::uint32_t count) {
    SceneBuilder builder;
    builder.camera({13.0, 2.0, 3.0}, glm::dvec3(0.0), 30.0).background(glm::dvec3(1.0), {0.5, 0.7, 1.0});
    const std::array materials{builder.material(diffuse({0.7, 0.4, 0.3})),
        builder.material(mirror({0.8, 0.8, 0.9}, 0.2)), builder.material(glass(1.5)),
        builder.material(emitter(glm::dvec3(2.0)))};
    builder.sphere(materials[0], {0.0, -1000.0, 0.0}, 1000.0);
    for (std::uint32_t i = 0; i < count; ++i) {
        const glm::dvec3 place = glm::dvec3(22.0, 0.0, 22.0) * point(i, 0) + glm::dvec3(-11.0, 0.2, -11.0);
        const glm::dmat4 turned = glm::rotate(glm::translate(glm::dmat4(1.0), place), 6.0 * number(i, 3), point(i, 4));
        const std::uint32_t material = materials[i % 4];
        if (i % 3 == 0) builder.sphere(material, place, 0.2);
        if (i % 3 == 1) builder.cuboid(material, glm::dvec3(-0.2), {0.1, 0.2, 0.3}, turned);
        if (i % 3 == 2) builder.sphere(material, glm::dvec3(0.0), 0.2, glm::scale(turned, {1.0, -0.5, 1.5}));
    }
    return builder.scene();
}

}  // namespace

TEST_CASE("a tree holds every box once, in boxes around it, within the stack's levels") {
    std::vector<Box> random;
    for (std::uint32_t i = 0; i < 5000; ++i) random.push_back({point(i, 0), point(i, 0) + 0.1 * point(i, 4)});
    check_tree(random);
    check_tree({random[0]});
    check_tree({random[0], random[1]});
}

TEST_CASE("a tree over equal, flat or huge boxes holds them within the stack's levels") {
    check_tree(std::vector<Box>(1000, Box{glm::dvec3(-1.0), glm::dvec3(1.0)}));
    std::vector<Box> flat, huge;
    for (std::uint32_t i = 0; i < 300; ++i) {
        const glm::dvec3 low(number(i, 0), 0.0, number(i, 1));
        flat.push_back({low, low + glm::dvec3(0.1, 0.0, 0.1)});
        huge.push_back({1e30 * point(i, 0) - 0.5e30, 1e30 * point(i, 0) + 0.5e30});
    }
    check_tree(flat);
    check_tree(huge);
}

TEST_CASE("a chain that would be split off one by one stays within the stack's levels") {
    std::vector<Box> chain;
    for (int i = 0; i < 200; ++i)
        chain.push_back({glm::dvec3(std::ldexp(1.0, i - 100)), glm::dvec3(std::ldexp(1.5, i - 100))});
    check_tree(chain);
}

TEST_CASE("better trees have smaller boxes, and a tree of low quality is balanced") {
    // Small boxes and a few long ones, in clusters of unequal size.
    std::vector<Box> boxes;
    for (std::uint32_t i = 0; i < 4000; ++i) {
        const glm::dvec3 low = std::pow(number(i, 6), 3.0) * glm::dvec3(9.0, 5.0, 2.0) + 0.3 * point(i, 0);
        boxes.push_back({low, low + (i % 50 == 0 ? glm::dvec3(1.0, 0.01, 0.01) : glm::dvec3(0.02))});
    }
    const double high = cost_of(tree_of(boxes, HierarchyQuality::high)),
                 medium = cost_of(tree_of(boxes, HierarchyQuality::medium)),
                 low = cost_of(tree_of(boxes, HierarchyQuality::low));
    CAPTURE(high);
    CAPTURE(medium);
    CAPTURE(low);
    CHECK(high < medium);
    CHECK(medium < low);
    const Tree balanced = tree_of(boxes, HierarchyQuality::low);
    CHECK(Walk{balanced, boxes}.levels(balanced.root) == 12);  // 2^12 = 4096
}

TEST_CASE("a job tells how long its trees took to build, and kernels without trees that they have none") {
    const auto seconds = [](const Scene& scene, Acceleration acceleration) {
        return default_renderer(acceleration).prepare(scene, settings_of(8, 1))->facts().hierarchy_seconds;
    };
    CHECK(seconds(sheet(60, 1.0), Acceleration::trees) > 0.0);
    CHECK(seconds(sheet(60, 1.0), Acceleration::loops) == 0.0);
}

TEST_CASE("trees and loops give the same image bits") {
    CHECK(same_image(full_scene()));
    CHECK(same_image(crowd(150)));
    CHECK(same_image(sheet(12, 1.0)));
}

TEST_CASE("trees and loops give the same image bits far from the size of 1") {
    CHECK(same_image(sheet(6, 1e9)));
    CHECK(same_image(sheet(6, 1e-6)));
}

TEST_CASE("trees and loops give the same image bits where primitives coincide") {
    SceneBuilder builder;
    builder.camera({0.5, 0.7, 4.0}, glm::dvec3(0.0)).background(glm::dvec3(0.3), glm::dvec3(0.8));
    for (const double albedo : {0.2, 0.4, 0.6, 0.8}) {
        const std::uint32_t grey = builder.material(diffuse(glm::dvec3(albedo)));
        builder.sphere(grey, {-0.8, 0.0, 0.0}, 0.5).cuboid(grey, {0.2, -0.5, -0.5}, {1.0, 0.5, 0.5});
        builder.quad(grey, {glm::dvec3{-2, -1, -1}, {2, -1, -1}, {2, 1, -1}, {-2, 1, -1}});
    }
    CHECK(same_image(builder.scene()));
}

TEST_CASE("a tree of one primitive and of none are traced") {
    SceneBuilder builder;
    builder.camera({0.0, 0.0, 4.0}, glm::dvec3(0.0)).background(glm::dvec3(0.3), glm::dvec3(0.8));
    CHECK(same_image(builder.scene()));
    builder.sphere(builder.material(diffuse(glm::dvec3(0.5))), glm::dvec3(0.0), 1.0);
    CHECK(same_image(builder.scene()));
}

// The benchmark is tests/benchmarks/growth.cpp. Here: a thousand times the triangles must not cost a thousand times the
// time, nor anything near it. The quickest of several runs, as others may be at work on the machine.
TEST_CASE("a thousand times the triangles cost less than a hundred times the time") {
    const auto quickest = [](std::uint32_t n) {
        const auto job = default_renderer(Acceleration::trees).prepare(sheet(n, 1.0), settings_of(48, 4));
        static_cast<void>(job->render({0, 1}));
        double seconds = std::numeric_limits<double>::infinity();
        for (int run = 0; run < 5; ++run) {
            const RenderResult result = job->render({0, 8});
            seconds = std::min(seconds, result.device_seconds.value_or(result.seconds));
        }
        return seconds;
    };
    const double few = quickest(7), many = quickest(224);
    CAPTURE(few);
    CAPTURE(many);
    CHECK(many < 100.0 * few);
}
