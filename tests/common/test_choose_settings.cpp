// What a short trial chooses for a target error, where the costs are known.
#include <doctest/doctest.h>

#include "common/cost/choose_settings.h"
#include "common/error.h"
#include "tests/common/synthetic_renderer.h"

namespace tandem {
namespace {

// Next events have `ratio` times the variance of paths at the same time; roulette is ten times slower.
class TrialRenderer : public Renderer {
public:
    explicit TrialRenderer(double ratio) : ratio_(ratio) {}
    RendererInfo info() const override { return {"trial", "no device", "no driver", "C++"}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        if (settings.roulette_start == 4) throw UnsupportedError("no roulette from 4 here");
        struct Job : SyntheticJob {
            using SyntheticJob::SyntheticJob;
            double factor = 1.0;
            RenderResult render(SampleRange range, const RenderControl& control) override {
                RenderResult result = SyntheticJob::render(range, control);
                result.seconds *= factor;
                return result;
            }
        };
        const double scale = settings.integrator == Integrator::next_event ? std::sqrt(ratio_) : 1.0;
        auto job = std::make_unique<Job>(settings, [scale](std::uint32_t, std::uint32_t, SampleRandom& random) {
            const double value = 5.0 + scale * random.triangular();
            return Radiance{value, value, value};
        });
        if (settings.roulette_start != no_roulette) job->factor = 10.0;
        return job;
    }

private:
    double ratio_;
};

SettingsChoice chosen(double ratio, const OpenSettings& open, const Scene& scene = {}) {
    TrialRenderer renderer(ratio);
    RenderSettings settings;
    settings.width = settings.height = 16;
    return choose_settings(scene, settings, open, renderer, 1.0, {});
}

TEST_CASE("the settings of least variance times time are chosen, and the job is theirs") {
    const SettingsChoice choice = chosen(0.25, {});
    CHECK(choice.settings.integrator == Integrator::next_event);
    CHECK(choice.settings.roulette_start == no_roulette);
    CHECK(choice.trials.at(choice.chosen).options == "--integrator next-event");
    CHECK(choice.trials.at(choice.chosen).cost == doctest::Approx(0.25 * choice.trials.front().cost).epsilon(0.1));
    CHECK(choice.trials.size() == 5);  // with roulette from 1, and without that from 4; adaptive sampling of the best
    const double variance = variance_of(choice.job->render({0, 4096}).estimate).front();
    CHECK(variance == doctest::Approx(0.25).epsilon(0.2));
}

TEST_CASE(
    "the given settings stay where nothing is clearly better, where they are fixed, and where images would differ") {
    CHECK(chosen(0.97, {}).chosen == 0);
    CHECK(chosen(4.0, {}).chosen == 0);
    const SettingsChoice fixed = chosen(0.25, {.integrator = false, .roulette = true});
    CHECK(fixed.settings.integrator == Integrator::path);
    Scene with_lamp;
    with_lamp.lights.emplace_back();
    CHECK(chosen(0.25, {}, with_lamp).settings.integrator == Integrator::path);
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
        RenderSettings settings;
        settings.width = settings.height = 32;
        const SettingsChoice choice = choose_settings(
            Scene{}, settings, {.integrator = false, .roulette = false, .sampling = true}, renderer, 1.0, {});
        REQUIRE(choice.trials.size() == 2);
        const double ratio = choice.trials[1].cost / choice.trials[0].cost;
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
