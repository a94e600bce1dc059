#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <utility>

#include "common/error.h"
#include "common/validation/verify/specialisation.h"

namespace tandem {
namespace {

// A job that takes a known time, told rather than spent, with a known scatter. Its kernels take a second to make, and
// two more at first use.
class TimedJob final : public RenderJob {
public:
    TimedJob(double seconds, double value, EffectSet effects, std::string variant)
        : seconds_(seconds), value_(value), effects_(effects), variant_(std::move(variant)) {}
    JobFacts facts() const override {
        JobFacts facts;
        facts.effects = effects_;
        facts.variant = variant_;
        facts.kernel_seconds = 1.0;
        return facts;
    }
    RenderResult render(SampleRange range, const RenderControl& control) override {
        RenderResult result;
        result.estimate = Estimate(1, 1);
        if (control.stop.stop_requested()) return result;
        for (std::uint64_t begin = range.begin; begin < range.end; begin += samples_per_block) {
            const std::uint64_t end = std::min(begin + samples_per_block, range.end);
            const auto count = static_cast<double>(end - begin);
            result.estimate.add_block(
                {begin, end}, Estimate::Plane(channel_count, Moments{value_ * count, value_ * value_ * count}));
        }
        result.seconds = std::exchange(used_, true) ? 0.5 : 2.5;
        result.device_seconds = seconds_ * std::exp(noise_(random_)) * static_cast<double>(range.count());
        return result;
    }

private:
    double seconds_, value_;
    EffectSet effects_;
    std::string variant_;
    bool used_ = false;
    std::mt19937_64 random_{7};
    std::normal_distribution<double> noise_{0.0, 0.02};
};

struct Timing {
    double general_seconds, general_value;
    std::string variant = "";
    std::vector<char> made = {};  // 's' or 'g'; 'r' for a new renderer, 'w' for the job that warms it
};

struct TimedRenderer final : Renderer {
    Timing& timing;
    explicit TimedRenderer(Timing& given) : timing(given) { timing.made.push_back('r'); }
    RendererInfo info() const override { return {"timed", "no device", "no driver", "C++"}; }
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        const bool general = settings.effects == EffectSet::all();
        timing.made.push_back(settings.width == 1 ? 'w' : general ? 'g' : 's');
        return std::make_unique<TimedJob>(general ? timing.general_seconds : 1e-3, general ? timing.general_value : 0.5,
            settings.effects.value_or(needed_effects(scene, settings)), timing.variant);
    }
};

SpecialisationReport measure(Timing& timing, std::stop_token stop = {}) {
    SpecialisationOptions options;
    options.most_rounds = 40;
    options.stop = stop;
    return measure_specialisation(
        Scene{}, RenderSettings{}, [&] { return std::make_unique<TimedRenderer>(timing); }, options);
}
SpecialisationReport measure(double general_seconds, double general_value) {
    Timing timing{general_seconds, general_value};
    return measure(timing);
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
    CHECK(report.specialised.kernel_seconds == doctest::Approx(3.0));
    CHECK(report.general.kernel_seconds == doctest::Approx(3.0));
    CHECK(report.specialised.kernel_replicates.size() == 2);
    REQUIRE(report.samples_to_pay.has_value());
    CHECK(*report.samples_to_pay == doctest::Approx(3.0 / 0.5e-3).epsilon(0.1));
}

TEST_CASE("specialisation: kernels are made in alternate order, by a new renderer that something else has warmed") {
    Timing timing{1.5e-3, 0.5};
    (void)measure(timing);
    CHECK(timing.made == std::vector<char>{'r', 'w', 's', 'g', 'r', 'w', 'g', 's'});
}

TEST_CASE("specialisation: variants that are compiled ahead cost nothing, and pay from the first sample") {
    Timing timing{1.5e-3, 0.5, "lean"};
    const SpecialisationReport report = measure(timing);
    CHECK(report.specialised.kernel_seconds == 0.0);
    CHECK(report.general.kernel_seconds == 0.0);
    REQUIRE(report.samples_to_pay.has_value());
    CHECK(*report.samples_to_pay == 0.0);
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

TEST_CASE("specialisation: a stop leaves what the rounds before it say, if there are two") {
    for (const std::size_t rounds : {1u, 2u, 7u}) {
        CAPTURE(rounds);
        Timing timing{1.5e-3, 0.5};
        std::stop_source stop;
        SpecialisationOptions options;
        options.seconds = 1e9;
        options.stop = stop.get_token();
        std::size_t done = 0;
        options.progress = [&](double) {
            if (++done == rounds) stop.request_stop();
        };
        const SpecialisationReport report = measure_specialisation(
            Scene{}, RenderSettings{}, [&] { return std::make_unique<TimedRenderer>(timing); }, options);
        CHECK(report.rounds == rounds);
        CHECK(report.made);
        CHECK(report.identical);
        CHECK(report.interval.low < 1.5);
        CHECK((report.interval.high > 1.5) == (rounds >= fewest_timed_rounds));
    }
}

TEST_CASE("specialisation: a stop before the kernels are made leaves the findings") {
    Timing timing{1e-3, 0.5};
    std::stop_source stop;
    stop.request_stop();
    const SpecialisationReport report = measure(timing, stop.get_token());
    CHECK_FALSE(report.made);
    CHECK(report.rounds == 0);
    CHECK(report.findings.size() == effect_count);
}

TEST_CASE("specialisation: kernels are made once where making them again would take the time for rounds") {
    Timing timing{1.5e-3, 0.5};
    SpecialisationOptions options;
    options.seconds = 0.0;
    const SpecialisationReport report = measure_specialisation(
        Scene{}, RenderSettings{}, [&] { return std::make_unique<TimedRenderer>(timing); }, options);
    CHECK(timing.made == std::vector<char>{'r', 'w', 's', 'g'});
    CHECK(report.rounds == options.least_rounds);
}

}  // namespace
}  // namespace tandem
