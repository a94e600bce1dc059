// Results of tandem bench: what is written is read back, two of them are compared, and the thesis's protocol is kept.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "common/error.h"
#include "common/experiment/compare_results.h"
#include "common/experiment/thesis.h"

using namespace tandem;

namespace {

std::vector<double> around(double centre, double relative) {
    std::vector<double> values;
    for (int i = 0; i < 20; ++i) values.push_back(centre * (1.0 + relative * ((i * 7 % 11) / 5.0 - 1.0)));
    return values;
}

BenchResults results_with(double plain, double other) {
    BenchResults results;
    results.device = {{"name", "synthetic"}};
    results.command = "tandem bench";
    results.git = "abc";
    results.scene = "box.json";
    results.empty_submissions = {1e-5, 2e-5};
    Family family;
    family.name = "f";
    family.along = "size";
    results.families = {texts_of(family)};
    ExperimentSamples samples;
    samples.family = "f";
    samples.clock = "total";
    samples.along = "size";
    samples.workload = {"one", {{"size", 1.0}}};
    samples.ended = "budget";
    samples.arms = {{"plain", "", Identity::identical, "", {{"total", around(plain, 0.002)}}},
        {"other", "text", Identity::identical, "", {{"total", around(other, 0.003)}}},
        {"absent", "", Identity::not_applicable, "one queue only", {}}};
    results.samples = {samples};
    return results;
}

// Frames of 2 ms and 3 ms a sample; fresh ones take one more, and two bounces a third of it all.
class InventedJob : public ThesisJob {
public:
    InventedJob(const ThesisSetup& setup, int& jobs) : setup_(setup) { ++jobs; }
    std::string frame_text() const override { return setup_.presented ? "in a window" : "in an image"; }
    std::string clock_text() const override { return "invented"; }
    double frame(std::uint32_t samples, bool fresh) override {
        const double seconds = 1e-3 * (2.0 + 3.0 * samples + (fresh ? 1.0 : 0.0) + (setup_.presented ? 0.5 : 0.0));
        return setup_.bounces == 2 ? seconds / 3.0 : seconds;
    }

private:
    ThesisSetup setup_;
};

}  // namespace

TEST_CASE("a replicate in which the device was slow does not make the baseline's time") {
    BenchResults results = results_with(0.0017, 0.0034);
    results.samples.resize(5, results.samples.front());
    ExperimentSamples& slow = results.samples.front();  // more blocks than all others, as the first replicate has
    for (ArmSamples& arm : slow.arms)
        for (auto& [clock, seconds] : arm.seconds) {
            for (double& value : seconds) value *= 3.0;
            const std::vector<double> once = seconds;
            for (int i = 0; i < 5; ++i) seconds.insert(seconds.end(), once.begin(), once.end());
        }
    const std::vector<ArmResult> arms = analyse(results.samples);
    CHECK(arms[0].seconds.at("total") == doctest::Approx(0.0017).epsilon(0.002));
    CHECK(arms[0].replicate_seconds.size() == 5);
    CHECK(arms[0].replicate_seconds.front() == doctest::Approx(0.0051).epsilon(0.002));
    CHECK(arms[1].ratio() == doctest::Approx(2.0).epsilon(0.002));  // formed within blocks
    CHECK(arms[1].verdict() == Change::slower);
    const nlohmann::json json = to_json(results, {});
    CHECK(json.at("arms").at(1).at("verdict") == "slower");
    CHECK(json.at("arms").at(0).at("replicate_milliseconds").size() == 5);
}

TEST_CASE("a verdict needs an interval that lies on one side, or within the margin") {
    CHECK(change_of(0.985, 1.015, 0.5) == Change::same);
    CHECK(change_of(0.985, 0.995, 0.001) == Change::same);  // significant, and negligible
    CHECK(change_of(0.90, 0.95, 0.001) == Change::faster);
    CHECK(change_of(1.05, 1.20, 0.001) == Change::slower);
    CHECK(change_of(1.05, 1.20, 0.06) == Change::ambiguous);  // by chance among so many
    CHECK(change_of(0.90, 1.10, 0.9) == Change::ambiguous);
}

TEST_CASE("the table has a row for each replicate and one for all, units in its header, and quotes what needs it") {
    BenchResults results = results_with(0.01, 0.02);
    results.samples.push_back(results.samples.front());
    for (ExperimentSamples& samples : results.samples) samples.arms[2].reason = "one \"queue\", no more";
    const std::string table = to_csv(results);
    CHECK(std::ranges::count(table, '\n') == 1 + 3 * 3);
    CHECK(table.starts_with(
        "family,workload,work unit,work [work unit],arm,baseline,clock,replicate,blocks [1],time a run [ms],"));
    const auto milliseconds_after = [&](const std::string& place) {
        const std::size_t at = table.find(place);
        REQUIRE(at != std::string::npos);
        return std::stod(table.substr(at + place.size()));
    };
    CHECK(milliseconds_after("f,one,size,1,other,plain,total,1,20,") == doctest::Approx(20.0).epsilon(0.003));
    CHECK(milliseconds_after("f,one,size,1,plain,plain,total,all,40,") == doctest::Approx(10.0).epsilon(0.002));
    CHECK(table.find(",slower,identical,\r\n") != std::string::npos);
    CHECK(table.find(",not-applicable,\"one \"\"queue\"\", no more\"\r\n") != std::string::npos);
    for (std::size_t begin = 0, end = 0; (end = table.find("\r\n", begin)) != std::string::npos; begin = end + 2) {
        const std::string_view row = std::string_view(table).substr(begin, end - begin);
        if (row.find('"') == std::string_view::npos) CHECK(std::ranges::count(row, ',') == 19);
    }
}

TEST_CASE("results are read back as they were written") {
    const BenchResults results = results_with(0.01, 0.02);
    const nlohmann::json json = to_json(results, {});
    const BenchResults again = results_from_json(json, "file.json");
    CHECK(to_json(again, {}).at("raw") == json.at("raw"));
    CHECK(to_json(again, {}).at("floor") == json.at("floor"));
    REQUIRE(again.samples.size() == 1);
    CHECK(again.samples[0].arms[1].seconds.at("total").size() == 20);
    CHECK(again.samples[0].arms[2].reason == "one queue only");
    const nlohmann::json& arm = json.at("arms").at(1);
    CHECK(arm.at("identical") == true);
    CHECK(arm.at("samples") == 20);
    CHECK(arm.at("ratio").get<double>() == doctest::Approx(2.0).epsilon(0.01));
    CHECK(arm.at("ratio_low") < arm.at("ratio"));
    CHECK(json.at("arms").at(2).at("identity") == "not-applicable");
    CHECK(!json.at("arms").at(2).contains("ratio"));
}

TEST_CASE("a figure that was changed in the file of results is refused, and results without a checksum are taken") {
    nlohmann::json json = to_json(results_with(0.01, 0.02), {});
    nlohmann::json& figure = json.at("raw").at(0).at("arms").at(1).at("milliseconds").at("total").at(3);
    figure = figure.get<double>() + 1.0;
    CHECK_THROWS_WITH_AS((void)results_from_json(json, "file.json"), doctest::Contains("/raw: is damaged"), InputError);
    json.erase("raw_checksum");
    CHECK(results_from_json(json, "file.json").samples.size() == 1);
}

TEST_CASE("a result that was stored without its raw readings is refused") {
    nlohmann::json json = to_json(results_with(0.01, 0.02), {});
    json["left_out"] = "raw readings that no page is computed from";
    CHECK_THROWS_WITH_AS(
        (void)results_from_json(json, "file.json"), doctest::Contains("/raw: lacks raw readings"), InputError);
}

TEST_CASE("what is no result is refused by name") {
    CHECK_THROWS_AS(static_cast<void>(results_from_json({{"version", 99}}, "old.json")), InputError);
    CHECK_THROWS_AS(static_cast<void>(results_from_json({{"version", results_version}}, "other.json")), InputError);
    CHECK_THROWS_AS(static_cast<void>(load_results("/nowhere/at/all.json")), InputError);
}

TEST_CASE("two results are the same, faster, slower or ambiguous") {
    const BenchResults before = results_with(0.01, 0.02);
    const auto changes = [&](double plain, double other) {
        const ResultsComparison comparison = compare_results(before, results_with(plain, other));
        REQUIRE(comparison.arms.size() == 2);
        return std::pair(comparison.arms[0].change, comparison.arms[1].change);
    };
    CHECK(changes(0.01, 0.02) == std::pair(Change::same, Change::same));
    CHECK(changes(0.011, 0.018) == std::pair(Change::slower, Change::faster));
    BenchResults noisy = results_with(0.01, 0.02);
    noisy.samples[0].arms[0].seconds["total"] = around(0.0102, 0.3);
    CHECK(compare_results(before, noisy).arms[0].change == Change::ambiguous);
    noisy.samples[0].workload.name = "two";
    CHECK(compare_results(before, noisy).arms.empty());
    CHECK(compare_results(before, noisy).only_in_one.size() == 4);
}

TEST_CASE("what replicates differ by is no change, and an arm that fails the gate in one of them is not compared") {
    const auto results_of = [](const std::vector<double>& luck) {
        BenchResults all = results_with(0.01, 0.02);
        all.samples.clear();
        for (const double factor : luck)
            all.samples.push_back(results_with(0.01 * factor, 0.02 * factor).samples.front());
        return all;
    };
    const BenchResults before = results_of({0.9, 1.0, 1.1, 1.0});
    for (const ChangeOfArm& arm : compare_results(before, results_of({1.0, 1.1, 1.2, 1.1})).arms)
        CHECK(arm.change == Change::ambiguous);
    for (const ChangeOfArm& arm : compare_results(before, results_of({1.8, 2.0, 2.2, 2.0})).arms)
        CHECK(arm.change == Change::slower);
    BenchResults wrong = before;
    wrong.samples[0].arms[1].identity = Identity::differs;
    REQUIRE(compare_results(before, wrong).arms.size() == 1);
    CHECK(compare_results(before, wrong).arms[0].arm == before.samples[0].arms[0].arm);
}

TEST_CASE("the thesis's method keeps its protocol") {
    int jobs = 0;
    BenchTarget target;
    target.thesis_job = [&](const ThesisSetup& setup) { return std::make_unique<InventedJob>(setup, jobs); };
    target.no_presentation = [](const ThesisSetup&) { return std::string("no display"); };
    const ThesisReport report = run_thesis(target, {});
    CHECK(report.protocol_size);
    REQUIRE(report.headless.cells.size() == 8);
    for (const ThesisCell& cell : report.headless.cells) {
        CHECK(cell.first.size() == 5);
        CHECK(cell.fresh.size() == 10);
        CHECK(cell.steady.size() == 60);
        CHECK(cell.fresh[0] == doctest::Approx(3.0 + 3.0 * cell.samples));
        CHECK(cell.steady[0] == doctest::Approx(2.0 + 3.0 * cell.samples));
        CHECK(cell.thesis_steady > 180.0);
    }
    CHECK(jobs == 1 + 8 * 5 + 2);  // the texts'; each first frame in a job of its own; sweep; two bounces
    REQUIRE(report.headless.sweep.size() == 12);
    REQUIRE(report.headless.two_bounces.size() == 3);
    CHECK(report.headless.two_bounces[2].samples == 50);
    CHECK(report.headless.two_bounces[2].milliseconds[0] == doctest::Approx(152.0 / 3.0));
    CHECK(!report.presented);
    CHECK(to_text(report).find("Not applicable here: no display") != std::string::npos);
    CHECK(to_json(report).at("not_presented") == "no display");
    ThesisOptions small;
    small.setup.width = 160;
    CHECK(!run_thesis(target, small).protocol_size);
    // With a window the whole protocol runs once more.
    target.no_presentation = [](const ThesisSetup&) { return std::string(); };
    const ThesisReport both = run_thesis(target, {});
    REQUIRE(both.presented);
    REQUIRE(both.presented->cells.size() == 8);
    CHECK(both.headless.cells[0].steady[0] == doctest::Approx(5.0));
    CHECK(both.presented->cells[0].steady[0] == doctest::Approx(5.5));
    CHECK(both.presented->sweep.size() == 12);
    CHECK(to_json(both).at("presented").at("frame") == "in a window");
}

TEST_CASE("a logarithm is fitted with intervals that hold it") {
    std::vector<ThesisSweepPoint> points;
    for (std::uint32_t n = 1; n <= 12; ++n) {
        ThesisSweepPoint point{n, {}, 0.0};
        // Deviations that sum to zero at each point.
        for (const double off : {-0.02, 0.02, 0.0}) point.milliseconds.push_back(n * (5.0 - 0.4 * std::log(n) + off));
        points.push_back(point);
    }
    const LogarithmicFit fit = fit_logarithm(points).value();
    CHECK(fit.a == doctest::Approx(5.0));
    CHECK(fit.b == doctest::Approx(-0.4));
    CHECK(fit.b_interval.low < -0.4);
    CHECK(fit.b_interval.high > -0.4);
    CHECK(fit.b_interval.high < -0.35);
    CHECK(fit.residual == doctest::Approx(0.0168).epsilon(0.05));
    points.resize(1);  // as a run has that was stopped: three frames of one number of samples
    CHECK(!fit_logarithm(points));
    points[0].milliseconds.resize(1);
    CHECK(!fit_logarithm(points));
    ThesisReport stopped;
    stopped.stopped = true;
    CHECK(to_json(stopped).at("fit").is_null());
    CHECK(to_text(stopped).find("fit:") == std::string::npos);
}
