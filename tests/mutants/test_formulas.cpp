// Every effect has formulas, and each, got wrong, changes the image of some shipped scene by 1 % at least:
// scripts/measure/effects has measured it (tests/records/mutants/effects.json). A fresh effect or formula fails here
// until a scene shows it.
#include <doctest/doctest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/mutants/formulas.h"

using namespace tandem;
using namespace tandem::test;
using nlohmann::json;

namespace {

constexpr double wanted = 0.01;

// By effect and formula: the greatest lower end of its changes' intervals.
std::map<std::pair<std::string, std::string>, double> recorded() {
    std::ifstream file(TANDEM_SOURCE_DIR "/tests/records/mutants/effects.json");
    std::map<std::pair<std::string, std::string>, double> greatest;
    for (const json& row : json::parse(file)) {
        double& low = greatest[{row["effect"], row["formula"]}];
        low = std::max(low, row["low_relative"].get<double>());
    }
    return greatest;
}

}  // namespace

TEST_CASE("every formula of every effect changes the image of a scene by 1 % where it is wrong") {
    const auto greatest = recorded();
    EffectSet covered;
    for (const Formula& formula : formulas()) {
        CAPTURE(effect_name(formula.effect));
        CAPTURE(formula.name);
        const auto row = greatest.find({std::string(effect_name(formula.effect)), formula.name});
        REQUIRE_MESSAGE(row != greatest.end(), "not measured yet: run scripts/measure/effects");
        CHECK(row->second >= wanted);
        covered = covered.with(formula.effect);
    }
    CHECK(effect_names(EffectSet::all().without(covered)) == "");
}

TEST_CASE("a formula that is wrong changes the image that it makes, and no other") {
    for (const Formula& formula : formulas()) {
        if (formula.name != "face-normal-flipped" && formula.name != "checker-shifted") continue;
        CAPTURE(formula.name);
        const bool checker = formula.effect == Effect::checker;
        const ImageChange change = change_of(formula, checker ? "closed-forms/checker" : "closed-forms/slab");
        if (checker) CHECK(change.relative.low > wanted);
        // The slab shows its upper y face.
        else
            CHECK(change.relative.value == 0.0);
    }
}
