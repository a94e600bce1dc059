// Bodies in contact (MODEL.md section 5.2) on every renderer: closed forms, wherever rounding puts the bodies, and the
// image of bodies a hair apart.
#include <doctest/doctest.h>

#include "cpu_ref/backend.h"
#include "tests/scene_builder.h"
#include "vulkan/backend.h"

using namespace tandem;
using namespace tandem::test;

namespace {

struct Tracer {
    std::string name;
    std::unique_ptr<Renderer> renderer;
};

const std::vector<Tracer>& tracers() {
    static const std::vector<Tracer> all = [] {
        std::vector<Tracer> list;
        list.push_back({"cpu", cpu_backend().create({})});
        BackendOptions in_double;
        in_double.precision = Precision::double_precision;
        list.push_back({"cpu double", cpu_backend().create(in_double)});
        list.push_back({"vulkan", vulkan_backend().create({})});
        list.push_back({"oracle", oracle_backend().create({})});
        return list;
    }();
    return all;
}

struct Mean {
    double value, error;
};
Mean mean_of_image(Renderer& renderer, const Scene& scene, RenderSettings settings, std::uint64_t samples) {
    const Estimate estimate = renderer.prepare(scene, settings)->render({0, samples}).estimate;
    const std::vector<double> mean = tandem::mean_of(estimate), variance = tandem::variance_of(estimate);
    Mean result{0.0, 0.0};
    const auto pixels = static_cast<double>(estimate.pixel_count());
    for (std::size_t i = 0; i < mean.size(); i += channel_count) {
        result.value += mean[i] / pixels;
        result.error += variance[i] / static_cast<double>(samples) / (pixels * pixels);
    }
    result.error = std::sqrt(result.error);
    return result;
}

// Straight down through slabs of these indices, the lowest on a lamp. All that is reflected upwards is lost.
Scene slabs_on_lamp(const std::vector<double>& indices, bool as_meshes, const dmat4& placed) {
    const auto at = [&](const dvec3& p) { return dvec3(placed * glm::dvec4(p, 1.0)); };
    SceneBuilder builder;
    builder.camera(at({0.1, 30.0, 0.2}), at({0.1, 0.0, 0.2}), 0.01, dvec3(placed * glm::dvec4(0.0, 0.0, 1.0, 0.0)));
    builder.quad(emitter(white), {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4}, placed);
    for (std::size_t i = 0; i < indices.size(); ++i) {
        const dvec3 low(-1.0, static_cast<double>(i), -1.0), high(1.0, static_cast<double>(i) + 1.0, 1.0);
        if (as_meshes)
            builder.triangle_box(glass(indices[i]), low, high, placed);
        else
            builder.cuboid(glass(indices[i]), low, high, placed);
    }
    return builder.scene();
}

// With gaps between them, each slab has two interfaces: 1/T - 1 adds up.
double through_gaps(const std::vector<double>& indices) {
    double lost = 0.0;
    for (const double n : indices) {
        const double r = (n - 1.0) * (n - 1.0) / ((n + 1.0) * (n + 1.0));
        lost += 2.0 * r / (1.0 - r);
    }
    return 1.0 / (1.0 + lost);
}

std::vector<dmat4> places() {
    std::vector<dmat4> all{dmat4(1.0)};
    for (int i = 1; i < 5; ++i)
        all.push_back(
            moved({0.31 * i, -0.17 * i, 0.7 * i}) * rotated(33.0 * i, {1.0, 0.3 * i, -0.5}) * scaled(dvec3(0.3 * i)));
    all.push_back(moved({1000.1, 2000.3, -3000.7}) * rotated(77.0, {1.0, 1.0, 0.1}));
    return all;
}

}  // namespace

TEST_CASE("light passes gaps between slabs in contact, wherever they stand, on every renderer" *
          doctest::test_suite("full")) {
    for (const std::vector<double>& indices :
        {std::vector<double>{1.5}, std::vector<double>{1.33, 1.5}, std::vector<double>{1.5, 1.5}})
        for (const Tracer& tracer : tracers())
            for (const bool as_meshes : {false, true})
                for (const dmat4& placed : places()) {
                    CAPTURE(tracer.name);
                    CAPTURE(as_meshes);
                    CAPTURE(indices.size());
                    CAPTURE(placed[3].x);
                    const Mean found = mean_of_image(
                        *tracer.renderer, slabs_on_lamp(indices, as_meshes, placed), settings_of(16, 200), 64);
                    // Optical contact would be 4 % brighter, 16 standard errors. Six are a false alarm in 1e9.
                    CHECK(std::abs(found.value - through_gaps(indices)) < 6.0 * found.error);
                }
}

TEST_CASE("glass on a floor and a hair above it have the same image") {
    const auto scene = [](double gap, bool ball, const dmat4& placed) {
        const auto at = [&](const dvec3& p) { return dvec3(placed * glm::dvec4(p, 1.0)); };
        SceneBuilder builder;
        builder.camera(at({1.0, 4.0, 5.0}), at({0.0, 0.5, 0.0}), 30.0, dvec3(placed * glm::dvec4(0.0, 1.0, 0.0, 0.0)));
        builder.background(white);
        builder.quad(diffuse(dvec3(0.6)), {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}, placed);
        if (ball)
            builder.sphere(glass(1.5), {0, 1.0 + gap, 0}, 1.0, placed);
        else
            builder.cuboid(glass(1.5), {-1, gap, -1}, {1, 1, 1}, placed);
        return builder.scene();
    };
    for (const Tracer& tracer : tracers()) {
        if (tracer.name == "oracle") continue;  // as slow as it is, the slabs are enough
        for (const bool ball : {false, true})
            for (const dmat4& placed : {dmat4(1.0), places()[2], places()[5]}) {
                CAPTURE(tracer.name);
                CAPTURE(ball);
                CAPTURE(placed[3].x);
                const RenderSettings settings = settings_of(32, 30);
                const Mean touching = mean_of_image(*tracer.renderer, scene(0.0, ball, placed), settings, 128);
                RenderSettings other = settings;
                other.seed = 2;
                const Mean above = mean_of_image(*tracer.renderer, scene(1e-3, ball, placed), other, 128);
                // The gap itself turns up at its rim alone: 1e-3 of the block's height, of which few pixels see a part.
                CHECK(std::abs(touching.value - above.value) < 6.0 * std::hypot(touching.error, above.error) + 1e-4);
            }
    }
}
