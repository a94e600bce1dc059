// What `tandem cost` finds and says.
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/deadline.h"
#include "tests/common/known_cost.h"

namespace tandem {
namespace {

using namespace known_cost;

TEST_CASE("cost: noise alone falls as the root of the samples, and its size, price and time to an error are right") {
    const CostReport report = measured(0.1);
    const ArmFigures& baseline = report.figures.front();
    REQUIRE(baseline.slope.has_value());
    CHECK(holds(*baseline.slope, -0.5));
    CHECK(baseline.slope->high - baseline.slope->low < 0.1);
    CHECK_FALSE(baseline.has_floor);
    CHECK(holds(baseline.squared_bias, 0.0));
    REQUIRE(baseline.efficiency.has_value());
    const double variance = 1.0 / (level * level);
    CHECK(holds(*baseline.efficiency, 1.0 / (variance * seconds_a_sample)));
    for (const CostPoint& point : baseline.points) {
        const double n = static_cast<double>(point.samples);
        CHECK(point.rmse.value == doctest::Approx(std::sqrt(variance / n)).epsilon(0.1));
        CHECK(point.seconds.value == doctest::Approx(seconds_a_sample * n));
        CHECK(point.relmse == doctest::Approx(1.0 / (level * level + 0.01) / n).epsilon(0.2));
    }
    for (const double error : {0.05, 0.01, 1e-4}) {
        CAPTURE(error);
        const TimeToError time = baseline.time_to(error);
        REQUIRE(time.seconds.has_value());
        CHECK(holds(*time.samples_interval, variance / (error * error)));
        CHECK(holds(*time.seconds, seconds_a_sample * variance / (error * error)));
        CHECK(time.extrapolated == (baseline.points.back().rmse.value > error));
    }
    CHECK_FALSE(baseline.time_to(0.05).extrapolated);
    CHECK(baseline.time_to(1e-4).extrapolated);
}

TEST_CASE("cost: the start of a render is no sample's time, so that a forecast from few samples holds") {
    static constexpr double start = 0.02, error = 0.005;
    int looks = 0;
    CostRequest request = request_for(0.0);
    request.seconds = 12.0;
    request.make = [](const BackendOptions& options) { return std::make_unique<KnownRenderer>(options, 0.0, start); };
    const CostReport report = run_cost(Scene{}, request, control_of(looks));
    const ArmFigures& slower = arm(report, "precision double");
    REQUIRE(slower.points.back().samples < samples_per_block);
    const TimeToError time = slower.time_to(error);
    REQUIRE(time.extrapolated);
    const double samples = 1.0 / (level * level * error * error);
    CHECK(holds(*time.seconds, start + 3.0 * seconds_a_sample * samples));
}

TEST_CASE("cost: a forecast's interval holds nineteen of twenty renders, not their median alone") {
    static constexpr double sway = 0.3, error = 0.002;
    int looks = 0;
    CostRequest request = request_for(0.0);
    request.seconds = 12.0;
    request.make = [](const BackendOptions& options) {
        return std::make_unique<KnownRenderer>(options, 0.0, 0.0, sway);
    };
    const CostReport report = run_cost(Scene{}, request, control_of(looks));
    const TimeToError time = report.figures.front().time_to(error);
    REQUIRE(time.extrapolated);
    const double seconds = seconds_a_sample / (level * level * error * error);
    CHECK(holds(*time.seconds, seconds * std::exp(0.9 * sway)));
    CHECK(holds(*time.seconds, seconds * std::exp(-0.9 * sway)));
    CHECK(time.seconds->high / time.seconds->low < std::exp(4.0 * sway));
}

TEST_CASE("cost: a bias is a floor of its size, which no time gets below") {
    const double bias = 0.2;
    const CostReport report = measured(bias);
    const ArmFigures& biased = arm(report, "integrator whitted");
    CHECK(biased.has_floor);
    CHECK(holds(biased.squared_bias, bias * bias / (level * level)));
    CHECK(biased.bias_floor().value == doctest::Approx(bias / level).epsilon(0.1));
    CHECK_FALSE(biased.time_to(0.01).seconds.has_value());
    CHECK(biased.time_to(0.1).seconds.has_value());
    CHECK(biased.slope->low > -0.5);  // it bends where the floor is near
}

TEST_CASE("cost: what is faster, slower and refused is said, and the fastest is recommended") {
    const CostReport report = measured(0.2);
    const ArmFigures &sooner = arm(report, "integrator next-event"), &slower = arm(report, "precision double");
    // A quarter of the variance at twice the time; thrice the time for nothing.
    CHECK(sooner.cost_differs);
    CHECK(sooner.cost_ratio.value == doctest::Approx(0.5).epsilon(0.1));
    CHECK(sooner.time_ratio.value == doctest::Approx(2.0));
    CHECK(slower.cost_differs);
    CHECK(slower.cost_ratio.value == doctest::Approx(3.0).epsilon(0.1));
    CHECK(sooner.pareto);
    CHECK_FALSE(slower.pareto);
    CHECK(soonest(report.figures, 0.01) == &sooner);
    CHECK(recommendations(report).at(1).find("--integrator next-event --samples") != std::string::npos);
    bool refused = false;
    for (const SkippedArm& skipped : report.skipped)
        refused = refused || (skipped.setting == "bidirectional" && skipped.reason == "no bidirectional paths here");
    CHECK(refused);
    const nlohmann::json json = to_json(report);
    for (const char* key : {"scene", "backend", "device", "reference", "arms", "recommendations"})
        CHECK(json.contains(key));
    for (const char* key : {"knob", "setting", "points", "bias_floor", "bias_floor_low", "bias_floor_high",
             "efficiency", "slope", "slope_low", "slope_high", "seconds_to_one_percent", "pareto"})
        for (const nlohmann::json& one : json.at("arms")) CHECK(one.contains(key));
    CHECK(json.at("reference").at("samples").get<std::uint64_t>() == report.reference.samples);
}

const Confirmation& confirmed_at(const CostReport& report, double error) {
    for (const Confirmation& one : report.confirmations)
        if (one.relative_error == error) return one;
    FAIL("not confirmed at " << error);
    return report.confirmations.front();
}

TEST_CASE("cost: what is recommended is measured anew against its rivals, in rounds that had no part in the choice") {
    CostRequest request = request_for(0.2);
    request.seconds = 60.0;
    int looks = 0;
    const CostReport report = run_cost(Scene{}, request, control_of(looks));
    REQUIRE(report.confirmations.size() >= 2);
    const Confirmation& confirmation = confirmed_at(report, 0.01);
    CHECK(confirmation.first == "integrator next-event");
    CHECK(confirmation.recommended == confirmation.first);
    CHECK(confirmation.outcome == Confirmed::shown);
    CHECK(confirmation.rounds >= fewest_replicates);
    CHECK(holds(confirmation.seconds, 0.5 * seconds_a_sample / (level * level) / 1e-4));
    const auto slower = [&](const std::string& name) {
        const auto rival = std::ranges::find(confirmation.rivals, name, &Rival::name);
        REQUIRE(rival != confirmation.rivals.end());
        return rival->time_ratio;
    };
    CHECK(holds(slower("baseline"), 2.0));
    CHECK(holds(slower("precision double"), 6.0));
    const std::string fastest =
        "it is the fastest of what was measured: " + confirmation.rivals.front().name + " takes ";
    CHECK(recommendations(report).at(1).find(fastest) != std::string::npos);
    const nlohmann::json json = to_json(report).at("confirmations").at(1);
    CHECK(json.at("outcome") == "shown");
    CHECK(json.at("rivals").at(0).at("arm") == confirmation.rivals.front().name);
}

// As long as an arm is being chosen, next events seem to take an eighth of the time that they take afterwards.
class FlatteringRenderer : public KnownRenderer {
public:
    using KnownRenderer::KnownRenderer;
    std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
        struct FlatteringJob : RenderJob {
            std::unique_ptr<RenderJob> job;
            bool flatters = false;
            RenderResult render(SampleRange range, const RenderControl& control) override {
                RenderResult result = job->render(range, control);
                const bool chosen = range.begin >= first_replicate_of(first_goal_stage) << replicate_shift;
                if (flatters && chosen) result.seconds *= 8.0;
                return result;
            }
        };
        auto flattering = std::make_unique<FlatteringJob>();
        flattering->job = KnownRenderer::prepare(scene, settings);
        flattering->flatters = settings.integrator == Integrator::next_event;
        return flattering;
    }
};

TEST_CASE("cost: what was found soonest by luck is not recommended once it is measured anew") {
    CostRequest request = request_for(0.2);
    request.seconds = 60.0;
    request.make = [](const BackendOptions& options) { return std::make_unique<FlatteringRenderer>(options, 0.2); };
    int looks = 0;
    const CostReport report = run_cost(Scene{}, request, control_of(looks));
    const Confirmation& confirmation = confirmed_at(report, 0.01);
    CHECK(confirmation.outcome == Confirmed::refuted);
    CHECK(confirmation.first == "integrator next-event");
    CHECK(confirmation.recommended == "baseline");
    CHECK(holds(confirmation.rivals.front().time_ratio, 0.25));
    CHECK(recommended(report, 0.01) == &report.figures.front());
    const std::string sentence = recommendations(report).at(1);
    CHECK(sentence.find("--integrator") == std::string::npos);
    CHECK(sentence.find("faster than integrator next-event") != std::string::npos);
}

TEST_CASE("cost: arms that are alike are said to be alike") {
    CostRequest request = request_for(0.0);
    request.knobs = {"generator"};  // of which the renderer knows nothing
    request.seconds = 40.0;
    int looks = 0;
    const CostReport report = run_cost(Scene{}, request, control_of(looks));
    const Confirmation& confirmation = confirmed_at(report, 0.01);
    CHECK(confirmation.recommended == confirmation.first);
    CHECK(confirmation.outcome == Confirmed::open);
    for (const Rival& rival : confirmation.rivals) CHECK(holds(rival.time_ratio, 1.0));
    CHECK(recommendations(report).at(1).find("nothing is shown to be faster, but these may be: ") != std::string::npos);
}

TEST_CASE("cost: what is recommended to be typed has the options of the baseline, but for those that an arm changes") {
    CostPoint point;
    point.samples = 4;
    point.seconds = {1.0, 1.0, 1.0};
    CostReport report;
    report.scene_file = "scenes/scene.json";
    report.given = {{"--backend", "vulkan"}, {"--guard", "fixed-epsilon"}, {"--epsilon", "0.01"}};
    ArmFigures& arm = report.figures.emplace_back();
    arm.points.push_back(point);
    arm.variance = 0.25;
    const auto told = [&] { return recommendations(report).front(); };
    const std::string given = "`tandem render scenes/scene.json -o scene.exr --backend vulkan ";
    CHECK(told().find(given + "--guard fixed-epsilon --epsilon 0.01 --samples ") != std::string::npos);
    report.figures.front().arm.options = "--guard ulp";
    CHECK(told().find(given + "--guard ulp --samples ") != std::string::npos);
    // A shell takes each for one word.
    report.scene_file = "my scene's.json";
    report.given = {{"--device", "NVIDIA H200"}};
    CHECK(told().find(
              "`tandem render 'my scene'\\''s.json' -o 'my scene'\\''s.exr' --device 'NVIDIA H200' --guard ulp ") !=
          std::string::npos);
}

TEST_CASE("cost: a forecast warns of a bias that was not excluded, but not where there is none by design") {
    CostReport report = report_of({"baseline"});
    report.asked_error = 0.01;
    ArmFigures& arm = report.figures.front();
    arm.squared_bias = {0.0, 0.0, 0.02 * 0.02};
    const char* warning = "a bias as great is not excluded";
    CHECK(to_text(report).find(warning) != std::string::npos);
    arm.arm.settings.render.bounces = unlimited_bounces;
    CHECK(to_text(report).find(warning) == std::string::npos);
    arm.arm.keeps_estimate = false;
    CHECK(to_text(report).find(warning) != std::string::npos);
}

TEST_CASE("cost: no command is recommended that render refuses for its samples") {
    CostReport report = report_of({"baseline"});
    report.asked_error = 1e-9;
    CHECK(to_text(report).find("no render takes more than 1099511627776") != std::string::npos);
    CHECK(to_text(report).find("--samples") == std::string::npos);
    report.asked_error = 1e-5;
    CHECK(to_text(report).find("--samples 10000000000`") != std::string::npos);
    CHECK(to_text(report).find("Settings are measured to 5 %, 1 %, 0.3 % alone.") != std::string::npos);
    report.asked_error = 0.01;
    CHECK(to_text(report).find("give more --time.") != std::string::npos);
}

TEST_CASE("cost: samples that no figure can be trusted with are told, and noise that the baseline has not") {
    CostReport report = report_of({"baseline", "generator"});
    report.figures[1].time_ratio = {1.0, 0.9, 1.1};
    CHECK(to_text(report).find("not finite") == std::string::npos);
    CHECK(all_to_text(report).find(
              "generator: a sample takes 1.00 (0.90 to 1.10) times the baseline's time; the noise is "
              "down as soon as") != std::string::npos);
    report.figures[1].invalid = 3;
    report.figures[0].variance = 0.0;
    for (const std::string& text : {to_text(report), all_to_text(report)})
        CHECK(text.find("generator: 3 samples were negative or not finite") != std::string::npos);
    CHECK(all_to_text(report).find("times the baseline's time; there is noise, which the baseline has not") !=
          std::string::npos);
}

TEST_CASE("cost: an error that the reference's noise hides is met at the count that was measured, not before it") {
    ArmFigures arm;
    CostPoint& above = arm.points.emplace_back();
    above.samples = 1024;
    above.seconds = {1.0, 1.0, 1.0};
    above.rmse = {0.006, 0.005, 0.007};
    CostPoint& below = arm.points.emplace_back();
    below.samples = 2048;
    below.seconds = {2.0, 2.0, 2.0};
    below.rmse = {0.0, 0.0, 0.004};  // its square less the reference's is below 0
    arm.variance = 0.003 * 0.003;
    REQUIRE(arm.time_to(0.003).samples);
    CHECK(*arm.time_to(0.003).samples == 2048.0);
    CHECK_FALSE(arm.time_to(0.003).extrapolated);
    // The arm's own noise is greater, or the reference tells far less.
    arm.variance = 0.02 * 0.02;
    CHECK(arm.time_to(0.003).extrapolated);
    arm.log_half_of_variance = 4.0;  // it is not known to be
    CHECK_FALSE(arm.time_to(0.003).extrapolated);
    below.rmse.high = 0.0061;
    CHECK(arm.time_to(0.003).extrapolated);
    CHECK_FALSE(arm.time_to(0.0031).extrapolated);
}

TEST_CASE("cost: what was not rendered beside the baseline is not given a ratio to its time") {
    CostReport report = report_of({"baseline", "mix"});
    for (ArmFigures& arm : report.figures)
        for (const double error : cost_errors) arm.times.push_back(arm.time_to(error));
    report.figures.back().time_ratio = {1.0, 0.0, std::numeric_limits<double>::infinity()};
    CHECK(recommendations(report).back() ==
          "mix: it was not rendered beside the baseline, so their times are not compared.");
    CHECK(all_to_text(report).find("1.00x") == all_to_text(report).rfind("1.00x"));  // the baseline's own
}

TEST_CASE("cost: errors of 100 % and more foretell nothing, and a forecast is called one") {
    CostPoint point;
    point.samples = 4;
    point.seconds = {1.0, 1.0, 1.0};
    point.rmse = {1.4, 1.2, 1.6};
    CostReport report;
    ArmFigures& arm = report.figures.emplace_back();
    arm.points.push_back(point);
    arm.variance = 1.96;
    CHECK(arm.time_to(0.01).unknown);
    CHECK_FALSE(arm.time_to(2.0).unknown);  // it was there
    CHECK(recommendations(report).at(1).starts_with("To 1 %: not known, as errors of 100 % and more"));
    arm.points.front().rmse.value = 0.9;
    CHECK_FALSE(arm.time_to(0.01).unknown);
    CHECK(recommendations(report).at(1).find("forecast. It was not measured anew; give more --time.") !=
          std::string::npos);
    Confirmation confirmation;
    confirmation.relative_error = 0.01;
    confirmation.first = confirmation.recommended = arm.arm.name();
    confirmation.outcome = Confirmed::shown;
    confirmation.seconds = {1140.0, 1000.0, 1300.0};
    confirmation.rounds = 4;
    confirmation.rivals = {{"another", {2.0, 1.5, 2.5}}};
    confirmation.forecast = true;
    report.confirmations = {confirmation};
    CHECK(recommendations(report).at(1).find("By a forecast from 4 rounds it would take 19 min") != std::string::npos);
    CHECK(recommendations(report).at(1).find("fastest of what was measured") != std::string::npos);
    report.confirmations.front().forecast = false;
    CHECK(recommendations(report).at(1).find("Measured anew in 4 rounds it takes 19 min") != std::string::npos);
}

TEST_CASE("cost: a forecast that had no second measurement gives way to a measured baseline, not to a forecast") {
    CostReport report = report_of({"baseline", "sampling"});
    ArmFigures &baseline = report.figures.front(), &found = report.figures.back();
    found.points.front().seconds = {0.5, 0.5, 0.5};  // 1250 s to 1 %, the baseline 2500 s, both by forecasts
    found.cost_differs = true;
    REQUIRE(soonest(report.figures, 0.01) == &found);
    CHECK(recommended(report, 0.01) == &found);
    const std::string sentence = recommendations(report).at(1);
    CHECK(sentence.find("21 min (21 min to 21 min), forecast") != std::string::npos);
    CHECK(sentence.ends_with("It was not measured anew; give more --time."));
    CostPoint reached = baseline.points.front();
    reached.samples = 10000;
    reached.seconds = {2500.0, 2500.0, 2500.0};
    reached.rmse = {0.01, 0.01, 0.01};
    baseline.points.push_back(reached);
    baseline.variance = 1e-4;
    CHECK(recommended(report, 0.01) == &baseline);
    CHECK(recommendations(report).at(1).find("sampling may be sooner: 21 min") != std::string::npos);
    found.variance = 0.0;  // what has no noise had no luck
    CHECK(recommended(report, 0.01) == &found);
}

TEST_CASE("cost: what was measured to the error is recommended before a forecast that had no second measurement") {
    CostReport report = report_of({"baseline", "sampling", "generator"});
    for (ArmFigures& arm : report.figures) arm.cost_differs = true;
    report.figures[1].points.front().seconds = {0.5, 0.5, 0.5};  // 1250 s to 1 %, by a forecast
    CostPoint reached = report.figures[2].points.front();
    reached.samples = 8000;
    reached.seconds = {2000.0, 2000.0, 2000.0};
    reached.rmse = {0.01, 0.01, 0.01};
    report.figures[2].points.push_back(reached);
    report.figures[2].variance = 1e-4;
    REQUIRE(soonest(report.figures, 0.01) == &report.figures[1]);
    CHECK(soonest(report.figures, 0.01, false) == &report.figures[2]);
    CHECK(recommended(report, 0.01) == &report.figures[2]);
    const std::string sentence = recommendations(report).at(1);
    CHECK(sentence.find("33 min, measured") != std::string::npos);
    CHECK(sentence.find("sampling may be sooner: 21 min (21 min to 21 min), forecast") != std::string::npos);
}

// Arms whose image of 16 samples has an error of 4 %, in so many seconds, times or over a fifth.
CostReport known_times(const std::vector<std::pair<const char*, double>>& arms) {
    CostReport report;
    for (const auto& [knob, seconds] : arms) {
        ArmFigures& arm = report.figures.emplace_back();
        arm.arm.knob = knob;
        CostPoint point;
        point.samples = 16;
        point.seconds = {seconds, seconds / 1.2, seconds * 1.2};
        point.rmse = {0.04, 0.04, 0.04};
        arm.points.push_back(point);
        arm.variance = 0.04 * 0.04;
    }
    return report;
}

TEST_CASE("cost: which arm is soonest does not depend on the order of the arms") {
    for (const bool swapped : {false, true}) {
        CAPTURE(swapped);
        CostReport report = swapped ? known_times({{"baseline", 10.0}, {"filter", 9.0}, {"mis", 9.5}})
                                    : known_times({{"baseline", 10.0}, {"mis", 9.5}, {"filter", 9.0}});
        const auto named = [&](const char* knob) {
            return &*std::ranges::find(report.figures, knob, [](const ArmFigures& arm) { return arm.arm.knob; });
        };
        CHECK(soonest(report.figures, 0.05) == &report.figures.front());  // neither is significantly sooner
        named("mis")->cost_differs = true;
        CHECK(soonest(report.figures, 0.05) == named("mis"));
        // Significantly sooner by its time, as where the baseline has a floor near the error.
        named("filter")->points.front().seconds = {6.0, 5.0, 7.0};
        CHECK(soonest(report.figures, 0.05) == named("filter"));
    }
}

TEST_CASE("cost: of what was not measured anew it is said what may be as fast") {
    const auto said = [](double seconds) {
        return recommendations(known_times({{"baseline", 1.0}, {"filter", seconds}})).at(0);
    };
    CHECK(said(1.1).find("filter may be as fast; neither was measured anew.") != std::string::npos);
    CHECK(said(10.0).find("Nothing that may be as fast was measured to this error.") != std::string::npos);
}

TEST_CASE("cost: where a floor may be as high as the error, nothing is known of how much longer rivals take") {
    const std::vector<CostArm> arms{
        {"baseline", "", "", {}, true}, {"generator", "hash", "--generator hash", {}, true}};
    CostReport report;
    report.reference = {"", "", 1 << 20, 1.0, {4.0, 4.0, 4.0}, {0.0, 0.0, 0.0}, {1e-9, 1e-9, 1e-9}};
    CostSamples samples{"", report.reference, {}, 1.0};
    for (const CostArm& arm : arms) {
        ArmTrials& trials = samples.arms.emplace_back();
        trials.name = arm.name();
        trials.samples = {16, 32, 64};
        trials.sum = {0.1, -0.1, 0.1};
        trials.sum_of_squares = {0.04, 0.04, 0.04};
        for (std::uint64_t round = 0; round < 8; ++round) {
            const double noise = 1.0 + 0.01 * static_cast<double>(round % 3);
            trials.replicates.push_back({round, {0.016 * noise, 0.032 * noise, 0.064 * noise},
                {0.02 * noise, 0.01 * noise, 0.005 * noise}, {1e-3, 5e-4, 2.5e-4}, 0.32 * noise});
        }
    }
    report.figures = analyse_cost(arms, samples);
    REQUIRE(report.figures.size() == 2);
    for (ArmFigures& figures : report.figures) {
        figures.has_floor = true;
        figures.squared_bias = {1e-6, 0.0, 1.0};
    }
    const auto found = confirm_at(0.01, report.figures, analyse_cost(arms, samples), samples);
    REQUIRE(found.has_value());
    report.confirmations = {*found};
    const Confirmation& confirmation = report.confirmations.front();
    REQUIRE(confirmation.rivals.size() == 1);
    CHECK(confirmation.outcome == Confirmed::open);
    CHECK(confirmation.rivals.front().time_ratio.low == 0.0);
    CHECK(std::isinf(confirmation.rivals.front().time_ratio.high));
    const std::string sentence = recommendations(report).at(1);
    CHECK(sentence.find(" to any time)") != std::string::npos);
    CHECK(sentence.find("these may be: " + confirmation.rivals.front().name + " (") != std::string::npos);
}

TEST_CASE("cost: adaptive sampling is measured where it has samples to share out, and else said not to be") {
    for (const double seconds : {0.5, 60.0}) {
        CAPTURE(seconds);
        CostRequest request = request_for(0.0);
        request.knobs = {"sampling"};
        request.seconds = seconds;
        int looks = 0;
        const CostReport report = run_cost(Scene{}, request, control_of(looks));
        std::size_t measured = 0;
        for (const ArmFigures& figures : report.figures) {
            if (figures.arm.name() != "sampling adaptive") continue;
            ++measured;
            CHECK(figures.points.back().samples > least_alike);
        }
        const auto told = std::ranges::count_if(report.skipped, [](const SkippedArm& arm) {
            return arm.setting == "adaptive" && arm.reason.find("adaptive sampling is uniform") != std::string::npos;
        });
        CHECK(measured == (seconds > 6.0 ? 1 : 0));
        CHECK(told == (seconds > 6.0 ? 0 : 1));
    }
}

TEST_CASE("cost: kernels that take long to be made leave time for measuring, and the arms left out are told") {
    int looks = 0;
    double made = 0.0;
    CostRequest request = request_for(0.0);
    request.make = [&](const BackendOptions& options) {
        struct Slow : KnownRenderer {
            Slow(const BackendOptions& options, double& made) : KnownRenderer(options, 0.0), made_(made) {}
            std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
                made_ += 5.0;
                return KnownRenderer::prepare(scene, settings);
            }
            double& made_;
        };
        return std::make_unique<Slow>(options, made);
    };
    request.make_reference = request.make;
    request.seconds = 30.0;
    CostControl control;
    control.now = [&] { return made + 0.1 * looks++; };
    const CostReport report = run_cost(Scene{}, request, control);
    CHECK(report.figures.front().replicates >= fewest_replicates);
    const auto left_out = std::ranges::count_if(report.skipped, &SkippedArm::for_time);
    CHECK(left_out > 0);
    CHECK(report.figures.size() > 1);
    CHECK(report.seconds < 1.1 * request.seconds);
}

TEST_CASE("cost: a forecast of Sobol points reaches down to where their errors go on falling as measured") {
    ArmFigures arm;
    CostPoint point;
    point.samples = 64;
    point.seconds = {1.0, 1.0, 1.0};
    point.rmse = {0.1, 0.1, 0.1};
    arm.points.push_back(point);
    arm.variance = 0.01;
    const auto samples = [&] { return *arm.time_to(0.01).samples_interval; };
    const double independent = 64 * 100.0;  // a tenth of the error
    CHECK(samples().low == doctest::Approx(independent));
    arm.arm.settings.render.generator = Generator::sobol;
    CHECK(samples().value == doctest::Approx(independent));
    CHECK(samples().high == doctest::Approx(independent));
    CHECK(samples().low == doctest::Approx(640.0));  // as 1/n
    arm.slope = Estimated{-0.75, -0.8, -0.7};
    CHECK(samples().low == doctest::Approx(64.0 * std::pow(10.0, 1.0 / 0.8)));
    CHECK(arm.time_to(0.01).seconds->low == doctest::Approx(std::pow(10.0, 1.0 / 0.8)));
}

TEST_CASE("cost: a stop is told wherever it comes, and what was measured before it stays") {
    bool nothing = false, part = false, whole = false;
    for (int at = 1; at < 1200 && !whole; at += 29) {
        CAPTURE(at);
        int looks = 0, saves = 0;
        std::stop_source stop;
        CostControl control;
        control.stop = stop.get_token();
        control.save = [&](const CostSamples&) { ++saves; };
        control.now = [&] {
            if (looks == at) stop.request_stop();
            return 0.02 * looks++;
        };
        try {
            const CostReport report = run_cost(Scene{}, request_for(0.0), control);
            REQUIRE_FALSE(report.figures.empty());
            for (const ArmFigures& figures : report.figures) CHECK(figures.replicates >= fewest_replicates);
            const bool cut = !report.whole || std::ranges::any_of(report.skipped, &SkippedArm::for_time);
            (cut ? part : whole) = true;
            whole = whole && !stop.stop_requested();
        } catch (const StoppedError& stopped) {
            nothing = true;
            // What there is of its replicates is kept.
            CHECK((saves > 0) == (std::string(stopped.what()).find("before the baseline had") != std::string::npos));
        }
    }
    CHECK(nothing);
    CHECK(part);
    CHECK(whole);
}

}  // namespace
}  // namespace tandem
