// The schedule of `tandem cost`: which arms it renders until which error is measured.
#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/cost/confirm.h"
#include "common/cost/schedule.h"
#include "tests/common/known_cost.h"
#include "tests/temporary_folder.h"

namespace tandem {
namespace {

using namespace known_cost;

CostReport measured_for(double seconds, double bias) {
    CostRequest request = request_for(bias);
    request.seconds = seconds;
    int looks = 0;
    return run_cost(Scene{}, request, control_of(looks));
}

TEST_CASE("cost schedule: every asked error is reached and measured where there is time") {
    const CostReport report = measured_for(100.0, 0.2);
    const ArmFigures& fastest = arm(report, "integrator next-event");
    for (const double error : cost_errors) {
        CAPTURE(error);
        const TimeToError time = fastest.time_to(error);
        REQUIRE(time.seconds.has_value());
        CHECK_FALSE(time.extrapolated);
        CHECK(holds(*time.seconds, 0.5 * seconds_a_sample / (level * level) / (error * error)));
        const ArmFigures* best = recommended(report, error);
        REQUIRE(best != nullptr);
        // Sobol points are no better here, and mixes with them as good.
        CHECK(best->arm.name().find("next-event") != std::string::npos);
    }
    CHECK(fastest.points.back().rmse.value <= 0.003);
    const nlohmann::json json = to_json(report);
    for (const nlohmann::json& one : json.at("arms"))
        if (one.at("setting") == "next-event" && one.at("knob") == "integrator")
            for (const nlohmann::json& time : one.at("seconds_to")) CHECK(time.at("measured").get<bool>());
}

TEST_CASE("cost schedule: no replicate has many more samples than its error asks for") {
    for (const double wanted : {0.0, 1.0, 2.5, 63.0, 64.0, 65.0, 129.0, 1000.0, 1100.0, 1537.0, 1e6, 7e8}) {
        CAPTURE(wanted);
        const std::vector<std::uint64_t> levels = levels_up_to(wanted);
        const auto most = static_cast<double>(levels.back());
        CHECK(most >= wanted);
        CHECK(most <= std::max(1.0, 2.0 * wanted));
        if (wanted >= 4.0 * samples_per_block) CHECK(most <= 1.25 * wanted);
        for (std::size_t i = 1; i < levels.size(); ++i) {
            CHECK(levels[i] % samples_per_block == 0);  // goes on where the level before ended
            CHECK(2 * levels[i] >= 3 * levels[i - 1]);
        }
    }
    CHECK(levels_up_to(1e12).back() == std::uint64_t{1} << 30);
}

TEST_CASE("cost schedule: what there is no time to measure is called a forecast") {
    const CostReport report = measured_for(4.0, 0.2);
    const TimeToError time = arm(report, "integrator next-event").time_to(0.003);
    CHECK(time.extrapolated);
    CHECK(to_json(report).at("arms").at(0).at("seconds_to").at(2).at("measured") == false);
}

// Replicates of up to `most` samples, of a second each, whose squared error is `square` over their number.
void add_trials(CostSamples& samples, const CostArm& arm, std::uint32_t stage, std::uint64_t most, double square) {
    ArmTrials& trials = samples.arms.emplace_back();
    trials.name = arm.name();
    trials.stage = stage;
    trials.samples = {most / 4, most / 2, most};
    trials.sum = {0.01, -0.01, 0.01};
    trials.sum_of_squares = {0.0, 0.0, 0.0};
    for (std::uint64_t round = 0; round < fewest_replicates; ++round) {
        const double sway = 1.0 + 0.01 * static_cast<double>(round % 3), n = static_cast<double>(most);
        Replicate& replicate = trials.replicates.emplace_back();
        replicate.round = stage * fewest_replicates + round;
        replicate.sample_variance = square * sway;
        for (const double count : {n / 4.0, n / 2.0, n}) {
            replicate.seconds.push_back(count * sway);
            replicate.squared_errors.push_back(square * sway / count);
            replicate.relative_squared_errors.push_back(square * sway / count);
        }
    }
}

TEST_CASE("cost schedule: where an error is too far to be met, what may be soonest renders more samples") {
    const std::vector<CostArm> arms{{"baseline", "", "", {}, true}, {"generator", "hash", "--generator hash", {}, true},
        {"bounces", "32", "--bounces 32", {}, true}};
    const std::vector<double> squares{10.0, 2.5, 40.0};
    CostSamples samples;
    samples.reference = {"", "", 1 << 20, 1.0, {4.0, 4.0, 4.0}, {0.0, 0.0, 0.0}, {1e-9, 1e-9, 1e-9}};
    for (std::size_t i = 0; i < arms.size(); ++i) add_trials(samples, arms[i], short_stage, 4, squares[i]);
    const auto next = [&](double seconds) { return next_stage(analyse_cost(arms, samples), samples, seconds); };
    const auto samples_in = [&](const CostStage& stage, std::size_t i) -> std::uint64_t {
        const auto found = std::ranges::find(stage.arms, arms[i].name(), &CostStage::Arm::name);
        return found == stage.arms.end() ? 0 : found->samples.back();
    };
    const std::optional<CostStage> growth = next(560.0);
    REQUIRE(growth.has_value());
    CHECK(growth->stage == first_growth_stage);
    CHECK(samples_in(*growth, 0) == 16);
    CHECK(samples_in(*growth, 1) == 16);
    const std::optional<CostStage> less = next(200.0);  // of which four times the samples leave one arm
    REQUIRE(less.has_value());
    CHECK(less->stage == first_growth_stage);
    CHECK(samples_in(*less, 1) == 8);
    // 5 % take 63 samples of `hash`, and up to 2.3 times as many, as they are forecast. A quarter of 2400 s allows
    // them. All of 2040 s allows them, and those of a rival, where no share is kept for what comes later.
    CHECK(next(2400.0)->stage == goal_stage(0));
    const std::optional<CostStage> whole = next(2040.0);
    REQUIRE(whole.has_value());
    CHECK(whole->stage == goal_stage(0));
    CHECK(whole->arms.size() >= 2);

    for (std::size_t i = 0; i < arms.size(); ++i) add_trials(samples, arms[i], first_growth_stage, 16, squares[i]);
    const std::optional<CostStage> later = next(500.0);
    REQUIRE(later.has_value());
    CHECK(later->stage == first_growth_stage + 1);
    CHECK(samples_in(*later, 1) == 32);  // 64 take more than its share
    const auto is_shown = [&] {
        const std::vector<Confirmation> found = confirm(arms, samples);
        REQUIRE(found.size() == cost_errors.size());
        for (const Confirmation& one : found) {
            CHECK(one.recommended == arms[1].name());
            CHECK(one.outcome == Confirmed::shown);
            CHECK(one.forecast);
            REQUIRE(one.rivals.size() == 2);
            CHECK(holds(one.rivals[0].time_ratio, squares[0] / squares[1]));
            CHECK(holds(one.rivals[1].time_ratio, squares[2] / squares[1]));
        }
    };
    is_shown();
    // The next step leaves one out, which is compared by what was known of it; twice as slow a machine changes nothing.
    for (std::size_t i = 0; i < 2; ++i) {
        add_trials(samples, arms[i], first_growth_stage + 1, 32, squares[i]);
        for (Replicate& replicate : samples.arms.back().replicates)
            for (double& seconds : replicate.seconds) seconds *= 2.0;
    }
    is_shown();
    // One that did not render beside the best may be as fast.
    std::erase_if(samples.arms, [&](const ArmTrials& trials) { return trials.name == arms[2].name(); });
    add_trials(samples, arms[2], short_stage, 4, 1.001 * squares[1]);
    for (const Confirmation& one : confirm(arms, samples)) CHECK(one.outcome == Confirmed::open);
}

TEST_CASE(
    "cost schedule: an error that only one of two rivals has time for is measured once both rendered more samples") {
    const std::vector<CostArm> arms{
        {"baseline", "", "", {}, true}, {"generator", "hash", "--generator hash", {}, true}};
    CostSamples samples;
    samples.reference = {"", "", 1 << 20, 1.0, {4.0, 4.0, 4.0}, {0.0, 0.0, 0.0}, {1e-9, 1e-9, 1e-9}};
    const auto add = [&](std::uint32_t stage, std::uint64_t most) {
        add_trials(samples, arms[0], stage, most, 2.6);
        add_trials(samples, arms[1], stage, most, 2.5);
    };
    const auto next = [&](double seconds) { return next_stage(analyse_cost(arms, samples), samples, seconds); };
    add(short_stage, 16);
    CHECK(next(4000.0)->stage == goal_stage(0));  // time for both
    const double for_one = 700.0;                 // 5 % take 63 samples, in four replicates
    CHECK(next(for_one)->stage == first_growth_stage);
    add(first_growth_stage, 32);
    const std::optional<CostStage> alone = next(for_one);
    REQUIRE(alone.has_value());
    CHECK(alone->stage == goal_stage(0));
    REQUIRE(alone->arms.size() == 1);
    CHECK(alone->arms[0].name == arms[1].name());
    // A quarter of the time is for 5 %, but not at the price of a rival.
    for (double seconds = 1200.0; seconds <= 4000.0; seconds += 200.0) {
        CAPTURE(seconds);
        CHECK(next(seconds)->arms.size() == 2);
    }
}

TEST_CASE("cost schedule: what one setting shows of a bias goes for all that have its mean") {
    std::vector<CostArm> arms{{"baseline", "", "", {}, true}, {"bounces", "4", "--bounces 4", {}, false},
        {"mix", "bounces 4 + generator sobol", "--bounces 4 --generator sobol", {}, false}};
    for (std::size_t i = 1; i < arms.size(); ++i) arms[i].settings.render.bounces = 4;
    arms[2].settings.render.generator = Generator::sobol;
    CostSamples samples;
    samples.reference = {"", "", 1 << 20, 1.0, {4.0, 4.0, 4.0}, {0.0, 0.0, 0.0}, {1e-9, 1e-9, 1e-9}};
    for (const CostArm& arm : arms) add_trials(samples, arm, short_stage, 16, 2.5);
    std::vector<ArmFigures> figures = analyse_cost(arms, samples);
    const auto takes_part = [&](const CostArm& arm) {
        const std::optional<CostStage> stage = next_stage(figures, samples, 1e6);
        REQUIRE(stage.has_value());
        REQUIRE(stage->stage == goal_stage(0));  // 5 %
        return std::ranges::find(stage->arms, arm.name(), &CostStage::Arm::name) != stage->arms.end();
    };
    CHECK(takes_part(arms[1]));
    figures[2].has_floor = true;
    figures[2].squared_bias = {0.06 * 0.06, 0.055 * 0.055, 0.065 * 0.065};
    CHECK_FALSE(takes_part(arms[2]));
    CHECK_FALSE(takes_part(arms[1]));
    CHECK(takes_part(arms[0]));
    figures[2].squared_bias.low = 0.04 * 0.04;  // 5 % may be met
    CHECK(takes_part(arms[1]));
}

TEST_CASE("cost schedule: one mean have settings that differ in where samples are put, and no others") {
    const ArmSettings base;
    const auto has_mean_of_base = [&](const auto& change, double clamp = std::numeric_limits<double>::infinity()) {
        ArmSettings one = base, other = base;
        one.render.clamp = other.render.clamp = clamp;
        change(other);
        return have_one_mean(one, other);
    };
    const auto sobol = [](ArmSettings& arm) { arm.render.generator = Generator::sobol; };
    const auto adaptive = [](ArmSettings& arm) { arm.render.sampling = Sampling::adaptive; };
    const auto tree = [](ArmSettings& arm) { arm.render.light_sampling = LightSampling::tree; };
    const auto roulette = [](ArmSettings& arm) { arm.render.roulette_start = 1; };
    CHECK(has_mean_of_base(sobol));
    CHECK(has_mean_of_base(adaptive));
    CHECK(has_mean_of_base(tree));
    CHECK(has_mean_of_base(roulette));
    CHECK(has_mean_of_base(sobol, 4.0));
    CHECK_FALSE(has_mean_of_base(tree, 4.0));  // what is cut depends on how samples scatter
    CHECK_FALSE(has_mean_of_base(roulette, 4.0));
    CHECK_FALSE(has_mean_of_base([](ArmSettings& arm) { arm.render.bounces = 3; }));
    CHECK_FALSE(has_mean_of_base([](ArmSettings& arm) { arm.render.clamp = 4.0; }));
    CHECK_FALSE(has_mean_of_base([](ArmSettings& arm) { arm.render.filter = PixelFilter::tent; }));
    CHECK_FALSE(has_mean_of_base([](ArmSettings& arm) { arm.denoise = true; }));
}

TEST_CASE("cost schedule: four rounds tell less than a normal distribution would") {
    const std::vector<CostArm> arms{
        {"baseline", "", "", {}, true}, {"generator", "hash", "--generator hash", {}, true}};
    CostSamples samples;
    samples.reference = {"", "", 1 << 20, 1.0, {4.0, 4.0, 4.0}, {0.0, 0.0, 0.0}, {1e-9, 1e-9, 1e-9}};
    for (const CostArm& arm : arms) add_trials(samples, arm, short_stage, 64, 1.0);
    const auto differs = [&](const std::array<double, fewest_replicates>& logarithms) {
        CostSamples now = samples;
        for (std::size_t round = 0; round < fewest_replicates; ++round)
            for (double& seconds : now.arms[1].replicates[round].seconds) seconds *= std::exp(logarithms[round]);
        return analyse_cost(arms, now)[1].cost_differs;
    };
    // t = 3.9 with 3 degrees of freedom: p = 0.03, twice that after Holm. As a normal deviate p would be 0.0001.
    CHECK_FALSE(differs({0.02, 0.04, 0.06, 0.08}));
    CHECK(differs({0.05, 0.055, 0.06, 0.065}));
}

TEST_CASE("cost schedule: intervals of several rivals hold together, by Student's quantiles of their rounds") {
    std::vector<CostArm> arms;
    CostSamples samples;
    samples.reference = {"", "", 1 << 20, 1.0, {4.0, 4.0, 4.0}, {0.0, 0.0, 0.0}, {1e-9, 1e-9, 1e-9}};
    const auto log_width_with = [&](std::size_t rivals) {
        while (arms.size() <= rivals) {
            arms.push_back({"setting", std::to_string(arms.size()), "", {}, true});
            add_trials(samples, arms.back(), short_stage, 16, arms.size() == 1 ? 1.0 : 2.0);
            add_trials(samples, arms.back(), goal_stage(0), 512, arms.size() == 1 ? 1.0 : 2.0);
            for (Replicate& one : samples.arms.back().replicates)  // rounds scatter
                for (double& seconds : one.seconds)
                    if (arms.size() == 1) seconds *= std::exp(0.001 * static_cast<double>(one.round % 4));
        }
        const std::vector<Confirmation> found = confirm(arms, samples);
        REQUIRE_FALSE(found.empty());
        REQUIRE(found[0].rivals.size() == rivals);
        return std::log(found[0].rivals[0].time_ratio.high / found[0].rivals[0].time_ratio.low);
    };
    const double one = log_width_with(1);
    REQUIRE(one > 0.0);
    CHECK(log_width_with(3) / one == doctest::Approx(4.857 / 3.182).epsilon(1e-3));  // 3 degrees of freedom
}

TEST_CASE("cost schedule: a baseline that was left out as far behind is measured afterwards, and confirms nothing") {
    const std::vector<CostArm> arms{{"baseline", "", "", {}, true}, {"generator", "hash", "--generator hash", {}, true},
        {"bounces", "32", "--bounces 32", {}, true}};
    CostSamples samples;
    samples.reference = {"", "", 1 << 20, 1.0, {4.0, 4.0, 4.0}, {0.0, 0.0, 0.0}, {1e-9, 1e-9, 1e-9}};
    const std::vector<double> squares{5.0, 2.5, 2.6};
    for (std::size_t i = 0; i < arms.size(); ++i) add_trials(samples, arms[i], short_stage, 16, squares[i]);
    for (std::size_t i = 1; i < arms.size(); ++i) add_trials(samples, arms[i], goal_stage(0), 128, squares[i]);
    const auto next = [&](double seconds) { return next_stage(analyse_cost(arms, samples), samples, seconds); };
    const std::optional<CostStage> afterwards = next(3000.0);  // too little for 1 %
    REQUIRE(afterwards.has_value());
    CHECK(afterwards->stage == baseline_stage(0));
    REQUIRE(afterwards->arms.size() == 1);
    CHECK(afterwards->arms[0].name == "baseline");
    CHECK(afterwards->arms[0].samples.back() >= 125);
    CHECK(next(500.0)->purpose == "more replicates");
    const auto confirmed = [&] {
        const std::vector<Confirmation> found = confirm(arms, samples);
        REQUIRE_FALSE(found.empty());
        return std::pair(found[0].recommended, found[0].rounds);
    };
    const auto before = confirmed();
    add_trials(samples, arms[0], baseline_stage(0), afterwards->arms[0].samples.back(), squares[0]);
    CHECK(confirmed() == before);
    CHECK_FALSE(analyse_cost(arms, samples)[0].time_to(0.05).extrapolated);
    CHECK(next(3000.0)->purpose == "more replicates");
}

TEST_CASE("cost schedule: figures of arms without new replicates are taken as they were, and the others made anew") {
    const std::vector<CostArm> arms{
        {"baseline", "", "", {}, true}, {"generator", "hash", "--generator hash", {}, true}};
    CostSamples samples;
    samples.reference = {"", "", 1 << 20, 1.0, {4.0, 4.0, 4.0}, {0.0, 0.0, 0.0}, {1e-9, 1e-9, 1e-9}};
    for (const CostArm& arm : arms) add_trials(samples, arm, short_stage, 64, 1.0);
    KnownFigures known;
    CostReport report;
    const auto text = [&](const std::vector<ArmFigures>& figures) {
        report.figures = figures;
        report.reference = samples.reference;
        return to_json(report).dump();
    };
    for (const std::uint64_t most : {64, 256}) {
        if (most > 64) add_trials(samples, arms[1], first_growth_stage, most, 1.0);
        const std::string before = text(analyse_cost(arms, samples, {}, known));
        CHECK(before == text(analyse_cost(arms, samples)));
        CHECK(before == text(analyse_cost(arms, samples, {}, known)));
        CHECK(report.figures[1].points.back().samples == most);
    }
}

TEST_CASE("cost schedule: a planted bias is named with its interval, and other arms are bounded below 1 %") {
    const double bias = 0.2;
    const CostReport report = measured_for(60.0, bias);
    for (const ArmFigures& figures : report.figures) {
        CAPTURE(figures.arm.name());
        const bool planted = figures.arm.settings.render.integrator == Integrator::whitted;
        CHECK(figures.has_floor == planted);
        if (planted)
            CHECK(holds(figures.squared_bias, bias * bias / (level * level)));
        else
            CHECK(figures.bias_floor().high <= floor_bound);
    }
}

TEST_CASE("cost schedule: of much time the short stage takes no more than tells which arms may be soonest") {
    CostRequest request = request_for(0.2);
    int looks = 0;
    CostControl control = control_of(looks);
    double short_seconds = 0.0, all_seconds = 0.0;
    control.save = [&](const CostSamples& samples) {
        short_seconds = all_seconds = 0.0;
        for (const ArmTrials& trials : samples.arms)
            for (const Replicate& replicate : trials.replicates) {
                all_seconds += replicate.seconds.back();
                if (trials.stage == short_stage) short_seconds += replicate.seconds.back();
            }
    };
    request.seconds = 1000.0;
    const CostReport report = run_cost(Scene{}, request, control);
    CHECK(short_seconds <= most_short_seconds * static_cast<double>(report.figures.size()));
    CHECK(short_seconds <= 0.1 * all_seconds);  // the rest went to the errors
    CHECK_FALSE(arm(report, "integrator next-event").time_to(cost_errors.back()).extrapolated);
}

TEST_CASE("cost schedule: with time enough no arm is too slow for a short stage") {
    CostRequest request = request_for(0.2);
    request.make = [make = request.make](const BackendOptions& options) -> std::unique_ptr<Renderer> {
        struct Slow : Renderer {
            std::unique_ptr<Renderer> renderer;
            RendererInfo info() const override { return renderer->info(); }
            std::unique_ptr<RenderJob> prepare(const Scene& scene, const RenderSettings& settings) override {
                struct Job : RenderJob {
                    std::unique_ptr<RenderJob> job;
                    RenderResult render(SampleRange range, const RenderControl& control) override {
                        RenderResult result = job->render(range, control);
                        constexpr double factor = 2000.0;  // two seconds a sample
                        rendered_seconds() += (factor - 1.0) * result.seconds;
                        result.seconds *= factor;
                        return result;
                    }
                };
                auto job = std::make_unique<Job>();
                job->job = renderer->prepare(scene, settings);
                return job;
            }
        };
        auto slow = std::make_unique<Slow>();
        slow->renderer = make(options);
        return slow;
    };
    request.seconds = 7200.0;
    int looks = 0;
    const CostReport report = run_cost(Scene{}, request, control_of(looks));
    CHECK(report.figures.size() > 4);
    for (const SkippedArm& skipped : report.skipped) CHECK_FALSE(skipped.for_time);
}

TEST_CASE("cost schedule: a slow setting is not measured to an error that the best reaches many times over") {
    const CostReport report = measured_for(12.0, 0.2);
    const auto longest = [&](const std::string& name) { return arm(report, name).points.back().samples; };
    CHECK(longest("integrator next-event") > longest("precision double"));
}

TEST_CASE("cost schedule: a measurement continued in pieces reaches what no piece reaches alone") {
    CostRequest request = request_for(0.2);
    request.seconds = 14.0;
    CostControl control;
    std::string saved;
    bool reached = false;
    for (int piece = 0; piece < 6; ++piece) {
        int looks = 0;
        control = control_of(looks);
        control.save = [&](const CostSamples& samples) { saved = to_bytes(samples); };
        const CostReport report = run_cost(Scene{}, request, control);
        const bool now = !arm(report, "integrator next-event").time_to(0.003).extrapolated;
        if (piece == 0) CHECK_FALSE(now);
        reached = reached || now;
        request.earlier = samples_from_bytes(saved, "saved");
    }
    CHECK(reached);
}

TEST_CASE(
    "cost schedule: a reference file is rendered alone, continued, used by another device, and refused elsewhere") {
    const TemporaryFolder folder;
    CostRequest request = request_for(0.1);
    request.reference_file = folder / "image.reference";
    int looks = 0;
    const CostReference part = render_reference_file(Scene{}, request, 1.0, control_of(looks));
    const CostReference whole = render_reference_file(Scene{}, request, 1.0, control_of(looks));
    CHECK(whole.samples > part.samples);
    CHECK(whole.relative_uncertainty() < 0.03);
    // Another device: its renderer says so, and no reference is rendered there.
    request.make_reference = [](const BackendOptions&) -> std::unique_ptr<Renderer> {
        throw UnsupportedError("no reference is rendered here");
    };
    const CostReport report = run_cost(Scene{}, request, control_of(looks));
    CHECK(report.reference.samples == whole.samples);
    CHECK(to_json(report).at("reference").at("made_by") == "known, no device, no driver");
    request.baseline.render.width = 8;
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, control_of(looks)), InputError);
    request = request_for(0.1);
    request.reference_file = folder / "image.reference";
    request.scene_bytes = "another scene";
    CHECK_THROWS_AS((void)run_cost(Scene{}, request, control_of(looks)), InputError);
}

// Its lines, the head first.
std::vector<std::string> table_of(const std::string& text) {
    std::istringstream rest(text.substr(text.find("\n\n") + 2));
    std::vector<std::string> lines;
    for (std::string line; std::getline(rest, line) && !line.empty();) lines.push_back(line);
    return lines;
}

TEST_CASE("cost schedule: the table has at most ten rows, tells measured from forecast in words, and names bias") {
    CostRequest request = request_for(0.2);
    request.knobs = {};
    request.seconds = 30.0;
    int looks = 0;
    CostReport report = run_cost(Scene{}, request, control_of(looks));
    REQUIRE(report.figures.size() > most_rows);
    const std::string text = to_text(report);
    const std::vector<std::string> table = table_of(text);
    const std::size_t times = table.front().find("to 1 %");
    std::size_t rows = 0;
    for (std::size_t i = 1; i < table.size(); ++i) {
        CAPTURE(table[i]);
        REQUIRE(table[i].size() > times);
        const bool is_rest = table[i].find_first_not_of(' ') == times;  // of settings that do not fit before the times
        if (!is_rest) ++rows;
        if (is_rest)
            CHECK(table[i - 1].size() >= times);
        else if (i + 1 == table.size() || table[i + 1].find_first_not_of(' ') != times)
            CHECK((table[i][times - 1] == ' ' && table[i][times] != ' '));
    }
    CHECK(rows <= most_rows);
    CHECK(text.find(", measured") != std::string::npos);
    CHECK(text.find("tandem render") != std::string::npos);
    report.asked_error = 1e-4;
    CHECK(to_text(report).find("), forecast") != std::string::npos);
    CHECK(to_text(report).find("settings                ") != std::string::npos);
    report.asked_knobs = {"bounces"};  // their settings stand there, whatever they cost
    for (const ArmFigures& figures : report.figures) {
        CAPTURE(figures.arm.options);
        if (figures.arm.knob == "bounces")
            CHECK(to_text(report).find("\n" + figures.arm.options + " ") != std::string::npos);
    }
}

}  // namespace
}  // namespace tandem
