// The paths that `tandem trace` shows, of the Embree path tracer and of the oracle.
#include <doctest/doctest.h>

#include "cpu_ref/backend.h"
#include "tests/cpu_ref/renders.h"
#include "tests/traced_paths.h"

using namespace tandem;
using namespace tandem::test;
using namespace tandem::test::renders;

namespace {

std::unique_ptr<Renderer> cpu(Precision precision) {
    BackendOptions options;
    options.precision = precision;
    return cpu_backend().create(options);
}

PathTrace traced(const Scene& scene, const RenderSettings& s) {
    return cpu(Precision::double_precision)->prepare(scene, s)->trace(0, 0, {0, 1}).front();
}

PathEnd last_end(const PathTrace& trace) { return trace.vertices.back().end; }

}  // namespace

TEST_CASE("traced paths bring the very radiance that renders have, in every shipped scene") {
    check_traces_of_shipped_scenes(*cpu(Precision::single_precision), 8, 0x1p-24);
    check_traces_of_shipped_scenes(*cpu(Precision::double_precision), 4, 0x1p-53);
}

TEST_CASE("a trace tells where a shadow ray went, whether or not the light is seen") {
    check_hidden_light_is_told(*cpu(Precision::single_precision));
}

TEST_CASE("first vertices of all pixels end at a stop, by threads or one pixel after the other") {
    const Scene scene = floor_below(diffuse(dvec3(0.5))).scene();
    const RenderSettings s = settings(64, Integrator::next_event, 1);
    for (const auto& renderer :
        {cpu(Precision::single_precision), cpu(Precision::mixed), oracle_backend().create({})}) {
        const auto job = renderer->prepare(scene, s);
        check_first_vertices(*job, s);
        check_stop_of_first_vertices(*job, s);
    }
}

TEST_CASE("the oracle's traced paths bring the very radiance that its renders have") {
    check_traces_of_shipped_scenes(*oracle_backend().create({}), 3, 0x1p-53);
}

TEST_CASE("a traced path tells why it ends") {
    for (const bool by_oracle : {false, true}) {
        const auto renderer = by_oracle ? oracle_backend().create({}) : cpu(Precision::double_precision);
        const auto trace = [&](const Scene& scene, const RenderSettings& s) {
            return renderer->prepare(scene, s)->trace(0, 0, {0, 1}).front();
        };
        RenderSettings s = settings(1, Integrator::path, 3);
        SceneBuilder sky = floor_below(diffuse(dvec3(0.5)));
        sky.background(dvec3(1.0), dvec3(1.0));
        const PathTrace escaped = trace(sky.scene(), s);
        REQUIRE(escaped.vertices.size() == 2);
        CHECK(last_end(escaped) == PathEnd::left_scene);
        CHECK(escaped.vertices[0].t == doctest::Approx(4.0).epsilon(1e-6));
        CHECK(escaped.vertices[0].normal.y == doctest::Approx(1.0));
        CHECK(escaped.vertices[0].pdf ==
              doctest::Approx(escaped.vertices[0].next_direction.y / std::numbers::pi).epsilon(1e-12));
        CHECK(weight_of(escaped.vertices[0]) == dvec3(0.5));
        CHECK(escaped.radiance == dvec3(0.5));

        s.bounces = 0;
        CHECK(last_end(trace(sky.scene(), s)) == PathEnd::bounces);
        s.bounces = 3;
        CHECK(last_end(trace(floor_below(emitter(dvec3(1.0))).scene(), s)) == PathEnd::emitter);
        CHECK(last_end(trace(floor_below(diffuse(dvec3(0.0))).scene(), s)) == PathEnd::absorbed);
        s.roulette_start = 1;
        CHECK(last_end(trace(floor_below(diffuse(dvec3(1e-9))).scene(), s)) == PathEnd::roulette);
    }
}

TEST_CASE("whitted paths are traced to their first diffuse vertex, bidirectional ones are refused with a reason") {
    SceneBuilder b = floor_below(diffuse(dvec3(0.5)));
    b.background(dvec3(1.0), dvec3(1.0));
    CHECK(last_end(traced(b.scene(), settings(1, Integrator::whitted, 3))) == PathEnd::direct_light);
    CHECK_THROWS_AS(static_cast<void>(traced(b.scene(), settings(1, Integrator::bidirectional, 3))), UnsupportedError);
}

TEST_CASE("a path in fog is traced through the medium, where it has no surface") {
    SceneBuilder b = floor_below(diffuse(dvec3(0.5)));
    Scene scene = b.scene();
    scene.media.push_back(medium(dvec3(0.0), dvec3(10.0), 0.5));
    scene.medium = 0;
    const PathTrace trace = traced(scene, settings(1, Integrator::path, 3));
    REQUIRE(trace.vertices.size() >= 2);
    const TracedVertex& first = trace.vertices[0];
    CHECK(first.in_medium);
    CHECK(first.primitive == no_index);
    CHECK(first.t < 4.0);
    CHECK(first.position.y == doctest::Approx(4.0 - first.t).epsilon(1e-4));
    CHECK(event_name(scene, first) == "scattered in a medium");
    CHECK(first.pdf > 0.0);
}
