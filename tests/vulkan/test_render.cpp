// The Vulkan renderer as a whole: closed forms, reproducible bits, partial results.
#include <doctest/doctest.h>

#include <cmath>

#include "common/error.h"
#include "tests/vulkan/scene_builder.h"

using namespace tandem;
using namespace tandem::testing;

namespace {

// A closed room of one diffuse emitting material, seen from within; its walls are one cuboid seen from inside.
Scene furnace(double albedo, double radiance) {
    SceneBuilder builder;
    builder.camera({0.1, 0.2, 0.3}, {1.0, 0.4, -0.3}, 70.0);
    Material material = diffuse(glm::dvec3(albedo));
    material.radiance = glm::dvec3(radiance);
    builder.cuboid(builder.material(material), {-1.0, -1.0, -1.0}, {1.0, 1.5, 2.0});
    return builder.scene;
}

double furnace_answer(double albedo, double radiance, int bounces) {
    return radiance * (1.0 - std::pow(albedo, bounces + 1)) / (1.0 - albedo);
}

}  // namespace

TEST_CASE("every sample of a furnace is the closed form of its depth") {
    constexpr double albedo = 0.8, radiance = 0.5;
    for (const int bounces : {0, 1, 5, 12}) {
        const RenderResult result =
            render(furnace(albedo, radiance), settings_of(16, static_cast<std::uint32_t>(bounces)), 8);
        const double answer = furnace_answer(albedo, radiance, bounces);
        CAPTURE(bounces);
        CHECK(result.estimate.invalid() == 0);
        // D + 1 sums and products of floats.
        const double bound = answer * (2.0 * bounces + 3.0) * 0x1p-23;
        for (const double mean : mean_of(result.estimate)) REQUIRE(std::abs(mean - answer) <= bound);
    }
}
