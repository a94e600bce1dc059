// The floors that `tandem cost` finds on the CPU, against closed forms.
#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include "common/cost/run_cost.h"
#include "cpu_ref/backend.h"
#include "tests/scene_builder.h"

namespace tandem {
namespace {

using namespace tandem::test;

// The CPU's samples. By the test's own clock each takes so many seconds for all pixels, so what is measured does not
// depend on the machine.
class TimedCpu : public Renderer {
public:
    TimedCpu(const BackendOptions& options, double seconds_a_sample, double& now)
        : cpu_(cpu_backend().create(options)), seconds_a_sample_(seconds_a_sample), now_(now) {}
    RendererInfo info() const override { return cpu_->info(); }
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        struct Job : RenderJob {
            Job(std::unique_ptr<RenderJob> own, double a_sample, double& time)
                : job(std::move(own)), seconds_a_sample(a_sample), now(time) {}
            JobFacts facts() const override { return job->facts(); }
            RenderResult render(SampleRange range, const RenderControl& control) override {
                RenderResult result = job->render(range, control);
                return timed(std::move(result), range);
            }
            RenderResult render_pixels(
                SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override {
                return timed(job->render_pixels(range, pixels, control), range);
            }
            RenderResult timed(RenderResult result, SampleRange range) {
                result.seconds = seconds_a_sample * static_cast<double>(range.count());
                now += result.seconds;
                return result;
            }
            std::unique_ptr<RenderJob> job;
            double seconds_a_sample;
            double& now;
        };
        return std::make_unique<Job>(cpu_->prepare(scene, settings), seconds_a_sample_, now_);
    }

private:
    std::unique_ptr<Renderer> cpu_;
    double seconds_a_sample_;
    double& now_;
};

CostReport measured(
    const Scene& scene, const RenderSettings& settings, const std::string& knob, double seconds_a_sample) {
    double now = 0.0;
    CostRequest request;
    request.backend = request.reference_backend = "cpu";
    request.make = request.make_reference = [&](const BackendOptions& options) {
        return std::make_unique<TimedCpu>(options, seconds_a_sample, now);
    };
    request.baseline.render = settings;
    request.baseline.render.width = request.baseline.render.height = 8;
    request.knobs = {knob};
    request.seconds = 3.0;
    CostControl control;
    control.now = [&now] { return now += 1e-4; };
    return run_cost(scene, request, control);
}

TEST_CASE("cost: a bounce limit in a furnace leaves the rest of the geometric series as its floor") {
    // From within a ball that reflects half and emits 1: radiance 2, of which D events miss 2^-(D + 1) relatively.
    const Scene scene = SceneBuilder()
                            .camera({0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, 60.0)
                            .sphere(diffuse(dvec3(0.5), white), {0.1, 0.2, 0.3}, 3.0)
                            .scene();
    RenderSettings settings;
    settings.bounces = 40;
    const CostReport report = measured(scene, settings, "bounces", 2e-5);
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

TEST_CASE("cost: a clamp leaves a floor of the radiance that it cuts off") {
    // A lamp of radiance L before black, of which a pixel sees the share f: mean f L, cut off to f X. So the floor is
    // (1 - X/L) of the root mean square of the pixels over their mean.
    const Scene scene = SceneBuilder()
                            .camera({0.0, 0.0, 4.0}, {0.0, 0.0, 0.0}, 40.0)
                            .sphere(emitter(dvec3(10.0)), {0.1, 0.2, 0.0}, 0.4)
                            .scene();
    RenderSettings settings;
    settings.bounces = 2;
    const CostReport report = measured(scene, settings, "clamp", 5e-6);
    const CostReference& reference = report.reference;
    double squares = 0.0;
    for (const double value : reference.mean) squares += value * value;
    const double spread = std::sqrt(squares / static_cast<double>(reference.mean.size())) / reference.image_mean();
    std::size_t biased = 0;
    for (const ArmFigures& arm : report.figures) {
        CAPTURE(arm.arm.name());
        const double truth = std::max(0.0, 1.0 - arm.arm.settings.render.clamp / 10.0) * spread;
        if (truth == 0.0) {
            CHECK_FALSE(arm.has_floor);
            continue;
        }
        ++biased;
        CHECK(arm.has_floor);
        CHECK(arm.bias_floor().value == doctest::Approx(truth).epsilon(0.03));
        CHECK_FALSE(arm.time_to(0.01).seconds.has_value());
        CHECK_FALSE(arm.is_safe_at(0.01));
    }
    CHECK(biased >= 1);  // 4 means of the image; 64 are above the lamp's radiance
    CHECK(soonest(report.figures, 0.01) == &report.figures.front());
}

TEST_CASE("cost: scrambled Sobol points have a steeper slope than independent numbers, and no floor") {
    // Edges in pixels: the error of n points falls about as n^-3/4.
    const Scene scene = SceneBuilder()
                            .camera({0.0, 0.0, 4.0}, {0.0, 0.0, 0.0}, 40.0)
                            .sphere(emitter(dvec3(10.0)), {0.1, 0.2, 0.0}, 1.0)
                            .scene();
    RenderSettings settings;
    settings.bounces = 1;
    const CostReport report = measured(scene, settings, "generator", 5e-6);
    for (const ArmFigures& arm : report.figures) {
        CAPTURE(arm.arm.name());
        REQUIRE(arm.slope.has_value());
        CAPTURE(arm.slope->value);
        CAPTURE(arm.points.back().samples);
        CAPTURE(arm.replicates);
        CHECK_FALSE(arm.has_floor);
        if (arm.arm.setting == "sobol") {
            CHECK_FALSE(arm.independent);
            CHECK(arm.slope->high < -0.6);
            CHECK(arm.cost_ratio.high < 1.0);
        } else {
            CHECK(std::abs(arm.slope->value + 0.5) <= 3.0 * (arm.slope->high - arm.slope->value));
        }
    }
}

}  // namespace
}  // namespace tandem
