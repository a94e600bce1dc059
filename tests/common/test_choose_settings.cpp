// What a short trial chooses for a target error, where the costs are known.
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "common/cost/choose_settings.h"
#include "common/cost/settings_trial.h"
#include "common/error.h"
#include "tests/common/synthetic_renderer.h"
#include "tests/scene_builder.h"

namespace tandem {
namespace {

constexpr double seconds_of_sample = 1e-6;

// Even in [0, 1) for each power of two of samples up to 2^bits: bits reversed.
double stratified(std::uint64_t sample, unsigned bits, SampleRandom& random) {
    double place = std::ldexp(random.uniform(), -static_cast<int>(bits));
    for (unsigned bit = 0; bit < bits; ++bit)
        if (((sample >> bit) & 1) != 0) place += std::ldexp(0.5, -static_cast<int>(bit));
    return place;
}

// All channels of a sample have the value that `value_of` gives for its number and random numbers.
template <class Value>
Estimate estimate_of(const RenderSettings& settings, SampleRange range, const Value& value_of) {
    Estimate estimate(settings.width, settings.height);
    Estimate::Plane plane(estimate.pixel_count() * channel_count);
    for (std::uint64_t pixel = 0; pixel < estimate.pixel_count(); ++pixel)
        for (std::uint64_t sample = range.begin; sample < range.end; ++sample) {
            SampleRandom random(settings.seed + (sample >> 32), pixel, sample);
            const double value = value_of(sample, random);
            for (std::size_t c = 0; c < channel_count; ++c) {
                plane[pixel * channel_count + c].sum += value;
                plane[pixel * channel_count + c].sum_of_squares += value * value;
            }
        }
    estimate.add_block(range, plane);
    return estimate;
}

// Paths have `ratio` times the variance of next events at the same time. Roulette takes `roulette` times as long, from
// the first event on the square of it; 0: there is none.
class TrialRenderer : public Renderer {
public:
    TrialRenderer(double ratio, bool even, double roulette) : ratio_(ratio), even_(even), roulette_(roulette) {}
    RendererInfo info() const override { return {"trial", "no device", "no driver", "C++"}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        if (settings.roulette_start != no_roulette && roulette_ == 0.0) throw UnsupportedError("no roulette here");
        if (settings.generator == Generator::sobol) return sobol_job(settings);
        struct Job : SyntheticJob {
            using SyntheticJob::SyntheticJob;
            double factor = 1.0;
            RenderResult render(SampleRange range, const RenderControl& control) override {
                RenderResult result = SyntheticJob::render(range, control);
                result.seconds = factor * seconds_of_sample * static_cast<double>(result.estimate.count());
                return result;
            }
        };
        const double scale = settings.integrator == Integrator::path ? std::sqrt(ratio_) : 1.0;
        auto job = std::make_unique<Job>(settings, [scale](std::uint32_t, std::uint32_t, SampleRandom& random) {
            const double value = 5.0 + scale * random.triangular();
            return Radiance{value, value, value};
        });
        job->factor = factor_of(settings);
        return job;
    }

private:
    double factor_of(const RenderSettings& settings) const {
        if (settings.roulette_start == no_roulette) return 1.0;
        return settings.roulette_start == 1 ? roulette_ * roulette_ : roulette_;
    }
    // Points in strata, whose n points have a squared error that falls as n^-3; the choice believes n^-2. Or
    // independent numbers, for which `even_` is off.
    std::unique_ptr<RenderJob> sobol_job(const RenderSettings& settings) const {
        struct Job : RenderJob {
            RenderSettings settings;
            double scale = 1.0;
            bool even = true;
            RenderResult render(SampleRange range, const RenderControl&) override {
                RenderResult result;
                result.estimate = estimate_of(settings, range, [&](std::uint64_t sample, SampleRandom& random) {
                    const double u = even ? stratified(sample, 6, random) : random.uniform();
                    return 5.0 + scale * (u - 0.5) * std::sqrt(12.0);
                });
                result.seconds = factor * seconds_of_sample * static_cast<double>(range.count());
                return result;
            }
            double factor = 1.0;
        };
        auto job = std::make_unique<Job>();
        job->factor = factor_of(settings);
        job->settings = settings;
        job->even = even_;
        job->scale = settings.integrator == Integrator::path ? std::sqrt(ratio_) : 1.0;
        return job;
    }

    double ratio_;
    bool even_;
    double roulette_;
};

// With a light for next events.
Scene lit() {
    return test::SceneBuilder()
        .camera({0.0, 0.0, 5.0}, {0.0, 0.0, 0.0})
        .sphere(test::emitter(glm::dvec3(1.0)), {0.0, 3.0, 0.0}, 1.0)
        .sphere(test::diffuse(glm::dvec3(0.5)), {0.0, 0.0, 0.0}, 1.0)
        .scene();
}

RenderSettings of_next_events() {
    RenderSettings settings;
    settings.integrator = Integrator::next_event;
    return settings;
}

SettingsChoice chosen(double ratio, const OpenSettings& open, const Scene& scene = lit(), bool even = false,
    double error = 1e-5, double roulette = 10.0, std::uint32_t size = 16) {
    TrialRenderer renderer(ratio, even, roulette);
    RenderSettings settings = of_next_events();
    settings.width = settings.height = size;
    return choose_settings(scene, settings, open, renderer, {.relative_error = error}, {});
}

// A device whose every call takes some seconds beside what its own clock tells. It notes how many samples the calls of
// each job have.
class DistantRenderer : public Renderer {
public:
    explicit DistantRenderer(double call_seconds, double slowness = 1.0)
        : call_seconds_(call_seconds), slowness_(slowness) {}
    RendererInfo info() const override { return device_.info(); }
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        struct Job : RenderJob {
            std::unique_ptr<RenderJob> device;
            std::shared_ptr<std::vector<std::uint64_t>> calls;
            double call_seconds = 0.0, slowness = 1.0;
            RenderResult render(SampleRange range, const RenderControl& control) override {
                calls->push_back(range.count());
                RenderResult result = device->render(range, control);
                result.seconds *= slowness;
                result.device_seconds = result.seconds;
                result.seconds += call_seconds;
                return result;
            }
        };
        auto job = std::make_unique<Job>();
        job->device = device_.prepare(scene, settings);
        job->calls = calls.emplace_back(std::make_shared<std::vector<std::uint64_t>>());
        job->call_seconds = call_seconds_;
        job->slowness = slowness_;
        return job;
    }

    std::vector<std::shared_ptr<std::vector<std::uint64_t>>> calls;

private:
    double call_seconds_, slowness_;
    TrialRenderer device_{0.25, false, 10.0};
};

TEST_CASE(
    "what a call takes is forecast once, not for every sample, and a trial has samples that are worth its calls") {
    constexpr double call_seconds = 1e5 * seconds_of_sample;
    RenderSettings settings = of_next_events();
    settings.width = settings.height = 16;
    const OpenSettings open{.integrator = true, .roulette = false, .sampling = false, .generator = false};
    DistantRenderer distant(call_seconds), twice_as_far(2.0 * call_seconds), close(0.0);
    const SettingsChoice far = choose_settings(lit(), settings, open, distant, {.relative_error = 1e-5}, {});
    const SettingsChoice farther = choose_settings(lit(), settings, open, twice_as_far, {.relative_error = 1e-5}, {});
    const SettingsChoice near = choose_settings(lit(), settings, open, close, {.relative_error = 1e-5}, {});
    CHECK(far.chosen == near.chosen);
    CHECK(far.chosen == farther.chosen);
    REQUIRE(far.trials.size() == 2);
    REQUIRE(farther.trials.size() == far.trials.size());
    for (std::size_t i = 0; i < far.trials.size(); ++i)
        CHECK(farther.trials[i].seconds_to_error - far.trials[i].seconds_to_error ==
              doctest::Approx(call_seconds).epsilon(0.01));
    // The second trial of `near` is of another length.
    REQUIRE(near.trials.size() == 2);
    CHECK(far.trials[0].seconds_to_error - near.trials[0].seconds_to_error ==
          doctest::Approx(call_seconds).epsilon(0.01));
    // The second call of a job is its first trial, after a sample that warms up.
    CHECK(distant.calls.at(0)->at(1) == 8);
    CHECK(distant.calls.at(1)->at(1) == 32);
    CHECK(close.calls.at(1)->at(1) == 8);
}

TEST_CASE("a trial that is worth its calls is shorter where it would leave others less than half of the time") {
    RenderSettings settings = of_next_events();
    settings.width = settings.height = 16;
    constexpr double slowness = 1e4;  // so that the test's own time does not count
    // A call takes as long as 16 samples. So 32 take 65 with two calls and one sample before, and 16 take 49. The error
    // takes 617 samples and a call, of which 18 % are 114.
    DistantRenderer distant(16.0 * slowness * seconds_of_sample, slowness);
    const OpenSettings open{.integrator = true, .roulette = false, .sampling = false, .generator = false};
    (void)choose_settings(lit(), settings, open, distant, {.relative_error = std::sqrt(0.04 / 617.0)}, {});
    CHECK(distant.calls.at(1)->at(1) == 16);
}

// A device whose first call for a job, or a later one, takes a hundred times as long as others. It notes how many
// samples a call has.
class OnceSlowRenderer : public Renderer {
public:
    explicit OnceSlowRenderer(unsigned slow_call) : slow_call_(slow_call) {}
    RendererInfo info() const override { return device_.info(); }
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        struct Job : RenderJob {
            std::unique_ptr<RenderJob> device;
            std::vector<std::uint64_t>* calls = nullptr;
            unsigned until_slow = 0;
            RenderResult render(SampleRange range, const RenderControl& control) override {
                calls->push_back(range.count());
                RenderResult result = device->render(range, control);
                if (until_slow-- == 0) result.seconds *= 100.0;
                return result;
            }
        };
        auto job = std::make_unique<Job>();
        job->device = device_.prepare(scene, settings);
        job->calls = &calls;
        job->until_slow = slow_call_;
        return job;
    }

    std::vector<std::uint64_t> calls;

private:
    unsigned slow_call_;
    TrialRenderer device_{1.0, true, 10.0};
};

TEST_CASE("a first trial renders its two scramblings alone, and the sooner one tells the time") {
    for (const unsigned slow_call : {0u, 1u}) {
        CAPTURE(slow_call);
        OnceSlowRenderer once_slow(slow_call);
        RenderSettings settings = of_next_events();
        settings.width = settings.height = 128;
        const SettingsChoice choice = choose_settings(lit(), settings, {}, once_slow, {.relative_error = 0.06}, {});
        CHECK(once_slow.calls == std::vector<std::uint64_t>{4, 4});
        CHECK(choice.trials.at(0).seconds_to_error == doctest::Approx(11.1 * seconds_of_sample).epsilon(0.1));
        CHECK(choice.trials.at(1).seconds_to_error == doctest::Approx(32 * seconds_of_sample));
    }
}

TEST_CASE("a first trial that outlasts its time leaves the given settings, and nothing is said of it") {
    class Endless : public Renderer {
    public:
        RendererInfo info() const override { return {"endless", "no device", "no driver", "C++"}; }
        std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings&) override {
            struct Job : RenderJob {
                RenderResult render(SampleRange, const RenderControl& control) override {
                    while (!control.stop.stop_requested()) std::this_thread::yield();
                    return {Estimate(64, 64), 0.0, std::nullopt};
                }
            };
            ++prepared;
            std::this_thread::sleep_for(preparation);
            return std::make_unique<Job>();
        }
        unsigned prepared = 0;
        std::chrono::milliseconds preparation{0};
    } endless;
    RenderSettings settings;
    settings.width = settings.height = 64;
    const SettingsChoice choice = choose_settings(lit(), settings, {}, endless, {.stop_seconds = 0.01}, {});
    CHECK(choice.chosen == 0);
    CHECK(choice.settings.generator == Generator::philox);
    CHECK(choice.settings.integrator == Integrator::path);
    CHECK(choice.job != nullptr);
    CHECK(choice.trials.empty());
    CHECK(choice.options.empty());
    CHECK(endless.prepared == 2);
    // What takes longer to prepare than trials may is not prepared again.
    endless.prepared = 0;
    endless.preparation = std::chrono::milliseconds(30);
    const SettingsChoice kept = choose_settings(lit(), settings, {}, endless, {.stop_seconds = 0.01}, {});
    CHECK(endless.prepared == 1);
    CHECK(kept.job != nullptr);
    CHECK(kept.options == "--integrator next-event --generator sobol");  // no trial tells it
    CHECK_FALSE(choice.expected_samples.has_value());
}

TEST_CASE("the settings of least variance times time are chosen, and the job is theirs") {
    const SettingsChoice choice = chosen(0.25, {});
    CHECK(choice.settings.integrator == Integrator::path);
    CHECK(choice.settings.roulette_start == no_roulette);
    CHECK(choice.trials.at(choice.chosen).options == "--integrator path");
    CHECK(choice.trials.at(choice.chosen).seconds_to_error ==
          doctest::Approx(0.25 * choice.trials.front().seconds_to_error).epsilon(0.1));
    // As given, with paths, and with these roulette, Sobol points and adaptive sampling.
    CHECK(choice.trials.size() == 5);
    CHECK(chosen(0.25, {}, lit(), false, 1e-5, 0.0).trials.size() == 4);  // without roulette, which is not there
    const double variance = variance_of(choice.job->render({0, 4096}).estimate).front();
    CHECK(variance == doctest::Approx(0.25).epsilon(0.2));
}

TEST_CASE(
    "the given settings stay where nothing is clearly better, where they are fixed, and where images would differ") {
    CHECK(chosen(0.97, {}).chosen == 0);
    CHECK(chosen(4.0, {}).chosen == 0);
    const SettingsChoice fixed = chosen(0.25, {.integrator = false});
    CHECK(fixed.settings.integrator == Integrator::next_event);
    Scene with_lamp = lit();
    with_lamp.lights.emplace_back();
    CHECK(chosen(0.25, {}, with_lamp).settings.integrator == Integrator::next_event);
}

TEST_CASE("next events come first where the scene has light for them, and paths where that is sooner") {
    const auto by_paths = [](double ratio, double error, const OpenSettings& open, std::uint32_t size) {
        TrialRenderer renderer(ratio, false, 10.0);
        RenderSettings settings;
        settings.width = settings.height = size;
        return choose_settings(lit(), settings, open, renderer, {.relative_error = error}, {});
    };
    for (const std::uint32_t size : {16u, 64u}) {  // independent samples first, and Sobol points
        CAPTURE(size);
        CHECK(by_paths(4.0, 1e-5, {}, size).trials.at(0).options == "--integrator next-event");
        CHECK(by_paths(4.0, 1e-5, {}, size).settings.integrator == Integrator::next_event);
        CHECK(by_paths(0.25, 1e-5, {}, size).settings.integrator == Integrator::path);
        // How even points are may differ by half.
        CHECK((by_paths(0.77, 1e-5, {}, size).settings.integrator == Integrator::path) == (size == 16));
        CHECK(by_paths(4.0, 1e-5, {.integrator = false}, size).settings.integrator == Integrator::path);
        // Without time for a trial of the other: 4 % takes 0.2^2 / 0.04^2 = 25 samples.
        const SettingsChoice few = by_paths(0.25, 0.04, {}, size);
        CHECK(few.settings.integrator == Integrator::next_event);
        CHECK(few.trials.at(few.chosen).options.starts_with("--integrator next-event"));
    }
    // A renderer without them has Sobol points all the same.
    struct PathsAlone : TrialRenderer {
        using TrialRenderer::TrialRenderer;
        std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
            if (settings.integrator == Integrator::next_event) throw UnsupportedError("no next events here");
            return TrialRenderer::prepare(scene, settings);
        }
    } paths_alone(1.0, true, 10.0);
    RenderSettings large;
    large.width = large.height = 64;
    const SettingsChoice alone = choose_settings(lit(), large, {}, paths_alone, {.relative_error = 1e-5}, {});
    CHECK(alone.trials.at(0).options.empty());
    CHECK(alone.trials.at(1).options == "--generator sobol");
    // Both are the same without light.
    TrialRenderer renderer(0.25, false, 10.0);
    RenderSettings settings;
    settings.width = settings.height = 16;
    const SettingsChoice dark = choose_settings({}, settings, {}, renderer, {.relative_error = 1e-5}, {});
    CHECK(dark.settings.integrator == Integrator::path);
    for (const SettingsTrial& trial : dark.trials) CHECK(trial.settings.integrator == Integrator::path);
}

TEST_CASE(
    "Sobol points are chosen where two scramblings show that they are more even, and what they gain is foretold") {
    const SettingsChoice choice = chosen(1.0, {.sampling = false}, lit(), true);
    CHECK(choice.settings.generator == Generator::sobol);
    CHECK(choice.trials.at(choice.chosen).options == "--generator sobol");
    CHECK(choice.trials.at(choice.chosen).seconds_to_error < 0.1 * choice.trials.front().seconds_to_error);
    CHECK(chosen(1.0, {.generator = false}, lit(), true).settings.generator == Generator::philox);
    CHECK(chosen(1.0, {}, lit(), false).settings.generator == Generator::philox);
}

TEST_CASE("an image of many pixels has Sobol points from the first trial, unless fewer samples than theirs suffice") {
    for (const bool even : {false, true}) {
        CAPTURE(even);
        const SettingsChoice choice = chosen(0.25, {}, lit(), even, 1e-7, 10.0, 64);
        CHECK(choice.trials.at(1).options == "--generator sobol");
        CHECK(choice.trials.at(choice.chosen).options == "--integrator path --generator sobol");
        // 0.2^2 / 1e-7^2 independent samples.
        CHECK(choice.trials.at(0).seconds_to_error == doctest::Approx(4e12 * seconds_of_sample).epsilon(0.2));
    }
    // 6 % takes 11 independent samples, and two scramblings are judged with 16 points each at least.
    const SettingsChoice few = chosen(1.0, {}, lit(), true, 0.06, 10.0, 128);
    CHECK(few.chosen == 0);
    CHECK(few.settings.generator == Generator::philox);
    CHECK(few.trials.size() == 2);
    CHECK(few.trials.at(0).seconds_to_error == doctest::Approx(11.1 * seconds_of_sample).epsilon(0.1));
    CHECK(few.trials.at(1).seconds_to_error == doctest::Approx(32 * seconds_of_sample));
    REQUIRE(few.expected_samples.has_value());
    CHECK(*few.expected_samples > 10.0);
    CHECK(*few.expected_samples < 15.0);
    // Given Sobol points are the given settings.
    TrialRenderer renderer(0.25, true, 10.0);
    RenderSettings settings = of_next_events();
    settings.width = settings.height = 64;
    settings.generator = Generator::sobol;
    const SettingsChoice given = choose_settings(lit(), settings, {}, renderer, {.relative_error = 1e-7}, {});
    CHECK(given.trials.at(0).options.empty());
    CHECK(given.trials.at(1).options == "--integrator path");
}

TEST_CASE("a short trial tells how many samples an error takes, where nothing is open, too") {
    constexpr OpenSettings none{.integrator = false, .roulette = false, .sampling = false, .generator = false};
    const SettingsChoice choice = chosen(1.0, none, lit(), true, 0.02, 10.0, 64);  // 0.2^2 / 0.02^2
    CHECK(choice.trials.size() == 1);
    CHECK(choice.settings.integrator == Integrator::next_event);
    REQUIRE(choice.expected_samples.has_value());
    CHECK(*choice.expected_samples > 90.0);
    CHECK(*choice.expected_samples < 150.0);
}

TEST_CASE("a render is told a standard error more samples than its error is forecast to take") {
    ShortTrial trial;
    trial.noise = trial.error_of_one = 1.0;
    trial.uncertainty = 0.2;
    CHECK(trial.samples_to(0.1) == doctest::Approx(100.0));
    CHECK(trial.samples_surely_to(0.1).value() == doctest::Approx(120.0));
    trial.uncertainty = 0.9;
    CHECK(trial.samples_surely_to(0.1).value() == doctest::Approx(150.0));  // no more than half
    trial.error_of_one = 0.0;
    CHECK_FALSE(trial.samples_surely_to(0.1).has_value());
}

TEST_CASE("roulette that saves time is chosen, and Sobol points on top of it") {
    for (const bool even : {false, true}) {
        const SettingsChoice choice = chosen(1.0, {}, lit(), even, 1e-5, 0.5);
        CHECK(choice.settings.roulette_start == 4);
        CHECK((choice.settings.generator == Generator::sobol) == even);
        CHECK(choice.trials.at(choice.chosen).options == (even ? "--generator sobol --roulette 4" : "--roulette 4"));
    }
    CHECK(chosen(1.0, {}, lit(), true, 1e-5, 0.95).settings.roulette_start == no_roulette);
}

TEST_CASE(
    "roulette is tried where other trials have had all of the time for them, if that takes little of the render's") {
    struct SlowToPrepare : TrialRenderer {
        using TrialRenderer::TrialRenderer;
        std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
            if (settings.integrator == Integrator::path) std::this_thread::sleep_for(std::chrono::milliseconds(500));
            return TrialRenderer::prepare(scene, settings);
        }
    };
    OpenSettings open;
    open.generator = open.sampling = false;
    RenderSettings settings = of_next_events();
    settings.width = settings.height = 16;
    // A variance of 1 about 5: 2 s, of which trials may have 0.36 s.
    const double error = std::sqrt(seconds_of_sample / 2.0) / 5.0;
    for (const double seconds : {20.0, 0.5}) {  // of all trials, at most
        SlowToPrepare renderer(1.0, false, 0.5);
        const SettingsChoice choice =
            choose_settings(lit(), settings, open, renderer, {.relative_error = error, .most_seconds = seconds}, {});
        CHECK((choice.settings.roulette_start != no_roulette) == (seconds > 1.0));
    }
}

TEST_CASE("roulette from the first event on is tried where Sobol points are not open, and chosen where it saves time") {
    OpenSettings open;
    open.generator = false;
    const SettingsChoice choice = chosen(1.0, open, lit(), false, 1e-5, 0.5);
    CHECK(choice.settings.roulette_start == 1);
    CHECK(choice.trials.at(choice.chosen).options == "--roulette 1");
    CHECK(chosen(1.0, open, lit(), false, 1e-5, 0.98).settings.roulette_start == no_roulette);
    TrialRenderer renderer(1.0, false, 0.5);
    RenderSettings sobol = of_next_events();
    sobol.width = sobol.height = 16;
    sobol.generator = Generator::sobol;
    CHECK(choose_settings(lit(), sobol, open, renderer, {.relative_error = 1e-5}, {}).settings.roulette_start == 4);
}

TEST_CASE("the roulette of a scene is left where that saves time") {
    for (const double roulette : {0.5, 2.0}) {
        TrialRenderer renderer(1.0, true, roulette);
        RenderSettings settings = of_next_events();
        settings.width = settings.height = 16;
        settings.roulette_start = 3;
        const SettingsChoice choice = choose_settings(lit(), settings, {}, renderer, {.relative_error = 1e-5}, {});
        CHECK(choice.settings.roulette_start == (roulette < 1.0 ? 3 : no_roulette));
        CHECK(choice.trials.at(choice.chosen).options ==
              (roulette < 1.0 ? "--generator sobol" : "--generator sobol --roulette 0"));
    }
}

// Sobol points with three tenths of the noise, which they do not reduce faster than 1/n. Roulette takes 0.6 of the time
// for `added` more noise, of that kind. A sample takes so long that a trial has few points.
class RouletteRenderer : public Renderer {
public:
    explicit RouletteRenderer(double added) : added_(added) {}
    RendererInfo info() const override { return {"trial", "no device", "no driver", "C++"}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        struct Job : RenderJob {
            RenderSettings settings;
            double independent = 0.0, seconds = 0.0;
            RenderResult render(SampleRange range, const RenderControl&) override {
                RenderResult result;
                result.estimate = estimate_of(settings, range, [&](std::uint64_t sample, SampleRandom& random) {
                    const double even = std::sqrt(0.7) * (stratified(sample, 8, random) - 0.5);
                    const double uneven = std::sqrt(0.3) * (random.uniform() - 0.5);
                    const double more = std::sqrt(independent) * (random.uniform() - 0.5);
                    return 5.0 + std::sqrt(12.0) * (even + uneven + more);
                });
                result.seconds = seconds * static_cast<double>(range.count());
                return result;
            }
        };
        auto job = std::make_unique<Job>();
        const bool roulette = settings.roulette_start != no_roulette;
        job->settings = settings;
        job->independent = roulette ? added_ : 0.0;
        job->seconds = roulette ? 0.6 : 1.0;
        return job;
    }

private:
    double added_;
};

TEST_CASE("roulette that adds noise is held against how even Sobol points are, roulette that adds none is taken") {
    RenderSettings settings = of_next_events();
    settings.width = settings.height = 64;
    const OpenSettings open{.integrator = false, .roulette = true, .sampling = false, .generator = true};
    for (const double added : {0.0, 0.3}) {
        RouletteRenderer renderer(added);
        const SettingsChoice choice =
            choose_settings(lit(), settings, open, renderer, {.relative_error = 1.3e-3, .most_seconds = 1e6}, {});
        CAPTURE(added);
        CHECK(choice.settings.generator == Generator::sobol);
        CHECK((choice.settings.roulette_start != no_roulette) == (added == 0.0));
        CHECK(choice.trials.size() == 3);  // as given, with Sobol points, with roulette
    }
}

TEST_CASE(
    "roulette of a scene that spoils Sobol points is left, in images whose roulette independent samples chose, too") {
    const OpenSettings open{.integrator = false, .roulette = true, .sampling = false, .generator = true};
    for (const std::uint32_t size : {16U, 64U})
        for (const double added : {0.0, 0.3}) {
            CAPTURE(size);
            CAPTURE(added);
            RouletteRenderer renderer(added);
            RenderSettings settings = of_next_events();
            settings.width = settings.height = size;
            settings.roulette_start = 3;
            const SettingsChoice choice =
                choose_settings(lit(), settings, open, renderer, {.relative_error = 1.3e-3, .most_seconds = 1e6}, {});
            CHECK(choice.settings.generator == Generator::sobol);
            CHECK(choice.settings.roulette_start == (added == 0.0 ? 3 : no_roulette));
        }
}

TEST_CASE("trials take a small part of what the render is forecast to take, and none is tried for a short render") {
    // 4 % takes 0.2^2 / 0.04^2 = 25 samples: fewer than a trial of something else is worth.
    const SettingsChoice few = chosen(0.25, {}, lit(), false, 0.04);
    CHECK(few.trials.size() == 1);
    CHECK(few.chosen == 0);
    CHECK(few.trials.front().seconds_to_error == doctest::Approx(64 * seconds_of_sample));  // a block at least
    // No more is tried for a render that ends after a few samples, however far its error is from the asked one.
    TrialRenderer renderer(0.25, false, 10.0);
    RenderSettings settings = of_next_events();
    settings.width = settings.height = 16;
    const auto trials_for = [&](std::optional<std::uint64_t> samples) {
        const ChoiceGoal goal{.relative_error = 1e-5, .most_samples = samples};
        return choose_settings(lit(), settings, {}, renderer, goal, {}).trials.size();
    };
    CHECK(trials_for(16) == 1);
    CHECK(trials_for({}) > 1);
}

// Two columns of 32 have noise; a path takes `slowness` times as long in lists of pixels.
class UnevenRenderer : public Renderer {
public:
    explicit UnevenRenderer(double slowness) : slowness_(slowness) {}
    RendererInfo info() const override { return {"uneven", "no device", "no driver", "C++"}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        struct Job : SyntheticJob {
            using SyntheticJob::SyntheticJob;
            double slowness = 1.0;
            RenderResult render(SampleRange range, const RenderControl& control) override {
                return timed(SyntheticJob::render(range, control), 1e-6);
            }
            RenderResult render_pixels(
                SampleRange range, std::span<const std::uint32_t> pixels, const RenderControl& control) override {
                return timed(SyntheticJob::render_pixels(range, pixels, control), slowness * 1e-6);
            }
            static RenderResult timed(RenderResult result, double seconds) {
                result.seconds = seconds * static_cast<double>(result.estimate.count() * result.estimate.pixel_count());
                return result;
            }
        };
        auto job = std::make_unique<Job>(settings, [](std::uint32_t x, std::uint32_t, SampleRandom& random) {
            const double value = 5.0 + (x < 2 ? random.triangular() : 0.01 * random.triangular());
            return Radiance{value, value, value};
        });
        job->slowness = slowness_;
        return job;
    }

private:
    double slowness_;
};

TEST_CASE("adaptive sampling is chosen where noise is uneven, unless its passes are slower than they gain") {
    for (const double slowness : {1.0, 40.0}) {
        CAPTURE(slowness);
        UnevenRenderer renderer(slowness);
        RenderSettings settings = of_next_events();
        settings.width = settings.height = 32;
        const SettingsChoice choice = choose_settings(Scene{}, settings,
            {.integrator = false, .roulette = false, .sampling = true, .generator = false}, renderer,
            {.relative_error = 1e-6}, {});
        REQUIRE(choice.trials.size() == 2);
        const double ratio = choice.trials[1].seconds_to_error / choice.trials[0].seconds_to_error;
        // Two of 32 columns have nearly all the noise, and their neighbours get some samples too: an eighth or so.
        CHECK(ratio == doctest::Approx(0.14 * (0.25 + 0.75 * slowness)).epsilon(0.3));
        CHECK(choice.chosen == (slowness == 1.0 ? 1 : 0));
        CHECK((choice.settings.sampling == Sampling::adaptive) == (choice.chosen == 1));
        // The job is the chosen one: it renders lists or does not.
        const std::vector<std::uint32_t> pixels{1};
        if (choice.chosen == 1)
            CHECK(choice.job->render_pixels({0, 1}, pixels).estimate.count() == 1);
        else
            CHECK_THROWS_AS((void)choice.job->render_pixels({0, 1}, pixels), UnsupportedError);
    }
}

}  // namespace
}  // namespace tandem
