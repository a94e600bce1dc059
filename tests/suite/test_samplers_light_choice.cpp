// How next events choose the light: `uniform` and `tree` of MODEL.md section 9.2, rules 30 to 39.
#include <array>
#include <random>

#include "tests/suite/samplers.h"

using namespace tandem;
using namespace tandem::test;
using namespace tandem::test::samplers;

namespace {

constexpr LightSampling samplings[] = {LightSampling::uniform, LightSampling::tree};

PunctualLight punctual(PunctualKind kind, const dvec3& position, const dvec3& intensity, const dvec3& towards) {
    PunctualLight light;
    light.kind = kind;
    light.position = position;
    light.intensity = intensity;
    light.direction = glm::normalize(towards - position);
    light.inner_degrees = 20.0;
    light.outer_degrees = 80.0;
    return light;
}

dvec3 random_direction(std::mt19937& random) {
    std::uniform_real_distribution<double> between(-1.0, 1.0);
    dvec3 d(2.0);
    while (glm::dot(d, d) > 1.0) d = {between(random), between(random), between(random)};
    return glm::normalize(d);
}

// A small receiver at the origin with a random normal, and points and spots above its horizon, by their number i.
Scene random_receiver(std::uint32_t seed, std::size_t count) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> between(0.0, 1.0);
    const dvec3 n = random_direction(random), side = glm::normalize(glm::cross(n, random_direction(random)));
    SceneBuilder builder = looking_from(0.5 * glm::normalize(n + 0.4 * side));
    const dvec3 other = glm::cross(n, side);
    builder.triangle(diffuse(white), {-0.01 * side - 0.02 * other, 0.02 * side, -0.01 * side + 0.02 * other});
    Scene scene = builder.scene();
    while (scene.lights.size() < count) {
        const dvec3 d = random_direction(random);
        if (glm::dot(d, n) < 0.05) continue;
        const dvec3 place = (1.0 + 9.0 * between(random)) * d;
        const PunctualKind kind = scene.lights.size() % 3 == 0 ? PunctualKind::spot : PunctualKind::point;
        scene.lights.push_back(punctual(kind, place, dvec3(std::exp(4.0 * between(random))), 0.3 * side));
    }
    return scene;
}

// The light that lies in a direction from the origin, or count.
std::size_t light_in(const Scene& scene, const dvec3& direction) {
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < scene.lights.size(); ++i)
        if (glm::dot(direction, glm::normalize(scene.lights[i].position)) >
            glm::dot(direction, glm::normalize(scene.lights[nearest].position)))
            nearest = i;
    return nearest;
}

// The light's radiant intensity towards the origin, over the square of the distance.
double irradiance_of(const PunctualLight& light) {
    double falloff = 1.0;
    if (light.kind == PunctualKind::spot) {
        const double outer = std::cos(glm::radians(light.outer_degrees));
        const double inner = std::cos(glm::radians(light.inner_degrees));
        const double cosine = glm::dot(light.direction, -glm::normalize(light.position));
        const double t = std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0);
        falloff = t * t * (3.0 - 2.0 * t);
    }
    return light.intensity.x * falloff / glm::dot(light.position, light.position);
}

// What is chosen how often, and with which P_i by the light that it brings.
void check_choice(Tracer& tracer, const Scene& scene, const RenderSettings& settings) {
    std::vector<double> counts(scene.lights.size(), 0.0), chances(scene.lights.size(), 0.0), expected;
    double least_same = 1.0, greatest_same = 1.0;  // P_i of a light from sample to sample
    const std::vector<PathTrace> traces = traces_of(tracer, scene, settings);
    for (const PathTrace& trace : traces) {
        const TracedVertex& vertex = trace.vertices.front();
        REQUIRE(vertex.next_event.direction != dvec3(0.0));  // every light is above the horizon
        const std::size_t light = light_in(scene, vertex.next_event.direction);
        const double facing = glm::dot(vertex.normal, vertex.direction) < 0.0 ? 1.0 : -1.0;
        const double cosine = facing * glm::dot(vertex.normal, vertex.next_event.direction);
        const double chance = cosine / pi * irradiance_of(scene.lights[light]) / vertex.light.x;
        counts[light] += 1.0;
        if (chances[light] == 0.0) chances[light] = chance;
        least_same = std::min(least_same, chance / chances[light]);
        greatest_same = std::max(greatest_same, chance / chances[light]);
    }
    CHECK(least_same > 0.995);  // the receiver's place varies a little
    CHECK(greatest_same < 1.005);
    CHECK(sum_of(chances) > 0.99);  // but for lights that were never chosen
    CHECK(sum_of(chances) < 1.003);
    for (const double chance : chances) expected.push_back(chance * static_cast<double>(traces.size()));
    CHECK(goodness_of_fit(counts, expected).p > least_p);
}

// Lights of every kind, of unlike power, place and orientation, on both sides of a wall, in thin fog.
Scene mixed_lights(bool fog) {
    SceneBuilder builder;
    builder.camera({0.5, 1.6, 6.0}, {0.0, 0.9, 0.0}, 45.0)
        .background({0.1, 0.1, 0.1}, {0.2, 0.3, 0.5})
        .floor(diffuse({0.6, 0.5, 0.4}), 0.0, 4.0)
        .quad(diffuse({0.5, 0.6, 0.7}), {-4, 0, -2}, {4, 0, -2}, {4, 4, -2}, {-4, 4, -2})
        .sphere(diffuse({0.7, 0.7, 0.7}), {-0.7, 0.6, 0.3}, 0.55)
        .cuboid(diffuse({0.7, 0.6, 0.5}), {0.6, 0.01, -0.6}, {1.3, 0.9, 0.1}, rotated(20.0, {0, 1, 0}))
        .triangle(emitter({9, 7, 5}, EmittingSides::front), {1.6, 2.3, 0.2}, {1.2, 2.5, 0.9}, {2.0, 2.2, 0.8})
        .triangle(emitter({2, 5, 9}), {-2.1, 1.2, -1.4}, {-1.7, 1.3, -1.1}, {-1.8, 2.0, -1.3})
        .sphere(emitter({30, 20, 10}), {1.6, 0.4, 1.2}, 0.1)
        .sphere(emitter({4, 9, 6}), black, 1.0,
            moved({-1.9, 0.5, 1.3}) * rotated(30.0, {1, 0, 1}) * scaled({0.1, 0.3, 0.2}))
        .cuboid(emitter({3, 2, 8}), {-0.2, 0.02, 1.7}, {0.2, 0.1, 1.9}, rotated(15.0, {0, 1, 0}))
        .sphere(emitter({9, 9, 2}), {0.1, 2.6, -1.5}, 0.12);
    Scene scene = builder.scene();
    scene.entities.back().motion = {0.6, -0.3, 0.0};
    scene.background.sampled = true;
    scene.lights = {punctual(PunctualKind::point, {-0.4, 2.2, 1.1}, dvec3(1.5), black),
        punctual(PunctualKind::spot, {2.4, 2.4, -1.2}, dvec3(4.0), {0.0, 0.0, 0.0})};
    if (fog) {
        scene.media.push_back({"fog", dvec3(0.01), dvec3(0.12), 0.3, nullptr});
        scene.medium = 0;
    }
    return scene;
}

// By what part rounding may change the light that a triangle sends to a receiver at p in the direction d. It is in
// proportion to c, the cosine at the triangle, which is next to 0 where that is seen edge on. With u the unit roundoff
// and M the greatest distance from the origin:
// - Corners are off by u M, so that the plane of a triangle of least height h tilts by 2 u M/h.
// - The cross product of the edges and its length round thrice: at most 6 u M/h, as no edge is longer than 2 M.
// - p and the sampled point leave their planes by four roundings each. The direction turns by 8 u M/r.
// 0: the direction meets no triangle that emits.
double edge_on_rounding(const Scene& scene, const dvec3& p, const dvec3& d, double unit_roundoff) {
    double greatest = 0.0;
    for (const Entity& entity : scene.entities) {
        if (scene.materials[entity.material].radiance == dvec3(0.0)) continue;
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i) {
            const Primitive& primitive = scene.primitives[entity.first_primitive + i];
            if (primitive.kind != PrimitiveKind::triangle) continue;
            std::array<dvec3, 3> corners;
            double size = glm::length(p), longest = 0.0;
            for (std::size_t k = 0; k < 3; ++k) {
                corners[k] = dvec3(entity.object_to_world * glm::dvec4(scene.vertices[primitive.index[k]], 1.0));
                size = std::max(size, glm::length(corners[k]));
            }
            const dvec3 cross = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
            const double cosine = glm::dot(glm::normalize(cross), d);
            const double r = glm::dot(glm::normalize(cross), corners[0] - p) / cosine;
            bool inside = r > 0.0;
            for (std::size_t k = 0; k < 3; ++k) {
                const dvec3 edge = corners[(k + 1) % 3] - corners[k];
                longest = std::max(longest, glm::length(edge));
                inside = inside && glm::dot(cross, glm::cross(edge, p + r * d - corners[k])) > 0.0;
            }
            const double height = glm::length(cross) / longest;
            if (inside)
                greatest = std::max(greatest, 8.0 * unit_roundoff * size * (1.0 / height + 1.0 / r) / std::abs(cosine));
        }
    }
    return greatest;
}

// How far a tracer's first next events are from the oracle's, path by path.
void check_same_choice(const Scene& scene, const Tracer& tracer, const std::vector<PathTrace>& traces,
    const std::vector<PathTrace>& answers) {
    REQUIRE(traces.size() == answers.size());
    std::size_t same = 0, compared = 0, in_medium = 0;
    double worst = 0.0;  // part of what rounding explains
    for (std::size_t i = 0; i < traces.size(); ++i) {
        if (traces[i].vertices.empty() || answers[i].vertices.empty()) continue;
        const TracedVertex &a = traces[i].vertices.front(), &b = answers[i].vertices.front();
        if (a.light == dvec3(0.0) && b.light == dvec3(0.0)) continue;
        ++compared;
        if (!(glm::dot(a.next_event.direction, b.next_event.direction) > 0.9999)) continue;
        ++same;
        if (b.in_medium) ++in_medium;
        const double allowed =
            tolerance(tracer) + edge_on_rounding(scene, b.position, b.next_event.direction, tracer.unit_roundoff);
        worst = std::max(worst, std::abs(a.light.x - b.light.x) / (allowed * b.light.x));
    }
    CAPTURE(in_medium);
    CHECK(compared > traces.size() / 4);
    CHECK(same > compared - compared / 100 - 2);
    CHECK(worst < 1.0);
}

}  // namespace

TEST_CASE("samplers: choice of the light: each light as often as the P_i by which it is divided, and these sum to 1") {
    for (const LightSampling sampling : samplings)
        for (const std::uint32_t seed : {1u, 3u}) {
            const Scene scene = random_receiver(seed, 3 + 4 * seed);
            RenderSettings settings = settings_of(1, 1, Integrator::whitted);
            settings.light_sampling = sampling;
            for (Tracer& tracer : tracers()) {
                CAPTURE(tracer.name);
                CAPTURE(light_sampling_names[static_cast<std::size_t>(sampling)]);
                CAPTURE(seed);
                check_choice(tracer, scene, settings);
            }
        }
}

TEST_CASE("samplers: choice of the light: lights of every kind are chosen by the oracle and by the tracers alike" *
          doctest::test_suite("full")) {
    for (const bool fog : {false, true}) {
        const Scene scene = mixed_lights(fog);
        for (const LightSampling sampling : samplings) {
            CAPTURE(fog);
            CAPTURE(light_sampling_names[static_cast<std::size_t>(sampling)]);
            RenderSettings settings = settings_of(8, 1, Integrator::whitted);
            settings.light_sampling = sampling;
            const auto traced = [&](Renderer& renderer) {
                std::vector<PathTrace> all;
                const auto job = renderer.prepare(scene, settings);
                for (std::uint32_t y = 0; y < settings.height; ++y)
                    for (std::uint32_t x = 0; x < settings.width; ++x)
                        for (PathTrace& trace : job->trace(x, y, {0, 16})) all.push_back(std::move(trace));
                return all;
            };
            const std::vector<PathTrace> answers = traced(*oracle_backend().create({}));
            for (Tracer& tracer : tracers()) {
                if (tracer.name == "oracle") continue;
                CAPTURE(tracer.name);
                check_same_choice(scene, tracer, traced(*tracer.renderer), answers);
            }
        }
    }
}

TEST_CASE("samplers: choice of the light: the mean is the same, with MIS and without, and that of the oracle" *
          doctest::test_suite("full")) {
    const Scene scene = mixed_lights(true);
    const RenderSettings plain = settings_of(12, 2, Integrator::next_event);
    Tracer oracle{"oracle", oracle_backend().create({}), 0x1p-53, false};
    const Measured expected = pooled(render(oracle, scene, plain, 4096));
    for (const LightSampling sampling : samplings)
        for (const bool mis : {true, false})
            for (Tracer& tracer : tracers()) {
                if (tracer.name == "oracle") continue;
                CAPTURE(tracer.name);
                CAPTURE(light_sampling_names[static_cast<std::size_t>(sampling)]);
                CAPTURE(mis);
                RenderSettings settings = plain;
                settings.light_sampling = sampling;
                settings.mis = mis;
                settings.seed = 7;
                const Measured measured = pooled(render(tracer, scene, settings, 2048));
                for (int c = 0; c < 3; ++c) {
                    const double error = std::hypot(measured.standard_error[c], expected.standard_error[c]);
                    CAPTURE(measured.mean[c]);
                    CAPTURE(expected.mean[c]);
                    CHECK(std::abs(measured.mean[c] - expected.mean[c]) < sigmas * error);
                    CHECK(error < 0.02 * expected.mean[c]);
                }
            }
}

TEST_CASE("samplers: choice of the light: closed forms hold with every choice") {
    // Lambert's formula of two triangles that face away from each other, one of which the floor alone sees.
    const dvec3 colour(0.6, 0.3, 0.9);
    const auto at_origin = [&](const dvec3& a, const dvec3& b, const dvec3& c) {
        const dvec3 corners[] = {glm::normalize(a), glm::normalize(b), glm::normalize(c)};
        double sum = 0.0;
        for (int i = 0; i < 3; ++i) {
            const dvec3 &p = corners[i], &q = corners[(i + 1) % 3];
            sum += std::acos(glm::dot(p, q)) * glm::normalize(glm::cross(p, q)).y;
        }
        return 0.5 * std::abs(sum);
    };
    SceneBuilder builder = looking_from({0.3, 0.5, -0.2});
    builder.triangle(diffuse(colour), {-0.01, 0.0, 0.02}, {0.02, 0.0, 0.0}, {-0.01, 0.0, -0.02});
    double expected = 0.0;
    for (int i = 0; i < 9; ++i) {
        const dvec3 middle(1.5 * (i % 3) - 1.3, 1.2 + 0.3 * i, 1.5 * (i / 3) - 1.4);
        const double size = 0.1 + 0.05 * i, radiance = 1.0 + (i * 7) % 5;
        const dvec3 a = middle + size * dvec3(1, 0, 0), b = middle + size * dvec3(0, 0.1, 1),
                    c = middle + size * dvec3(-1, 0.2, -1);
        // Every third is turned away and dark, unless it emits to both sides.
        const bool away = i % 3 == 2;
        const EmittingSides sides = i % 2 == 0 ? EmittingSides::front : EmittingSides::both;
        const bool faces_down = glm::cross(b - a, c - a).y < 0.0;
        const bool swaps = faces_down == away;
        builder.triangle(emitter(dvec3(radiance), sides), a, swaps ? c : b, swaps ? b : c);
        if (!away || sides == EmittingSides::both) expected += radiance * at_origin(a, b, c);
    }
    for (const LightSampling sampling : samplings)
        for (const Integrator integrator : {Integrator::next_event, Integrator::whitted}) {
            CAPTURE(light_sampling_names[static_cast<std::size_t>(sampling)]);
            CAPTURE(static_cast<int>(integrator));
            RenderSettings settings = settings_of(4, 1, integrator);
            settings.light_sampling = sampling;
            // The floor's points differ by the camera's narrow field alone.
            check_mean(tracers(), builder.scene(), settings, 4096, expected / pi * colour, 5e4);
        }
}

TEST_CASE("samplers: choice of the light: what samples no light, or from both ends, refuses another choice") {
    const Scene scene = random_receiver(1, 3);
    for (const Integrator integrator : {Integrator::path, Integrator::bidirectional}) {
        RenderSettings settings = settings_of(4, 1, integrator);
        settings.light_sampling = LightSampling::tree;
        for (Tracer& tracer : tracers())
            CHECK_THROWS_AS((void)tracer.renderer->prepare(scene, settings), UnsupportedError);
    }
}
