// A renderer whose errors and times are known by construction, and runs of `tandem cost` on it.
#pragma once

#include <doctest/doctest.h>

#include <cmath>

#include "common/cost/reference.h"
#include "common/cost/schedule.h"
#include "common/error.h"
#include "tests/common/synthetic_renderer.h"

namespace tandem::known_cost {

inline constexpr double level = 4.0, seconds_a_sample = 1e-3;

// That all known renderers have taken, by their own account.
inline double& rendered_seconds() {
    static double seconds = 0.0;
    return seconds;
}

// Noise of variance 1 about `level`. The whitted integrator is off by `bias` in every other column. next-event has a
// quarter of the variance at half the speed. Double precision takes thrice the time.
class KnownRenderer : public Renderer {
public:
    // Each render takes `start` seconds before its first sample. Times are even in logarithm between exp(-sway) and
    // exp(sway) times what they would be.
    KnownRenderer(BackendOptions options, double bias, double start = 0.0, double sway = 0.0)
        : options_(std::move(options)), bias_(bias), start_(start), sway_(sway) {
        const Precision precision = options_.precision.value_or(Precision::single_precision);
        if (precision != Precision::single_precision && precision != Precision::double_precision)
            throw UnsupportedError("not here");
    }
    RendererInfo info() const override { return {"known", "no device", "no driver", "C++"}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        if (settings.integrator == Integrator::bidirectional) throw UnsupportedError("no bidirectional paths here");
        const double bias = settings.integrator == Integrator::whitted ? bias_ : 0.0;
        const double scale = settings.integrator == Integrator::next_event ? 0.5 : 1.0;
        double seconds = seconds_a_sample / (scale == 0.5 ? 0.5 : 1.0);
        if (options_.precision == Precision::double_precision) seconds *= 3.0;
        return std::make_unique<Job>(
            settings,
            [=](std::uint32_t x, std::uint32_t, SampleRandom& random) {
                const double value = level + scale * random.triangular() + (x % 2 == 0 ? bias : -bias);
                return Radiance{value, value, value};
            },
            seconds, start_, sway_);
    }

private:
    struct Job : SyntheticJob {
        Job(RenderSettings settings, Sampler sampler, double seconds, double start, double sway)
            : SyntheticJob(settings, std::move(sampler)), seconds_(seconds), start_(start), sway_(sway) {}
        RenderResult render(SampleRange range, const RenderControl& control) override {
            RenderResult result = SyntheticJob::render(range, control);
            const double golden = 0.6180339887, phase = golden * ++calls_;
            result.seconds = start_ + seconds_ * static_cast<double>(range.count());
            result.seconds *= std::exp(sway_ * (2.0 * (phase - std::floor(phase)) - 1.0));
            rendered_seconds() += result.seconds;
            return result;
        }
        double seconds_, start_, sway_;
        int calls_ = 0;
    };
    BackendOptions options_;
    double bias_, start_, sway_;
};

// A clock that moves on by what was rendered, and a millisecond at every look. So what is done does not depend on the
// machine.
inline CostControl control_of(int& looks) {
    CostControl control;
    control.now = [&looks, start = rendered_seconds()] { return rendered_seconds() - start + 1e-3 * looks++; };
    return control;
}

inline CostRequest request_for(double bias, std::uint64_t seed = 1) {
    CostRequest request;
    request.scene_file = "scene.json";
    request.backend = request.reference_backend = "known";
    request.baseline.render.width = request.baseline.render.height = 16;
    request.make = request.make_reference = [bias](const BackendOptions& options) {
        return std::make_unique<KnownRenderer>(options, bias);
    };
    request.knobs = {"integrator", "precision"};
    request.seconds = 6.0;
    request.seed = seed;
    return request;
}

inline CostReport measured(double bias, std::uint64_t seed = 1) {
    int looks = 0;
    CostRequest request = request_for(bias, seed);
    request.seconds = 20.0;
    return run_cost(Scene{}, request, control_of(looks));
}

inline const ArmFigures& arm(const CostReport& report, const std::string& name) {
    for (const ArmFigures& figures : report.figures)
        if (figures.arm.name() == name) return figures;
    FAIL("no arm " << name);
    return report.figures.front();
}

// Three times the 95 % interval: a false alarm once in 10^8 for normal errors.
inline bool holds(const Estimated& figure, double truth) {
    return std::abs(truth - figure.value) <= 3.0 * std::max(figure.high - figure.value, figure.value - figure.low);
}

// An arm for each knob, whose error is 50 % of the mean at 4 samples, which take a second.
inline CostReport report_of(const std::vector<const char*>& knobs) {
    CostReport report;
    for (const char* knob : knobs) {
        ArmFigures& arm = report.figures.emplace_back();
        arm.arm.knob = knob;
        arm.arm.keeps_estimate = true;
        arm.variance = 0.25;
        CostPoint& point = arm.points.emplace_back();
        point.samples = 4;
        point.seconds = {1.0, 1.0, 1.0};
        point.rmse = {0.5, 0.5, 0.5};
    }
    return report;
}

}  // namespace tandem::known_cost
