// Holds a renderer's traces to its own renders: the path that `tandem trace` shows is the one that render() follows.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <glm/geometric.hpp>
#include <span>
#include <stop_token>
#include <vector>

#include "common/error.h"
#include "common/render/path_trace.h"
#include "common/render/renderer.h"
#include "common/scene/loader/scene_loader.h"
#include "tests/scene_builder.h"

namespace tandem::test {

// Calls visit(scene) for every scene that stands for itself in scenes/.
inline void for_shipped_scenes(const std::function<void(const Scene&)>& visit) {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(TANDEM_SOURCE_DIR "/scenes")) {
        if (entry.path().extension() != ".json") continue;
        visit(load_scene(entry.path()));
        ++count;
    }
    CHECK(count >= 18);
}

// A path is a chain: each ray goes where the vertex before sent it, and all but the last vertex go on.
inline void check_chain(const PathTrace& trace, double roundoff) {
    REQUIRE_FALSE(trace.vertices.empty());
    for (std::size_t k = 0; k < trace.vertices.size(); ++k) {
        const TracedVertex& vertex = trace.vertices[k];
        const bool last = k + 1 == trace.vertices.size();
        REQUIRE((vertex.end == PathEnd::goes_on) != last);
        if (!last) {
            REQUIRE(trace.vertices[k + 1].direction == vertex.next_direction);
            REQUIRE(std::abs(glm::length(vertex.next_direction) - 1.0) < 16.0 * roundoff);
        }
        if (!std::isfinite(vertex.t)) continue;
        // The hit is refined on its surface, by some roundings of numbers as large as the ray.
        const double size = glm::length(vertex.origin) + vertex.t + glm::length(vertex.position);
        REQUIRE(glm::length(vertex.origin + vertex.t * vertex.direction - vertex.position) < 1e3 * roundoff * size);
    }
}

// All pixels at once have the first vertices of the paths that are traced one by one, each pixel once.
inline void check_first_vertices(RenderJob& job, const RenderSettings& settings) {
    const SampleRange samples{samples_per_block, samples_per_block + 3};
    const FilmSize film{settings.width, settings.height};
    std::vector<std::vector<TracedVertex>> found(film.pixel_count());
    REQUIRE(job.first_vertices(film, samples, {}, [&](std::uint32_t pixel, std::span<const TracedVertex> vertices) {
        found[pixel].insert(found[pixel].end(), vertices.begin(), vertices.end());
    }));
    for (std::uint32_t pixel = 0; pixel < film.pixel_count(); ++pixel) {
        std::vector<TracedVertex> expected;
        for (const PathTrace& path : job.trace(pixel % film.width, pixel / film.width, samples))
            expected.push_back(path.vertices.front());
        CAPTURE(pixel);
        REQUIRE(found[pixel] == expected);
    }
}

// A stop ends them, at once or after the first pixel; samples of two blocks are refused.
inline void check_stop_of_first_vertices(RenderJob& job, const RenderSettings& settings) {
    const FilmSize film{settings.width, settings.height};
    std::stop_source source;
    std::atomic<std::uint64_t> visited{0};
    const auto visit = [&](std::uint32_t, std::span<const TracedVertex>) {
        ++visited;
        source.request_stop();
    };
    CHECK_FALSE(job.first_vertices(film, {0, 16}, {source.get_token(), {}}, visit));
    CHECK(visited < film.pixel_count());
    visited = 0;
    CHECK_FALSE(job.first_vertices(film, {0, 16}, {source.get_token(), {}}, visit));
    CHECK(visited == 0);
    CHECK_THROWS_AS((void)job.first_vertices(film, {60, 70}, {}, visit), Error);
    CHECK_THROWS_AS((void)job.first_vertices(film, {60, 60}, {}, visit), Error);
}

// Every pixel's first sample of a film of `side` pixels, and first vertices of later ones.
inline void check_traces(
    Renderer& renderer, const Scene& scene, RenderSettings settings, std::uint32_t side, double roundoff) {
    settings = with_longer_side(settings, side);
    const auto job = renderer.prepare(scene, settings);
    const Estimate estimate = job->render({0, 1}).estimate;
    CAPTURE(scene.name);
    for (std::uint32_t y = 0; y < settings.height; ++y)
        for (std::uint32_t x = 0; x < settings.width; ++x) {
            const PathTrace trace = job->trace(x, y, {0, 1}).front();
            CAPTURE(x);
            CAPTURE(y);
            check_chain(trace, roundoff);
            const auto totals = estimate.totals();
            const std::size_t pixel = (std::size_t{y} * settings.width + x) * channel_count;
            for (std::size_t c = 0; c < channel_count; ++c)
                REQUIRE(totals[pixel + c].sum == trace.radiance[static_cast<int>(c)]);
        }
    check_first_vertices(*job, settings);
}

// The scene's own integrator, then, unless that would take long, light sampling and roulette.
inline void check_traces_of_shipped_scenes(
    Renderer& renderer, std::uint32_t side, double roundoff, bool with_roulette = true) {
    for_shipped_scenes([&](const Scene& scene) {
        RenderSettings settings = default_settings(scene);
        settings.seed = 11;
        const bool whitted = settings.integrator == Integrator::whitted;
        check_traces(renderer, scene, settings, side, roundoff);
        if (!with_roulette) return;
        settings.integrator = Integrator::next_event;
        settings.roulette_start = 2;
        // Next events would not find the bulb behind that scene's glass (MODEL.md section 8.3).
        if (whitted)
            CHECK_THROWS_AS((void)renderer.prepare(scene, settings), UnsupportedError);
        else
            check_traces(renderer, scene, settings, side, roundoff);
    });
}

// A point light 2 above a floor, behind a plate or not: the trace tells where the shadow ray went all the same.
inline void check_hidden_light_is_told(Renderer& renderer) {
    for (const bool hidden : {false, true}) {
        SceneBuilder builder;
        builder.camera({0.0, 0.5, 0.0}, {0.0, 0.0, 0.001}, 1.0).floor(diffuse(white), 0.0, 9.0);
        if (hidden) builder.floor(diffuse(white), 1.0, 9.0);
        Scene scene = builder.scene();
        PunctualLight light;
        light.position = {0.0, 2.0, 0.0};
        light.intensity = white;
        scene.lights.push_back(light);
        const PathTrace trace =
            renderer.prepare(scene, settings_of(1, 1, Integrator::next_event))->trace(0, 0, {0, 1}).front();
        const TracedVertex& vertex = trace.vertices.front();
        CHECK((vertex.light == glm::dvec3(0.0)) == hidden);
        CHECK((vertex.next_event.pdf == 0.0) == hidden);
        CHECK(vertex.next_event.direction.y > 0.999);
    }
}

}  // namespace tandem::test
