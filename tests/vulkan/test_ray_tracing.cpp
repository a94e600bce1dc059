// The kernel shapes whose hits the device's own traversal finds. With Tandem's tests of primitives they have the bits
// of the six stages, with the device's test of triangles the same expectation. A device that has no such traversal, or
// cannot do what is asked, says so with a reason.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <glm/ext/matrix_transform.hpp>

#include "common/error.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/vulkan/machine.h"
#include "vulkan/renderer/kernels/kernel_shape.h"
#include "vulkan/renderer/scene/traced_world.h"
#include "vulkan/renderer/scene/world_boxes.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

constexpr std::array own_tests{KernelShape::ray_tracing, KernelShape::ray_query};
constexpr std::array device_tests{KernelShape::ray_tracing_triangles, KernelShape::ray_query_triangles};

JobPatterns shaped(KernelShape shape) {
    JobPatterns patterns;
    patterns.tracer.kernel = shape;
    return patterns;
}

bool has(const Machine& machine, KernelShape shape) {
    const DeviceFeatures& features = machine.device.features();
    return has_ray_pipeline(shape) ? features.ray_tracing : features.ray_queries;
}

// Says so, for ctest to show the test as skipped, if the device has none of the shapes.
bool has_any(const Machine& machine, std::span<const KernelShape> shapes) {
    const bool any = std::ranges::any_of(shapes, [&](KernelShape shape) { return has(machine, shape); });
    if (!any) MESSAGE("SKIPPED: " << machine.device.description().name << " has no ray tracing");
    return any;
}

Estimate image(
    Machine& machine, KernelShape shape, const Scene& scene, const RenderSettings& settings, SampleRange range) {
    return machine.job(shaped(shape), scene, settings).render(range, {}).estimate;
}

// Each shape that the device has.
void check_bits(Machine& machine, const Scene& scene, const RenderSettings& settings, SampleRange range) {
    CAPTURE(scene.name);
    const Estimate expected = image(machine, KernelShape::megakernel, scene, settings, range);
    const EffectSet needed = needed_effects(scene, settings);
    for (const KernelShape shape : own_tests) {
        if (!has(machine, shape)) continue;
        CAPTURE(static_cast<int>(shape));
        const Estimate found = image(machine, shape, scene, settings, range);
        if (!needed.has(Effect::light_sampling) || !needed.has(Effect::medium_absorption)) {
            CHECK(same_bits(found, expected));
            continue;
        }
        // How far it is to a sampled light is a root, which Vulkan lets a driver round as it likes. NVIDIA's 580 does
        // so otherwise in this kind of shader. Only absorption on the way there lets it be seen: in single ulps.
        for (int channel = 0; channel < 3; ++channel)
            CHECK(image_mean(found, channel) == doctest::Approx(image_mean(expected, channel)).epsilon(1e-5));
    }
}

// By the same random numbers, whose paths part only where a device's rounding decides what is hit.
void check_expectation(Machine& machine, const Scene& scene, const RenderSettings& settings, SampleRange range) {
    CAPTURE(scene.name);
    const Estimate expected = image(machine, KernelShape::megakernel, scene, settings, range);
    for (const KernelShape shape : device_tests) {
        if (!has(machine, shape)) continue;
        CAPTURE(static_cast<int>(shape));
        const Estimate found = image(machine, shape, scene, settings, range);
        double sum = 0.0, squares = 0.0;
        const std::vector<double> a = mean_of(expected), b = mean_of(found);
        for (std::size_t i = 0; i < a.size(); ++i) {
            sum += b[i] - a[i];
            squares += (b[i] - a[i]) * (b[i] - a[i]);
        }
        const double rounding = 1e-5 * static_cast<double>(a.size()) * image_mean(expected);
        CHECK(std::abs(sum) <= 5.0 * std::sqrt(squares) + rounding);
        CHECK(found.invalid() == expected.invalid());
    }
}

// Equal distances everywhere: bodies that share faces, triangles twice, and more than two of a kind.
Scene ties() {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 3.0}, {0.0, 0.0, 0.0}, 60.0).background(glm::dvec3(1.0), glm::dvec3(1.0));
    for (const double colour : {0.2, 0.4, 0.6, 0.8}) {
        const std::uint32_t material = builder.material(diffuse(glm::dvec3(colour, 1.0 - colour, 0.5)));
        builder.quad(material, {{{-1, -1, 0}, {0.5, -1, 0}, {0.5, 0.5, 0}, {-1, 0.5, 0}}});
        builder.cuboid(material, {0.0, -0.5, -1.0}, {1.0, 0.5, 0.0});
        builder.sphere(material, {-0.5, 0.5, 0.25}, 0.5);
    }
    return builder.scene();
}

// Triangles, at rest and moving, in fog that is thin enough for rays to leave the scene far behind and come back.
Scene moving_in_fog(double scattering) {
    SceneBuilder builder;
    Scene& scene = builder.scene();
    builder.camera({0.1, 0.2, 3.0}, {0.0, 0.0, 0.0}, 60.0).background({0.2, 0.4, 0.8}, glm::dvec3(1.0));
    builder.quad(diffuse({0.8, 0.5, 0.3}), {{{-1, -1, 0}, {1, -1, 0}, {1, -1, -2}, {-1, -1, -2}}});
    builder.quad(emitter({3.0, 2.0, 1.0}), {{{-0.3, 0.9, 0}, {0.3, 0.9, 0}, {0.3, 0.9, -0.6}, {-0.3, 0.9, -0.6}}});
    builder.triangle(diffuse({0.2, 0.8, 0.4}), {-0.8, -0.8, -0.5}, {0.2, -0.8, -0.5}, {-0.3, 0.4, -0.7});
    scene.entities.back().motion = {0.5, 0.1, 0.2};
    builder.sphere(glass(1.5), {0.5, -0.5, -0.6}, 0.4);
    scene.entities.back().motion = {-0.2, 0.3, 0.0};
    builder.cuboid(diffuse({0.5, 0.5, 0.9}), {-0.9, -1.0, -1.8}, {-0.4, -0.2, -1.3});
    scene.entities.back().motion = {0.0, 0.2, 0.1};
    Medium fog;
    fog.scattering = scattering * glm::dvec3(1.0, 0.8, 0.6);
    scene.media = {fog};
    scene.medium = 0;
    return scene;
}

}  // namespace

TEST_CASE("the device's traversal with Tandem's tests gives the bits of the megakernel") {
    Machine machine(false);
    if (!has_any(machine, own_tests)) return;
    check_bits(machine, ties(), settings_of(33, 4), {0, 5});
    for (const double scattering : {1.0, 0.01})
        check_bits(machine, moving_in_fog(scattering), settings_of(33, 8), {0, 9});
    for (const Integrator integrator : {Integrator::path, Integrator::next_event, Integrator::whitted})
        for (const Scene& scene : {full_scene(), outdoor_scene(integrator != Integrator::path), foggy_scene()})
            check_bits(machine, scene, settings_of(13, 5, integrator), {64, 133});
}

TEST_CASE("the device's own test of triangles leaves every expectation as it is") {
    Machine machine(false);
    if (!has_any(machine, device_tests)) return;
    for (const double scattering : {1.0, 0.01})
        check_expectation(machine, moving_in_fog(scattering), settings_of(33, 8), {0, 9});
    for (const Scene& scene : {full_scene(), outdoor_scene(true), foggy_scene()})
        check_expectation(machine, scene, settings_of(13, 5, Integrator::next_event), {64, 133});
}

TEST_CASE("the device's traversal renders shipped scenes as the megakernel does" * doctest::test_suite("full")) {
    Machine machine(false);
    if (!has_any(machine, own_tests)) return;
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".json") continue;
        const Scene scene = load_scene(entry.path());
        RenderSettings settings = with_longer_side(default_settings(scene), 21);
        settings.bounces = std::min(settings.bounces, 6u);
        check_bits(machine, scene, settings, {0, 7});
        check_expectation(machine, scene, settings, {0, 7});
    }
}

// A white quad under a white sky: a path that meets one of its two triangles again ends there, black.
TEST_CASE("rays that leave a triangle of the device's meet neither it nor its neighbour in the same plane") {
    Machine machine(false);
    if (!has_any(machine, device_tests)) return;
    for (const double far : {0.0, 1.0, 100.0})
        for (const double long_side : {1.0, 3.0})
            for (const double turn : {0.0, 0.7, 1.9}) {
                const glm::dvec3 middle(far, 0.7 * far, -0.4 * far), u(std::cos(turn), 0.3, std::sin(turn)),
                    v = glm::cross(u, glm::dvec3(0.2, 0.9, -0.4));
                const glm::dvec3 a = long_side * glm::normalize(u), b = glm::normalize(v);
                SceneBuilder builder;
                builder.camera(middle + 2.0 * glm::normalize(glm::cross(u, v)), middle, 40.0, b);
                builder.background(glm::dvec3(1.0));
                builder.quad(
                    diffuse(glm::dvec3(1.0)), {{middle - a - b, middle + a - b, middle + a + b, middle - a + b}});
                for (const KernelShape shape : device_tests) {
                    if (!has(machine, shape)) continue;
                    CAPTURE(far);
                    CAPTURE(long_side);
                    CAPTURE(turn);
                    CAPTURE(static_cast<int>(shape));
                    const Estimate found = image(machine, shape, builder.scene(), settings_of(32, 1), {0, 64});
                    CHECK(image_mean(found) == doctest::Approx(1.0).epsilon(1e-7));
                }
            }
}

TEST_CASE("a device without ray tracing says so") {
    Machine machine(false);
    const auto refused = [&](KernelShape shape, const char* reason) {
        CHECK_THROWS_WITH_AS(static_cast<void>(machine.job(shaped(shape), ties(), settings_of(4, 1))),
            doctest::Contains(reason), UnsupportedError);
    };
    if (!machine.device.features().ray_tracing) {
        refused(KernelShape::ray_tracing, "has no VK_KHR_ray_tracing_pipeline");
        refused(KernelShape::ray_tracing_triangles, "has no VK_KHR_ray_tracing_pipeline");
    }
    if (!machine.device.features().ray_queries) {
        refused(KernelShape::ray_query, "has no VK_KHR_ray_query");
        refused(KernelShape::ray_query_triangles, "has no VK_KHR_ray_query");
    }
}

TEST_CASE("the device's own test of triangles is no choice beside Tandem's others") {
    RenderSettings settings = settings_of(4, 3);
    for (const KernelShape shape : {KernelShape::ray_tracing_triangles, KernelShape::ray_query})
        CHECK(untraceable(shape, settings).empty());
    settings.intersection.triangles = TriangleKernel::moller_trumbore;
    CHECK(untraceable(KernelShape::ray_query, settings).empty());
    for (const KernelShape shape : device_tests)
        CHECK(untraceable(shape, settings).find("takes the place of --triangle-test") != std::string::npos);
}

TEST_CASE("triangles at rest are the device's, those that move are boxes, and each slot is one of both") {
    const Scene scene = moving_in_fog(1.0);
    const SceneData data = flatten(scene, settings_of(4, 1), Acceleration::loops);
    const PlacedPrimitives all = placed_primitives(scene);
    const TracedGeometry both = traced_geometry(scene, data, {}, true), boxes = traced_geometry(scene, data, {}, false);
    CHECK(boxes.corners.empty());
    REQUIRE(both.corners.size() == 3 * std::size_t{data.triangle_count});
    REQUIRE(both.boxes[0].size() == data.triangle_count);
    std::size_t moving = 0;
    for (std::size_t slot = 0; slot < data.triangle_count; ++slot) {
        const bool moves = scene.entities[all[data.placed[slot].id].entity].motion != glm::dvec3(0.0);
        moving += moves ? 1 : 0;
        for (std::size_t i = 0; i < 3; ++i) CHECK(std::isnan(both.corners[3 * slot + i].x) == moves);
        CHECK(std::isnan(both.boxes[0][slot].minX) != moves);
    }
    CHECK(moving == 1);
    CHECK(both.boxes[1].size() == boxes.boxes[1].size());
    CHECK(both.boxes[2].size() == boxes.boxes[2].size());

    const Scene still = ties();
    const TracedGeometry at_rest =
        traced_geometry(still, flatten(still, settings_of(4, 1), Acceleration::loops), {}, true);
    CHECK(at_rest.boxes[0].empty());
    CHECK(at_rest.corners.size() == 3 * std::size_t{8});
}

TEST_CASE("boxes are wider where media scatter rays beyond the scene") {
    const Scene scene = moving_in_fog(1.0);
    const SceneData data = flatten(scene, settings_of(4, 1), Acceleration::loops);
    EffectSet scatters;
    scatters = scatters.with(Effect::medium_scattering);
    const KindBoxes narrow = traced_geometry(scene, data, {}, false).boxes,
                    wide = traced_geometry(scene, data, scatters, false).boxes;
    const double padding = 16.0 * 0x1p-24 * 16.0 * double{data.header.extent};
    for (std::size_t kind = 0; kind < narrow.size(); ++kind)
        for (std::size_t i = 0; i < narrow[kind].size(); ++i) {
            CHECK(wide[kind][i].minX < narrow[kind][i].minX);
            CHECK(wide[kind][i].maxX - wide[kind][i].minX >= 2.0 * padding);
        }
}

TEST_CASE("the pipeline's boxes hold those of the trees, and more the farther rays begin") {
    for (const double far : {1.0, 1e6}) {
        Scene scene = full_scene();
        scene.camera.position = {far, 0.0, 4.0};
        const SceneData data = flatten(scene, settings_of(4, 1), Acceleration::loops);
        const KindBoxes boxes = traced_geometry(scene, data, {}, false).boxes;
        CHECK(boxes[0].size() == data.triangle_count);
        CHECK(boxes[1].size() == data.sphere_count);
        CHECK(boxes[2].size() == data.cuboid_count);
        const PlacedPrimitives all = placed_primitives(scene);
        std::size_t slot = 0;
        for (const std::vector<vk::AabbPositionsKHR>& kind : boxes)
            for (const vk::AabbPositionsKHR& box : kind) {
                const Box tree = world_box(scene, all[data.placed[slot++].id]);
                const double padding = 16.0 * 0x1p-24 * far;  // gamma(16) is larger yet
                CHECK(box.minX <= tree.low.x - padding);
                CHECK(box.minY <= tree.low.y - padding);
                CHECK(box.minZ <= tree.low.z - padding);
                CHECK(box.maxX >= tree.high.x + padding);
                CHECK(box.maxY >= tree.high.y + padding);
                CHECK(box.maxZ >= tree.high.z + padding);
            }
        CHECK(slot == data.placed.size());
    }
}
