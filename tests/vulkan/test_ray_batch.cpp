// Rays of the caller on the device, and what its shaders promise of rounding.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "common/error.h"
#include "tests/scene_builder.h"
#include "vulkan/backend.h"
#include "vulkan/framework/shader_library.h"
#include "vulkan/framework/spirv_decorations.h"

using namespace tandem;

TEST_CASE("every operation of floating-point arithmetic in the shipped SPIR-V bears NoContraction") {
    std::vector<std::span<const std::uint32_t>> shipped;
    for (std::uint32_t stage = 0; stage <= static_cast<std::uint32_t>(Stage::ray_batch_double); ++stage) {
        shipped.push_back(shader_code(static_cast<Stage>(stage)));
        for (std::uint32_t variant = 1; variant <= static_cast<std::uint32_t>(last_variant); ++variant) {
            const auto code = shader_variant(static_cast<Stage>(stage), static_cast<ShaderVariant>(variant));
            if (!code.empty()) shipped.push_back(code);
        }
    }
    for (std::size_t i = 0; i < shipped.size(); ++i) {
        CAPTURE(i);
        const std::span<const std::uint32_t> code = shipped[i];
        const ContractionCount count = count_no_contraction(code);
        CHECK(count.decorated == count.arithmetic);
        const std::vector<std::uint32_t> bare = without_no_contraction(code);
        CHECK(count_no_contraction(bare).arithmetic == count.arithmetic);
        CHECK(count_no_contraction(bare).decorated == 0);
    }
    CHECK(count_no_contraction(shader_code(Stage::intersect)).arithmetic > 100);
    CHECK(count_no_contraction(shader_code(Stage::ray_batch)).arithmetic > 100);
    for (const ShaderVariant variant : {ShaderVariant::mixed, ShaderVariant::in_double})
        for (const Stage stage : {Stage::megakernel, Stage::trace})
            CHECK(count_no_contraction(shader_variant(stage, variant)).arithmetic > 1000);
    CHECK(count_no_contraction(shader_variant(Stage::megakernel, ShaderVariant::double_sums)).arithmetic > 100);
}

TEST_CASE("given rays in double are answered in double, in mixed precision in float from double geometry") {
    test::SceneBuilder builder;
    builder.sphere(test::diffuse(glm::dvec3(1.0)), {0, 0, 0}, 1.0)
        .quad(test::diffuse(glm::dvec3(1.0)), {-4, -4, -3.1}, {4, -4, -3.1}, {4, 4, -3.1}, {-4, 4, -3.1})
        .cuboid(test::diffuse(glm::dvec3(1.0)), {2, -1, -1}, {3, 1, 1});
    const Scene scene = builder.scene();
    std::vector<GivenRay> rays(4);
    rays[0].origin = {0.1, 0.2, 5.3};  // the sphere
    rays[1].origin = {-2, 1, 5.3};     // the quad
    rays[2].origin = {2.5, 0, 5.3};    // the cuboid
    rays[3].origin = {5, 0, 5.3};      // nothing
    const double sphere = 5.3 - std::sqrt(1.0 - 0.01 - 0.04);
    for (const Precision precision : {Precision::double_precision, Precision::mixed}) {
        BackendOptions options;
        options.precision = precision;
        const auto renderer = vulkan_backend().create(options);
        const RayHits found = renderer->intersector(scene, {})->intersect(rays);
        // Rounding to float takes 2^-24 of coordinates up to 8.4; one of t's own remains.
        const double tolerance = precision == Precision::mixed ? 1e-6 : 4e-15;
        CHECK(std::abs(found.hits[0].t - sphere) < tolerance);
        CHECK(std::abs(found.hits[1].t - 8.4) < tolerance);
        CHECK(std::abs(found.hits[2].t - 4.3) < tolerance);
        CHECK(found.hits[3].primitive == no_index);
        const bool is_float = found.hits[0].t == double{static_cast<float>(found.hits[0].t)};
        CHECK(is_float == (precision == Precision::mixed));
        CHECK(found.hits[1].leaving_front.z > found.hits[1].leaving_back.z);
        RenderSettings ulp;
        ulp.intersection.guard = SelfIntersectionGuard::ulp;
        const RayHits moved = renderer->intersector(scene, ulp)->intersect(rays);
        if (precision == Precision::double_precision)
            CHECK(moved.hits[1].leaving_front.z - moved.hits[1].point.z == 256 * 0x1p-51);  // of -3.1
    }
}

TEST_CASE("given rays find distance, primitive, normal and where the next ray starts") {
    test::SceneBuilder builder;
    builder.sphere(test::diffuse(glm::dvec3(1.0)), {0, 0, 0}, 1.0)
        .quad(test::diffuse(glm::dvec3(1.0)), {-4, -4, -3}, {4, -4, -3}, {4, 4, -3}, {-4, 4, -3})
        .cuboid(test::diffuse(glm::dvec3(1.0)), {2, -1, -1}, {3, 1, 1});
    const auto renderer = vulkan_backend().create({});
    const auto intersector = renderer->intersector(builder.scene(), {});
    std::vector<GivenRay> rays(6);
    rays[0].origin = {0, 0, 5};   // the sphere
    rays[1].origin = {-2, 1, 5};  // the quad's second triangle
    rays[2].origin = {2.5, 0, 5};
    rays[3].origin = {0, 0, 5};
    rays[3].t_max = 3.9;  // short of it
    rays[4].origin = {0, 0, 5};
    rays[4].direction = {0, 0, std::numeric_limits<double>::quiet_NaN()};
    rays[5] = rays[0];
    rays[5].direction = {0, 0, -1e20};
    const RayHits found = intersector->intersect(rays);
    CHECK(found.hits[0].t == doctest::Approx(4.0).epsilon(1e-6));
    CHECK(found.hits[0].primitive == 0);
    CHECK(found.hits[0].normal.z == doctest::Approx(1.0).epsilon(1e-6));
    CHECK(found.hits[0].leaving_front == found.hits[0].point);  // of a sphere, which is passed over itself
    CHECK(found.hits[1].leaving_front.z > found.hits[1].leaving_back.z);
    CHECK(found.hits[1].t == 8.0);
    CHECK(found.hits[1].primitive == 2);
    CHECK(found.hits[2].primitive == 3);
    CHECK(found.hits[2].t == doctest::Approx(4.0).epsilon(1e-6));
    CHECK(found.hits[3].primitive == no_index);
    CHECK(found.hits[4].primitive == no_index);
    CHECK(found.hits[5].t == found.hits[0].t);

    RenderSettings fixed;
    fixed.intersection.guard = SelfIntersectionGuard::fixed_epsilon;
    fixed.intersection.epsilon = 0.25;
    const RayHits moved = renderer->intersector(builder.scene(), fixed)->intersect(rays);
    CHECK(moved.hits[1].leaving_front.z == -2.75);
    CHECK(moved.hits[1].leaving_back.z == -3.25);
    fixed.intersection.triangles = TriangleKernel::embree;
    CHECK_THROWS_AS(static_cast<void>(renderer->intersector(builder.scene(), fixed)), UnsupportedError);
}
