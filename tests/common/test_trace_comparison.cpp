#include <doctest/doctest.h>

#include <cmath>

#include "common/error.h"
#include "common/validation/verify/trace_comparison.h"
#include "tests/common/synthetic_renderer.h"

namespace tandem {
namespace {

PathTrace three_vertices() {
    PathTrace trace;
    for (std::uint32_t k = 0; k < 3; ++k) {
        TracedVertex vertex;
        vertex.origin = {0.0, 2.0, 3.0};
        vertex.position = {1.0 + k, 2.0, 3.0};
        vertex.direction = vertex.next_direction = {0.0, 0.6, 0.8};
        vertex.normal = {0.0, 0.0, -1.0};
        vertex.throughput = glm::dvec3(std::pow(0.5, k));
        vertex.next_throughput = glm::dvec3(std::pow(0.5, k + 1));
        vertex.primitive = k;
        vertex.material = 0;
        vertex.pdf = 0.25;
        trace.vertices.push_back(vertex);
    }
    trace.vertices.back().end = PathEnd::bounces;
    return trace;
}

std::string reason(const PathTrace& a, const PathTrace& b, std::size_t at) {
    const TraceComparison comparison = compare_traces(a, b);
    REQUIRE(comparison.first_divergence.has_value());
    CHECK(*comparison.first_divergence == at);
    return comparison.reason;
}

TEST_CASE("traces: equal ones are the same path, and rounding is counted in ulp of single precision") {
    PathTrace a = three_vertices(), b = a;
    CHECK_FALSE(compare_traces(a, b).first_divergence.has_value());
    b.vertices[1].position.x += 0x1p-22;             // its vector's magnitude is 3: an ulp is 2^-22
    b.vertices[2].throughput.y += 0x1p-25;           // 0.25: 2^-25
    b.vertices[0].next_direction.z = 0.8 + 0x1p-24;  // 0.8: 2^-24
    b.vertices[0].pdf += 0x1p-25;                    // 0.25: 2^-25
    const TraceComparison close = compare_traces(a, b);
    CHECK_FALSE(close.first_divergence.has_value());
    CHECK(close.vertices[1].position_ulp == doctest::Approx(1.0));
    CHECK(close.vertices[2].throughput_ulp == doctest::Approx(1.0));
    CHECK(close.vertices[0].direction_ulp == doctest::Approx(1.0));
    CHECK(close.vertices[0].pdf_ulp == doctest::Approx(1.0));
    CHECK(close.vertices[2].position_ulp == 0.0);
}

TEST_CASE("traces: a position near the origin is as precise as the ray that found it is long") {
    PathTrace a = three_vertices(), b = a;
    for (PathTrace* trace : {&a, &b}) trace->vertices[0].origin = {1024.0, 0.0, 0.0};
    a.vertices[0].position = {0.0, 0.0, 0.0};
    b.vertices[0].position = {0x1p-12, 0.0, 0.0};
    CHECK(compare_traces(a, b).vertices[0].position_ulp == doctest::Approx(2.0));  // of 2^-13
}

TEST_CASE("traces: the first divergence has its place and its reason") {
    const PathTrace a = three_vertices();
    PathTrace b = a;
    b.vertices[1].primitive = 9;
    b.vertices[2].position = {0.0, 0.0, 0.0};
    CHECK(reason(a, b, 1).find("primitive 1 and primitive 9") != std::string::npos);
    b = a;
    b.vertices[2].in_medium = true;
    CHECK(reason(a, b, 2).find("primitive 2 and the medium") != std::string::npos);
    b = a;
    b.vertices[1].next_direction = {1.0, 0.0, 0.0};
    CHECK(reason(a, b, 1).find("directions") != std::string::npos);
    b = a;
    b.vertices[1].next_throughput = glm::dvec3(0.26);
    CHECK(reason(a, b, 1).find("new throughputs") != std::string::npos);
    b = a;
    b.vertices[1].normal = -b.vertices[1].normal;
    CHECK(reason(a, b, 1).find("normals") != std::string::npos);
    b = a;
    b.vertices[0].pdf = 0.3;
    CHECK(reason(a, b, 0).find("densities") != std::string::npos);
    b = a;
    b.vertices[1].end = PathEnd::roulette;
    b.vertices.pop_back();
    CHECK(reason(a, b, 1).find("goes on, the other is ended by roulette") != std::string::npos);
    b = a;
    b.vertices.pop_back();
    CHECK(reason(a, b, 2).find("ends") != std::string::npos);
    b = a;
    b.vertices[0].position.x = NAN;
    CHECK(reason(a, b, 0).find("inf ulp") != std::string::npos);
}

TEST_CASE("traces: radiances count only where both sides estimate alike, densities where both have one") {
    const PathTrace a = three_vertices();
    PathTrace b = a;
    b.vertices[1].radiance = glm::dvec3(0.5);
    b.vertices[0].pdf = 0.0;
    CHECK(reason(a, b, 1).find("radiances") != std::string::npos);
    CHECK_FALSE(compare_traces(a, b, CompareRadiance::no).first_divergence.has_value());
}

TEST_CASE("traces: where radiances differ, the factor of the light is told that does") {
    PathTrace a = three_vertices();
    a.vertices[1].light = glm::dvec3(0.25);
    a.vertices[1].next_event = {.direction = {0.0, 1.0, 0.0},
        .radiance = glm::dvec3(1.0),
        .pdf = 0.5,
        .response = glm::dvec3(0.25),
        .transmittance = glm::dvec3(1.0),
        .weight = 0.5};
    a.vertices[1].found_weight = 0.5;
    const auto told = [&](auto change) {
        PathTrace b = a;
        b.vertices[1].radiance += glm::dvec3(0.5);
        change(b.vertices[1]);
        return reason(a, b, 1);
    };
    CHECK(told([](TracedVertex& v) { v.next_event.pdf = 0.25; }).starts_with("the densities of light sampling"));
    CHECK(told([](TracedVertex& v) { v.next_event.weight = 0.25; }).starts_with("the MIS weights of the sampled"));
    CHECK(told([](TracedVertex& v) { v.next_event.response *= 2.0; }).starts_with("the BSDFs"));
    CHECK(told([](TracedVertex& v) { v.found_weight = 0.75; }).starts_with("the MIS weights of the light met"));
    CHECK(told([](TracedVertex&) {}).find("radiances") != std::string::npos);
    CHECK(told([](TracedVertex& v) {
        v.next_event = {.direction = {1.0, 0.0, 0.0}};
    }).starts_with("the directions to the sampled light"));
    CHECK(told([](TracedVertex& v) {
        v.light = glm::dvec3(0.0);
        v.next_event = {.direction = v.next_event.direction};
    }) == "one shadow ray to the sampled light brings light, the other none");
}

TEST_CASE("traces: events have the names that one would give them") {
    Scene scene;
    scene.materials.resize(3);
    scene.materials[1].kind = MaterialKind::specular;
    scene.materials[2].kind = MaterialKind::boundary;
    TracedVertex vertex = three_vertices().vertices[0];
    CHECK(event_name(scene, vertex) == "scattered");
    vertex.material = 1;
    vertex.next_direction = {0.0, 0.7, 0.7};
    CHECK(event_name(scene, vertex) == "refracted");
    vertex.next_direction = vertex.direction;
    CHECK(event_name(scene, vertex) == "passed through");
    vertex.next_direction = {0.0, 0.6, -0.8};
    CHECK(event_name(scene, vertex) == "reflected");
    vertex.material = 2;
    vertex.next_direction = vertex.direction;
    CHECK(event_name(scene, vertex) == "passed through");
    vertex.in_medium = true;
    CHECK(event_name(scene, vertex) == "scattered in a medium");
    vertex.end = PathEnd::left_scene;
    CHECK(event_name(scene, vertex) == "left the scene");
    CHECK(weight_of(vertex) == glm::dvec3(0.5));
    vertex.throughput = {0.0, 1.0, 1.0};
    CHECK(weight_of(vertex).x == 0.0);
}

TEST_CASE("traces: a renderer without them says so") {
    SyntheticRenderer renderer([](auto, auto, auto&) { return Radiance{}; });
    CHECK_THROWS_AS(static_cast<void>(renderer.prepare(Scene{}, {})->trace(0, 0, {0, 1})), UnsupportedError);
}

}  // namespace
}  // namespace tandem
