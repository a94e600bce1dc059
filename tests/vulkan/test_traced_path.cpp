// The paths that `tandem trace` shows, as the device follows them.
#include <doctest/doctest.h>

#include "tests/traced_paths.h"
#include "tests/vulkan/scenes.h"

using namespace tandem;
using namespace tandem::testing;

TEST_CASE("traced paths bring the very radiance that the device's renders have, in every shipped scene" *
          doctest::test_suite("full")) {
    test::check_traces_of_shipped_scenes(default_renderer(), 4, 0x1p-24, false);
}

TEST_CASE("the device tells where a shadow ray went, whether or not the light is seen") {
    test::check_hidden_light_is_told(default_renderer());
}

TEST_CASE("the device traces many samples of a pixel at once, each as if it were alone") {
    const Scene scene = full_scene();
    const auto job = default_renderer().prepare(scene, settings_of(4, 6, Integrator::next_event));
    const std::vector<PathTrace> many = job->trace(1, 2, {5, 3005});
    REQUIRE(many.size() == 3000);
    for (const std::uint64_t i : {0u, 127u, 128u, 2999u}) {
        const PathTrace alone = job->trace(1, 2, {5 + i, 6 + i}).front();
        REQUIRE(alone.vertices.size() == many[i].vertices.size());
        CHECK(alone.radiance == many[i].radiance);
        CHECK(alone.vertices.back().position == many[i].vertices.back().position);
    }
}

TEST_CASE("the device finds the first vertices of all pixels in several goes, those of the paths that it traces") {
    const Scene scene = full_scene();
    const RenderSettings settings = settings_of(100, 6, Integrator::next_event);
    const auto job = default_renderer().prepare(scene, settings);
    test::check_first_vertices(*default_renderer().prepare(scene, settings_of(6, 6)), settings_of(6, 6));
    const FilmSize film{settings.width, settings.height};
    std::vector<std::vector<TracedVertex>> found(film.pixel_count());
    std::vector<double> told;
    const auto visit = [&](std::uint32_t pixel, std::span<const TracedVertex> vertices) {
        found[pixel].assign(vertices.begin(), vertices.end());
    };
    RenderControl control;
    control.progress = [&](double samples) { told.push_back(samples); };
    REQUIRE(job->first_vertices(film, {0, 16}, control, visit));
    CHECK(told.size() > 1);
    CHECK(told.back() == 16.0);
    for (std::uint32_t pixel = 0; pixel < film.pixel_count(); pixel += 997) {
        const std::vector<PathTrace> paths = job->trace(pixel % film.width, pixel / film.width, {0, 16});
        REQUIRE(found[pixel].size() == 16);
        for (std::size_t i = 0; i < 16; ++i) CHECK(found[pixel][i] == paths[i].vertices.front());
    }
    test::check_stop_of_first_vertices(*job, settings);
}

TEST_CASE("a path that the device ends by roulette is told from one that is absorbed") {
    SceneBuilder builder;
    builder.camera({0.0, 4.0, 0.0}, {0.0, 0.0, 0.01}, 1.0);
    builder.quad(
        builder.material(diffuse(glm::dvec3(1e-9))), {glm::dvec3{-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}});
    RenderSettings settings = settings_of(1, 3);
    const auto end = [&] {
        return default_renderer().prepare(builder.scene(), settings)->trace(0, 0, {0, 1}).front().vertices.back().end;
    };
    CHECK(end() == PathEnd::left_scene);
    settings.roulette_start = 1;
    CHECK(end() == PathEnd::roulette);
    builder.scene().materials[0].colour = glm::dvec3(0.0);
    CHECK(end() == PathEnd::absorbed);
    settings.bounces = 0;
    CHECK(end() == PathEnd::bounces);
}
