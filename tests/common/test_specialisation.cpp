#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "common/error.h"
#include "common/validation/specialisation.h"

namespace tandem {
namespace {

// A job that takes a known time, told rather than spent, with a known scatter.
class TimedJob final : public RenderJob {
public:
    TimedJob(double seconds, double value, EffectSet effects) : seconds_(seconds), value_(value), effects_(effects) {}
    JobFacts facts() const override {
        JobFacts facts;
        facts.effects = effects_;
        return facts;
    }
    RenderResult render(SampleRange range, const RenderControl& control) override {
        RenderResult result;
        result.estimate = Estimate(1, 1);
        if (control.stop.stop_requested()) return result;
        for (std::uint64_t begin = range.begin; begin < range.end; begin += samples_per_block)
            result.estimate.add_block({begin, begin + samples_per_block},
                Estimate::Plane(
                    channel_count, Moments{value_ * samples_per_block, value_ * value_ * samples_per_block}));
        result.device_seconds = seconds_ * std::exp(noise_(random_)) * static_cast<double>(range.count());
        return result;
    }

private:
    double seconds_, value_;
    EffectSet effects_;
    std::mt19937_64 random_{7};
    std::normal_distribution<double> noise_{0.0, 0.02};
};

struct TimedRenderer final : Renderer {
    double general_seconds, general_value;
    TimedRenderer(double seconds, double value) : general_seconds(seconds), general_value(value) {}
    RendererInfo info() const override { return {"timed", "no device", "no driver", "C++"}; }
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        const bool general = settings.effects == EffectSet::all();
        return std::make_unique<TimedJob>(general ? general_seconds : 1e-3, general ? general_value : 0.5,
            settings.effects.value_or(needed_effects(scene, settings)));
    }
};

SpecialisationReport measure(double general_seconds, double general_value) {
    TimedRenderer renderer(general_seconds, general_value);
    SpecialisationOptions options;
    options.most_rounds = 40;
    return measure_specialisation(Scene{}, RenderSettings{}, renderer, options);
}

TEST_CASE("specialisation: a known speed-up lies in the interval, and pays for itself") {
    const SpecialisationReport report = measure(1.5e-3, 0.5);
    CHECK(report.identical);
    CHECK(report.device_clock);
    CHECK(report.rounds == 40);
    CHECK(report.interval.low < 1.5);
    CHECK(report.interval.high > 1.5);
    CHECK(report.interval.high - report.interval.low < 0.06);
    CHECK(report.specialised.milliseconds == doctest::Approx(1.0).epsilon(0.02));
    CHECK(report.general.milliseconds == doctest::Approx(1.5).epsilon(0.02));
    CHECK(report.general.facts.effects == EffectSet::all());
    CHECK(report.specialised.facts.effects == EffectSet{});
    REQUIRE(report.samples_to_pay.has_value());
    CHECK(*report.samples_to_pay >= 0.0);
}

TEST_CASE("specialisation: no speed-up is none, and never pays") {
    const SpecialisationReport report = measure(1e-3, 0.5);
    CHECK(report.interval.low < 1.0);
    CHECK(report.interval.high > 1.0);
    CHECK_FALSE(report.samples_to_pay.has_value());
}

TEST_CASE("specialisation: an image that differs in its last bit is told") {
    CHECK_FALSE(measure(1e-3, std::nextafter(0.5, 1.0)).identical);
}

TEST_CASE("specialisation: a stop before the timing is an error, no report") {
    TimedRenderer renderer(1e-3, 0.5);
    std::stop_source stop;
    stop.request_stop();
    SpecialisationOptions options;
    options.stop = stop.get_token();
    CHECK_THROWS_AS((void)measure_specialisation(Scene{}, RenderSettings{}, renderer, options), Error);
}

}  // namespace
}  // namespace tandem
