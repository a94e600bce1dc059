// The arm `denoise` of `tandem cost`: errors where they were measured, no forecast, and no part in what is recommended.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/render/path_trace.h"
#include "tests/common/known_cost.h"

namespace tandem {
namespace {

using namespace known_cost;

// Stripes of `contrast` about the level, with noise of variance 1. All rays leave the scene, so that features tell
// nothing.
class StripedRenderer : public Renderer {
public:
    explicit StripedRenderer(double contrast, bool traces = true) : contrast_(contrast), traces_(traces) {}
    RendererInfo info() const override { return {"known", "no device", "no driver", "C++"}; }
    std::unique_ptr<RenderJob> prepare(const Scene&, const RenderSettings& settings) override {
        return std::make_unique<Job>(settings, contrast_, traces_);
    }

private:
    struct Job : SyntheticJob {
        Job(const RenderSettings& settings, double contrast, bool traces)
            : SyntheticJob(settings,
                  [=](std::uint32_t x, std::uint32_t, SampleRandom& random) {
                      const double value = level + random.triangular() + (x % 2 == 0 ? contrast : -contrast);
                      return Radiance{value, value, value};
                  }),
              traces_(traces) {}
        RenderResult render(SampleRange range, const RenderControl& control) override {
            RenderResult result = SyntheticJob::render(range, control);
            result.seconds = seconds_a_sample * static_cast<double>(range.count());
            rendered_seconds() += result.seconds;
            return result;
        }
        std::vector<PathTrace> trace(std::uint32_t x, std::uint32_t y, SampleRange samples) override {
            if (!traces_) return RenderJob::trace(x, y, samples);
            PathTrace path;
            path.vertices.emplace_back().end = PathEnd::left_scene;
            return {samples.count(), path};
        }
        bool traces_;
    };
    double contrast_;
    bool traces_;
};

CostReport report_of(
    double contrast, bool traces = true, Generator generator = Generator::philox, double seconds = 20.0) {
    CostRequest request = request_for(0.0);
    request.knobs = {"denoise"};
    request.baseline.render.generator = generator;
    request.seconds = seconds;
    request.make = request.make_reference = [=](const BackendOptions&) {
        return std::make_unique<StripedRenderer>(contrast, traces);
    };
    int looks = 0;
    return run_cost(Scene{}, request, control_of(looks));
}

const CostPoint& point_at(const ArmFigures& arm, std::uint64_t samples) {
    const auto found = std::ranges::find(arm.points, samples, &CostPoint::samples);
    REQUIRE(found != arm.points.end());
    return *found;
}

TEST_CASE("cost: a denoised flat image has less noise at equal samples, and its time counts the filter") {
    const CostReport report = report_of(0.0);
    const ArmFigures& denoised = arm(report, "denoise on");
    const CostPoint &own = point_at(denoised, 16), &other = point_at(report.figures.front(), 16);
    CHECK(own.rmse.value < 0.4 * other.rmse.value);
    CHECK(own.seconds.value > other.seconds.value);
    CHECK(denoised.points.front().samples >= fewest_to_denoise);
}

TEST_CASE("cost: detail that the noise hides is told as the bias of denoising, apart from variance") {
    const double contrast = 0.04;
    const CostReport report =
        report_of(contrast, true, Generator::philox, 3.0);  // for up to 64 samples: noise of 0.125
    const ArmFigures& denoised = arm(report, "denoise on");
    CHECK(denoised.has_floor);
    CHECK(denoised.squared_bias.value > 0.0);
    CHECK(denoised.squared_bias.value <= contrast * contrast / (level * level));
    // Both together are the error, at the count that they are of.
    const double rmse = denoised.points.back().rmse.value;
    CHECK(denoised.squared_bias.value + denoised.variance == doctest::Approx(rmse * rmse).epsilon(0.1));
}

TEST_CASE("cost: denoising has no forecast, no efficiency, and is never what is recommended") {
    const CostReport report = report_of(0.04, true, Generator::philox, 3.0);
    const ArmFigures& denoised = arm(report, "denoise on");
    CHECK_FALSE(denoised.has_forecasts());
    CHECK_FALSE(denoised.efficiency);
    CHECK_FALSE(denoised.pareto);
    CHECK_FALSE(denoised.cost_differs);
    const double least = denoised.points.back().rmse.value;
    CHECK(denoised.time_to(1.01 * least).seconds);
    CHECK_FALSE(denoised.time_to(1.01 * least).extrapolated);
    CHECK_FALSE(denoised.time_to(0.1 * least).seconds);
    CHECK(denoised.time_to(0.1 * least).not_measured);
    for (const double error : {0.2, 0.05, 0.01, 0.003}) {
        CHECK_FALSE(denoised.is_safe_at(error));
        CHECK(soonest(report.figures, error) != &denoised);
        CHECK(recommended(report, error) != &denoised);
    }
    for (const Confirmation& one : report.confirmations) CHECK(one.recommended != "denoise on");
    CHECK(mixed_settings(report.figures).empty());
    const nlohmann::json json = to_json(report);
    CHECK(json.at("arms").at(1).at("cost_ratio").is_null());
    CHECK(json.at("arms").at(1).at("forecasts") == false);
    CHECK(json.at("arms").at(0).at("forecasts") == true);
    CHECK(to_text(report).find("then tandem denoise") != std::string::npos);
    CHECK(all_to_text(report).find("denoise on: at ") != std::string::npos);
}

TEST_CASE("cost: where features or variances cannot be had, denoising is refused with the reason") {
    const auto reason = [](const CostReport& report) {
        const auto found = std::ranges::find(report.skipped, "denoise", &SkippedArm::knob);
        return found == report.skipped.end() ? std::string() : found->reason;
    };
    CHECK(reason(report_of(0.0, false)) == "this renderer cannot follow a single path");
    CHECK(reason(report_of(0.0, true, Generator::sobol)).find("variance") != std::string::npos);
}

double seconds_by(clockid_t clock) {
    timespec time{};
    REQUIRE(clock_gettime(clock, &time) == 0);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

TEST_CASE("cost: on one thread nothing but that thread denoises") {
    StripedRenderer renderer(0.0);
    RenderSettings settings;
    settings.width = settings.height = 128;
    const Scene scene;
    const FilmMoments film = film_of(renderer.prepare(scene, settings)->render({0, 4}).estimate);
    FilmDenoiser denoiser(renderer, scene, settings, 1);
    const double all = seconds_by(CLOCK_PROCESS_CPUTIME_ID), own = seconds_by(CLOCK_THREAD_CPUTIME_ID);
    REQUIRE(denoiser.denoise(film, 0, [] { return 0.0; }, {}));
    const double took = seconds_by(CLOCK_THREAD_CPUTIME_ID) - own;
    CHECK(seconds_by(CLOCK_PROCESS_CPUTIME_ID) - all < 1.1 * took);
}

}  // namespace
}  // namespace tandem
