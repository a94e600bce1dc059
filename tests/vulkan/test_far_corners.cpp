// Where corners are far beyond the view, points are made from the ray (shaders/geometry/surface.glsl).
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>

#include "common/render/path_trace.h"
#include "tests/scene_builder.h"
#include "vulkan/backend.h"

using namespace tandem;
using namespace tandem::test;
using glm::dvec3;

namespace {

constexpr double u = 0x1p-24;
constexpr std::uint32_t side = 12;

// Visits what the rays of the camera meet first.
void for_first_hits(const Scene& scene, const std::function<void(const TracedVertex&)>& visit) {
    RenderSettings settings = default_settings(scene);
    settings.width = settings.height = side;
    const auto renderer = vulkan_backend().create({});
    const auto job = renderer->prepare(scene, settings);
    std::size_t count = 0;
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x) {
            const TracedVertex vertex = job->trace(x, y, {0, 1}).front().vertices.front();
            if (!std::isfinite(vertex.t)) continue;
            visit(vertex);
            ++count;
        }
    CHECK(count > side);
}

double largest(const dvec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

SceneBuilder camera_above() {
    return SceneBuilder().camera({0.0, 1.9, 7.5}, {0.0, 0.0, 0.0}, 36.0).background({1.0, 1.0, 1.0});
}

}  // namespace

TEST_CASE("points on a floor 4000 wide are as exact as the rays that meet it, and not as its corners") {
    const Scene scene = camera_above().floor(diffuse({0.5, 0.5, 0.5}), 0.0, 2000.0).scene();
    for_first_hits(scene, [](const TracedVertex& vertex) {
        const double t = -vertex.origin.y / vertex.direction.y;
        const dvec3 exact = vertex.origin + t * vertex.direction;
        // A mean of the corners is off by up to u 2000 = 1.2e-4.
        CHECK(glm::length(vertex.position - exact) < 16.0 * u * (largest(vertex.origin) + t));
    });
}

TEST_CASE("off a slanted plane with far corners they are no further than the bound of its corners") {
    const Scene scene = camera_above()
                            .quad(diffuse({0.5, 0.5, 0.5}), {-1500.0, -700.0, 2000.0}, {1500.0, 700.0, 2000.0},
                                {1500.0, 700.0, -2000.0}, {-1500.0, -700.0, -2000.0})
                            .scene();
    const dvec3 normal = glm::normalize(dvec3(-7.0, 15.0, 0.0));
    for_first_hits(scene, [&](const TracedVertex& vertex) {
        CHECK(std::abs(glm::dot(normal, vertex.position)) <
              12.0 * u * glm::dot(glm::abs(normal), dvec3(3000, 1400, 4000)));
    });
}
