// Free paths through media, and where camera rays begin and go, as every tracer draws them.
#include "tests/suite/effects.h"
#include "tests/suite/samplers.h"

using namespace tandem;
using namespace tandem::test;
using namespace tandem::test::samplers;

namespace {

constexpr int bins = 40;

// A ray along +x through a medium to a wall at x = `wall`.
Scene through(const Medium& medium, double wall) {
    SceneBuilder b;
    b.camera({0.0, 0.5, 0.5}, {1.0, 0.5, 0.5}, narrow_field);
    b.quad(diffuse(dvec3(0.5)), {wall, -9, -9}, {wall, -9, 9}, {wall, 9, 9}, {wall, 9, -9});
    Scene scene = b.scene();
    scene.media.push_back(medium);
    scene.medium = 0;
    return scene;
}

// Distances and weights of free flight against section 10, `depth` being N(t) along the ray.
void check_flight(const Medium& medium, double wall, const std::function<double(double)>& depth) {
    const dvec3 extinction = medium.absorption + medium.scattering;
    const auto transmittance = [&](double t) { return glm::exp(-extinction * depth(t)); };
    const auto mean = [](const dvec3& v) { return (v.x + v.y + v.z) / 3.0; };
    std::vector<double> expected(bins + 1, 0.0);
    for (std::size_t i = 0; i < bins; ++i)  // a channel is chosen, then it is exponential in depth
        expected[i] = static_cast<double>(samples) * (mean(transmittance(wall * static_cast<double>(i) / bins)) -
                                                         mean(transmittance(wall * static_cast<double>(i + 1) / bins)));
    expected[bins] = static_cast<double>(samples) * mean(transmittance(wall));
    for (Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        std::vector<double> counts(bins + 1, 0.0);
        double worst = 0.0;
        for (const PathTrace& trace : traces_of(tracer, through(medium, wall), settings_of(1, 1))) {
            const TracedVertex& vertex = trace.vertices.front();
            const double t = vertex.in_medium ? vertex.t : wall;
            counts[vertex.in_medium ? static_cast<std::size_t>(std::min(bins - 1.0, bins * t / wall)) : bins] += 1.0;
            const dvec3 left = transmittance(t);
            const dvec3 answer =
                vertex.in_medium ? medium.scattering * left / mean(extinction * left) : left / mean(left);
            for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(vertex.throughput[c] - answer[c]));
        }
        const GoodnessOfFit fit = goodness_of_fit(counts, expected);
        CHECK(fit.cells > 10);
        CHECK(fit.where_none == 0.0);
        CHECK(fit.p > least_p);
        CAPTURE(worst);
        CHECK(worst < tolerance(tracer));
    }
}

}  // namespace

TEST_CASE("samplers: free paths in an even medium are exponential, by channels that are chosen evenly") {
    Medium medium;
    medium.absorption = {0.1, 0.2, 0.05};
    medium.scattering = {0.4, 0.3, 2.0};
    check_flight(medium, 3.0, [](double t) { return t; });
    medium.scattering = {0.0, 0.3, 2.0};
    medium.absorption = dvec3(0.0);  // nothing meets the red light
    check_flight(medium, 3.0, [](double t) { return t; });
}

TEST_CASE("samplers: free paths in a grid are exponential in its depth, and empty cells stay empty") {
    auto grid = std::make_shared<DensityGrid>();
    grid->cells = {6, 1, 1};
    grid->low = {0.5, 0.0, 0.0};
    grid->high = {3.5, 1.0, 1.0};
    grid->density = {1.0f, 0.0f, 3.0f, 0.5f, 0.0f, 2.0f};  // half a unit each
    Medium medium;
    medium.absorption = {0.1, 0.2, 0.05};
    medium.scattering = {0.4, 0.3, 1.5};
    medium.grid = grid;
    check_flight(medium, 4.0, [&](double t) {
        double depth = 0.0;
        for (std::size_t i = 0; i < 6; ++i) {
            const double from = 0.5 + 0.5 * static_cast<double>(i);
            depth += double{grid->density[i]} * std::clamp(t - from, 0.0, 0.5);
        }
        return depth;
    });
}

TEST_CASE("samplers: rays begin evenly on the lens, and all of them go through the focused point") {
    SceneBuilder b;
    constexpr double radius = 0.25, focus = 4.0;
    const dvec3 position(1.0, 2.0, 3.0), forward = glm::normalize(dvec3(0.2, -0.1, -1.0));
    b.camera(position, position + forward, 1e-3).lens(radius, focus).background(white);
    const dvec3 right = glm::normalize(glm::cross(forward, dvec3(0, 1, 0))), up = glm::cross(right, forward);
    constexpr int circles = 10, parts = 16;  // of equal area
    for (Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        std::vector<double> counts(circles * parts, 0.0),
            expected(circles * parts, static_cast<double>(samples) / (circles * parts));
        for (const PathTrace& trace : traces_of(tracer, b.scene(), settings_of(1, 1))) {
            const TracedVertex& vertex = trace.vertices.front();
            const dvec3 offset = (vertex.origin - position) / radius;
            const double x = glm::dot(offset, right), y = glm::dot(offset, up), a = x * x + y * y;
            REQUIRE(a <= 1.0 + tolerance(tracer));
            CHECK(std::abs(glm::dot(offset, forward)) < tolerance(tracer));
            const double turn = std::atan2(y, x) / (2.0 * pi);
            const int circle = std::min(circles - 1, static_cast<int>(a * circles));
            const int part = std::clamp(static_cast<int>(parts * (turn - std::floor(turn))), 0, parts - 1);
            counts[static_cast<std::size_t>(circle * parts + part)] += 1.0;
            const double t = focus / glm::dot(vertex.direction, forward);
            // The film is 7e-5 across at that distance.
            CHECK(glm::distance(vertex.origin + t * vertex.direction, position + focus * forward) < 1e-4);
        }
        const GoodnessOfFit fit = goodness_of_fit(counts, expected);
        CHECK(fit.p > least_p);
    }
}

TEST_CASE("samplers: rays are even over the square of their pixel") {
    SceneBuilder b;
    b.camera({0, 0, 0}, {0, 0, -1}, 40.0).background(white);
    constexpr int side = 12;
    for (Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        std::vector<double> counts(side * side, 0.0),
            expected(side * side, static_cast<double>(samples) / (side * side));
        RenderSettings settings = settings_of(2, 1);  // its upper left pixel
        for (const PathTrace& trace : traces_of(tracer, b.scene(), settings)) {
            const dvec3 d = trace.vertices.front().direction;
            const double h = std::tan(glm::radians(20.0));
            const double x = d.x / -d.z / h + 1.0, y = 1.0 - d.y / -d.z / h;  // both in [0, 1)
            REQUIRE((x > -1e-5 && x < 1.0 + 1e-5 && y > -1e-5 && y < 1.0 + 1e-5));
            const auto cell = [](double place) { return std::clamp(static_cast<int>(place * side), 0, side - 1); };
            counts[static_cast<std::size_t>(cell(y) * side + cell(x))] += 1.0;
        }
        const GoodnessOfFit fit = goodness_of_fit(counts, expected);
        CHECK(fit.p > least_p);
    }
}
