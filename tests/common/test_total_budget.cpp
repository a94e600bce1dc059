// Many scenes in one budget: what each is foretold to need, and who gets how many seconds.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "common/validation/verify/total_budget.h"

using namespace tandem;

namespace {

LevelResult level_known_to(const std::string& name, double bound) {
    LevelResult level;
    level.name = name;
    RegionComparison region;
    region.relative_low = -bound;
    region.relative_high = bound;
    level.regions.push_back(region);
    level.worst = region;
    return level;
}

// After so many seconds the image is known to `image`, and each tile to `tile`.
SceneVerdict verdict_known_to(double image, double tile, double seconds, Verdict verdict = Verdict::undecided) {
    SceneVerdict result;
    result.verdict = verdict;
    result.judgement.levels = {level_known_to("image", image), level_known_to("tiles 16x16", tile)};
    result.looks.push_back({});
    result.looks.back().seconds = seconds;
    result.seconds = seconds;
    return result;
}

// Scenes that need so many seconds each; time passes where they are rendered alone.
struct Machine {
    std::vector<double> needs;
    double now = 0.0;
    std::map<std::size_t, std::vector<double>> given{};

    TotalBudget budget(double seconds) {
        TotalBudget result;
        result.scenes = needs.size();
        result.seconds = seconds;
        result.elapsed = [this] { return now; };
        result.verify = [this](std::size_t scene, double share, std::size_t) {
            given[scene].push_back(share);
            const double used = std::min(share, needs[scene]);
            now += used;
            const double bound = 0.005 * std::sqrt(needs[scene] / used);
            return verdict_known_to(bound, 0.01, used, used < needs[scene] ? Verdict::undecided : Verdict::agree);
        };
        return result;
    }
    [[nodiscard]] std::vector<Verdict> run(double seconds) {
        std::vector<std::optional<SceneVerdict>> last;
        verify_within(budget(seconds), last);
        std::vector<Verdict> verdicts;
        for (const auto& one : last) verdicts.push_back(one ? one->verdict : Verdict::undecided);
        return verdicts;
    }
    [[nodiscard]] static std::size_t decided(const std::vector<Verdict>& verdicts) {
        return static_cast<std::size_t>(std::ranges::count(verdicts, Verdict::agree));
    }
};

}  // namespace

TEST_CASE("Twice the margin needs four times the seconds, and what is furthest from its margin counts") {
    const double look = 18.0;  // a tenth of a budget is for what comes after looks
    CHECK(forecast_seconds(verdict_known_to(0.005, 0.01, look)).value() == doctest::Approx(20.0));
    CHECK(forecast_seconds(verdict_known_to(0.010, 0.01, look)).value() == doctest::Approx(80.0));
    CHECK(forecast_seconds(verdict_known_to(0.010, 0.30, look)).value() == doctest::Approx(180.0));
}

TEST_CASE("A closed form that is not met yet counts in the forecast") {
    SceneVerdict verdict = verdict_known_to(0.005, 0.01, 9.0);
    verdict.judgement.levels.push_back(level_known_to(closed_form_reference_level, 0.02));
    CHECK(forecast_seconds(verdict).value() == doctest::Approx(160.0));
}

TEST_CASE("There is no forecast for what is decided, black or was not looked at") {
    CHECK(!forecast_seconds(verdict_known_to(0.004, 0.01, 9.0, Verdict::agree)));
    SceneVerdict black = verdict_known_to(0.01, 0.01, 9.0);
    black.judgement.black = true;
    CHECK(!forecast_seconds(black));
    CHECK(!forecast_seconds(SceneVerdict()));
}

TEST_CASE("Scenes that are soon decided leave their time to those that need more") {
    Machine machine{{1, 1, 1, 1, 1, 1, 1, 1, 1, 40}};
    CHECK(Machine::decided(machine.run(60.0)) == 10);  // an equal part would be 6 s
    CHECK(machine.now <= 60.0);
}

TEST_CASE("Where not all fit, those that need least are decided, and the others keep what they have") {
    Machine machine{{200, 9, 10, 300, 8}};
    const std::vector<Verdict> verdicts = machine.run(60.0);
    CHECK(verdicts[1] == Verdict::agree);
    CHECK(verdicts[2] == Verdict::agree);
    CHECK(verdicts[4] == Verdict::agree);
    CHECK(machine.given[0].size() == 1);  // its forecast never fits
    CHECK(machine.now <= 60.0);
}

TEST_CASE("No scene gets more than the most of one, and nothing begins after a stop") {
    Machine machine{{5, 50}};
    TotalBudget budget = machine.budget(100.0);
    budget.most_seconds = 10.0;
    std::vector<std::optional<SceneVerdict>> last;
    verify_within(budget, last);
    for (const auto& [scene, shares] : machine.given)
        for (const double share : shares) CHECK(share <= 10.0);

    std::stop_source stop;
    budget.stop = stop.get_token();
    stop.request_stop();
    verify_within(budget, last);
    CHECK(!last[0]);
    CHECK(!last[1]);
}

TEST_CASE("The seconds that undecided scenes need add up") {
    const std::vector<SceneVerdict> verdicts{verdict_known_to(0.010, 0.01, 9.0),
        verdict_known_to(0.004, 0.01, 9.0, Verdict::agree), verdict_known_to(0.005, 0.01, 9.0)};
    CHECK(seconds_needed(verdicts).value() == doctest::Approx(40.0 + 11.0));
    CHECK(!seconds_needed({SceneVerdict()}));
}
