// The verifier is verified: scripts/measure/mutants has run the whole catalogue of planted bugs and kept
// which scene caught each (tests/records/mutants/mutants.json). Here every bug must have such a scene, and what little
// effort caught must be caught again, by that or less.
#include <doctest/doctest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/mutants/trial.h"

using namespace tandem;
using namespace tandem::test;
using nlohmann::json;

namespace {

struct Catch {
    bool caught = false;
    std::string scene;
    std::size_t effort = 0;
    bool formerly = false;  // an earlier run caught it, and this one did not
};

using Key = std::pair<std::string, std::string>;  // id and planting
Key key_of(const Mutant& mutant) { return {mutant.id(), name_of(mutant.planting)}; }

// Records of this machine's kind (2 CPU cores and lavapipe), or of another that scripts/measure/mutants --take stored.
std::map<Key, Catch> recorded(const std::string& name = "mutants") {
    std::ifstream file(TANDEM_SOURCE_DIR "/tests/records/mutants/" + name + ".json");
    std::map<Key, Catch> catches;
    for (const json& line : json::parse(file)) {
        if (!line.contains("planting")) continue;
        const json& last = line["trials"].back();
        // Records of old may name the level by which the backends differ; for a bug in both only a closed form counts.
        if (line["planting"] == "both" && line["caught"] &&
            !last["level"].get<std::string>().starts_with("closed form"))
            continue;
        catches[{line["id"], line["planting"]}] = {
            line["caught"], last["scene"], last["effort"], line.value("formerly_caught", false)};
    }
    return catches;
}

// Most bugs show with the least effort, which takes a small part of the time that the recorded one does. `alone`: with
// that one, as its later looks are to be tried, too.
void check_caught_by(const Catch& known, const Mutant& mutant, bool alone) {
    CAPTURE(mutant.id());
    CAPTURE(known.scene);
    std::string sentences;
    std::vector<Effort> tried{efforts.at(known.effort)};
    if (!alone) tried.insert(tried.begin(), least_effort);
    for (const Effort& effort : tried) {
        const SceneVerdict verdict = verdict_of(mutant.fault, mutant.planting, known.scene, effort);
        if (trial_of(verdict, mutant.planting, known.scene).caught) return;
        sentences += verdict.sentence + "; ";
    }
    FAIL_CHECK(sentences);
}

// The side that a bug is planted in here: where both have it, the CPU's and Vulkan's in turn, as both would take CI too
// long. scripts/measure/mutants plants it in both.
std::map<std::string, Planting> side_in_turn() {
    std::map<std::string, Planting> sides;
    bool on_cpu = false;
    for (const Mutant& mutant : catalogue()) {
        if (mutant.planting == Planting::both) continue;
        const auto [place, first] = sides.emplace(mutant.id(), mutant.planting);
        if (first) continue;
        place->second = on_cpu ? Planting::cpu : Planting::vulkan;
        on_cpu = !on_cpu;
    }
    return sides;
}

// Every `parts`th of a planting's bugs that effort 0 or 1 caught.
void check_caught_again(Planting planting, std::size_t part, std::size_t parts) {
    const std::map<Key, Catch> catches = recorded();
    const std::map<std::string, Planting> sides = side_in_turn();
    std::size_t index = 0, checked = 0;
    for (const Mutant& mutant : catalogue()) {
        if (mutant.planting != planting) continue;
        if (planting != Planting::both && sides.at(mutant.id()) != planting) continue;
        if (index++ % parts != part) continue;
        const auto known = catches.find(key_of(mutant));
        if (known == catches.end() || !known->second.caught || known->second.effort > 1) continue;
        check_caught_by(known->second, mutant, checked++ % 10 == 0);
    }
    CHECK(checked > 10);
}

// What has not been run yet, or with little effort only, is said; scripts/measure/mutants goes on with it.
void check_record(const std::string& name) {
    const std::map<Key, Catch> catches = recorded(name);
    std::size_t waiting = 0;
    for (const Mutant& mutant : catalogue()) {
        CAPTURE(mutant.id());
        CAPTURE(name_of(mutant.planting));
        const auto known = catches.find(key_of(mutant));
        // What was caught once must not escape, however little effort it has been run with since.
        if (known != catches.end()) CHECK_FALSE(known->second.formerly);
        // Another escape is final only at the effort of tandem verify itself.
        if (known == catches.end() || (!known->second.caught && known->second.effort + 1 < efforts.size()))
            ++waiting;
        else if (!mutant.unbiased && mutant.tuned_for)
            CHECK(known->second.caught);
    }
    CHECK(catches.size() > 200);
    WARN_MESSAGE(waiting == 0, waiting, " of ", catalogue().size(), " wait to be run by scripts/measure/mutants");
}

}  // namespace

TEST_CASE("every bug is in the catalogue") {
    std::set<PlantedBug> planted;
    for (const Mutant& mutant : catalogue()) planted.insert(mutant.fault.bug);
    for (std::size_t bug = 1; bug < static_cast<std::size_t>(PlantedBug::count); ++bug) {
        CAPTURE(planted_bug_names.at(bug));
        CHECK(planted.contains(static_cast<PlantedBug>(bug)));
    }
}

TEST_CASE("every bug is planted in both backends alike, or has a reason why not") {
    for (const NotInBoth& bug : not_in_both()) {
        CAPTURE(planted_bug_names.at(static_cast<std::size_t>(bug.bug)));
        CHECK(!bug.reason.empty());
    }
}

TEST_CASE("a bug in both is caught by a closed form, whatever the backends differ by") {
    SceneVerdict verdict;
    verdict.verdict = Verdict::disagree;
    LevelResult image;
    image.name = "image";
    image.significant = true;
    image.p = 1e-30;
    verdict.judgement.levels.push_back(image);
    CHECK(trial_of(verdict, Planting::cpu, "glass").witness == "backends");
    CHECK_FALSE(trial_of(verdict, Planting::both, "glass").caught);
    LevelResult form = image;
    form.name = closed_form_candidate_level;
    form.p = 1e-9;
    verdict.judgement.levels.push_back(form);
    const Trial trial = trial_of(verdict, Planting::both, "glass");
    CHECK(trial.caught);
    CHECK(trial.level == closed_form_candidate_level);
    CHECK(trial.levels == std::vector<std::string>{"image", closed_form_candidate_level});
    CHECK(trial_of(verdict, Planting::vulkan, "glass").level == "image");
}

TEST_CASE("every bug that was run here and biases the image was caught, or was never tuned for") {
    check_record("mutants");
}

TEST_CASE("every bug that was run on an H200 and biases the image was caught, or was never tuned for") {
    check_record("mutants_h200");
}

#define TANDEM_CAUGHT(planting, part, parts)                                                                           \
    TEST_CASE(#planting ": what was caught is caught again, part " #part " of " #parts* doctest::test_suite("full")) { \
        check_caught_again(Planting::planting, part - 1, parts);                                                       \
    }

TANDEM_CAUGHT(cpu, 1, 3)
TANDEM_CAUGHT(cpu, 2, 3)
TANDEM_CAUGHT(cpu, 3, 3)
TANDEM_CAUGHT(vulkan, 1, 3)
TANDEM_CAUGHT(vulkan, 2, 3)
TANDEM_CAUGHT(vulkan, 3, 3)
TANDEM_CAUGHT(both, 1, 2)
TANDEM_CAUGHT(both, 2, 2)

TEST_CASE("two sound backends do not disagree about the scenes that catch most" * doctest::test_suite("full")) {
    for (const char* scene : {"many-lamps", "whitted", "boundaries", "cornell-thesis", "glass", "textures", "motion"}) {
        CAPTURE(scene);
        for (const Effort& effort : {least_effort, efforts[0]}) {
            const SceneVerdict verdict = verdict_of({}, Planting::vulkan, scene, effort);
            CAPTURE(verdict.sentence);
            CHECK(verdict.verdict != Verdict::disagree);
        }
    }
}
