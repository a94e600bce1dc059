// The floors that `tandem cost` finds on the CPU, against closed forms.
#include <doctest/doctest.h>

#include <cmath>

#include "common/cost/run_cost.h"
#include "cpu_ref/backend.h"
#include "tests/scene_builder.h"

namespace tandem {
namespace {

using namespace tandem::test;

CostRequest request_for(const RenderSettings& settings, const std::string& knob) {
    CostRequest request;
    request.backend = request.reference_backend = "cpu";
    request.make = request.make_reference = [](const BackendOptions& options) { return cpu_backend().create(options); };
    request.baseline.render = settings;
    request.baseline.render.width = request.baseline.render.height = 8;
    request.knobs = {knob};
    request.seconds = 3.0;
    return request;
}

TEST_CASE("cost: a bounce limit in a furnace leaves the rest of the geometric series as its floor") {
    // From within a ball that reflects half and emits 1: radiance 2, of which D events miss 2^-(D + 1) relatively.
    const Scene scene = SceneBuilder()
                            .camera({0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 60.0)
                            .sphere(diffuse(dvec3(0.5), white), {0.1, 0.2, 0.3}, 3.0)
                            .scene();
    RenderSettings settings;
    settings.bounces = 40;
    const CostReport report = run_cost(scene, request_for(settings, "bounces"), {});
    CHECK(report.reference.image_mean() == doctest::Approx(2.0).epsilon(0.01));
    std::size_t seen = 0;
    for (const ArmFigures& arm : report.figures) {
        const double truth = std::pow(0.5, arm.arm.settings.render.bounces + 1.0);
        CAPTURE(arm.arm.name());
        const Estimated floor = arm.bias_floor();
        // Three times the interval's half width, as many arms are looked at.
        CHECK(floor.value >= 0.0);
        CHECK(
            std::abs(arm.squared_bias.value - truth * truth) <= 3.0 * (arm.squared_bias.high - arm.squared_bias.value));
        if (truth > 0.01) {
            CHECK(arm.has_floor);
            CHECK(floor.value == doctest::Approx(truth).epsilon(0.05));
            CHECK_FALSE(arm.time_to(0.01).seconds.has_value());
            ++seen;
        }
        if (truth < 1e-6) CHECK_FALSE(arm.has_floor);
    }
    CHECK(seen == 3);  // 1, 2 and 4 events
}

}  // namespace
}  // namespace tandem
