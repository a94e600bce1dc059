// Runs the catalogue of planted bugs and prints a line of JSON for each as it is done. Run by scripts/measure/mutants,
// which makes the table of it.
//
//     mutants list                        ids and plantings, a line each
//     mutants scenes                      ids, plantings in one backend and the scenes of each, a line each
//     mutants reasons                     which bugs are not planted in both, and why
//     mutants run ID PLANTING [EFFORTS [FIRST]]   one of them on its scenes, by effort and cost, until it is caught
//     mutants sound SCENE [EFFORT]        two sound backends: what the scene can see
//     mutants signature ID PLANTING SCENE the pattern of the difference, for scripts/measure/likeness
//     mutants needs ID PLANTING SCENE     the features that the difference needs, for the same
//     mutants formulas                    effect, scene and formula of what `change` measures, a line each
//     mutants change EFFECT SCENE FORMULA how much the image changes where the formula is wrong
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/validation/explanation/part_evidence.h"
#include "tests/mutants/formulas.h"
#include "tests/mutants/trial.h"

using namespace tandem;
using namespace tandem::test;
using nlohmann::json;

namespace {

json to_json(const Trial& trial, std::size_t effort) {
    return {{"scene", trial.scene}, {"effort", effort}, {"caught", trial.caught}, {"witness", trial.witness},
        {"level", trial.level}, {"levels", trial.levels}, {"blamed", trial.blamed},
        {"coarse_arithmetic", trial.coarse_arithmetic}, {"samples", trial.samples}, {"width", trial.width},
        {"height", trial.height}, {"seconds", trial.seconds}, {"sentence", trial.sentence}};
}

void print(const json& line) {
    fmt::print("{}\n", line.dump());
    std::fflush(stdout);
}

void run(const Mutant& mutant, std::size_t effort_count, std::size_t first) {
    json line{{"id", mutant.id()}, {"bug", planted_bug_names.at(static_cast<std::size_t>(mutant.fault.bug))},
        {"amount", mutant.fault.amount}, {"planting", name_of(mutant.planting)}, {"unbiased", mutant.unbiased},
        {"tuned_for", mutant.tuned_for},
        {"subsystem", subsystem_names.at(static_cast<std::size_t>(subsystem_of(mutant.fault.bug)))}, {"caught", false},
        {"trials", json::array()}};
    for (std::size_t effort = first; effort < effort_count && !line["caught"]; ++effort)
        for (const std::string& scene : mutant.scenes) {
            const SceneVerdict verdict = verdict_of(mutant.fault, mutant.planting, scene, efforts.at(effort));
            const Trial trial = trial_of(
                verdict, mutant.planting, scene, planted_bug_names.at(static_cast<std::size_t>(mutant.fault.bug)));
            line["trials"].push_back(to_json(trial, effort));
            line["caught"] = trial.caught;
            if (trial.caught) break;
        }
    print(line);
}

// How near the verdict came to a false alarm: below 1 it is one.
double least_p_of_threshold(const Judgement& judgement) {
    double least = std::numeric_limits<double>::infinity();
    for (const LevelResult& level : judgement.levels)
        if (level.threshold > 0.0) least = std::min(least, level.p / level.threshold);
    return least;
}

void sound(const std::string& scene, std::size_t effort) {
    const SceneVerdict verdict = verdict_of({}, Planting::vulkan, scene, efforts.at(effort));
    json line = to_json(trial_of(verdict, Planting::vulkan, scene), effort);
    line["verdict"] = name_of(verdict.verdict);
    line["least_p_of_threshold"] = least_p_of_threshold(verdict.judgement);
    line["diverged_fraction"] = verdict.paired.diverged_fraction;
    for (const LevelResult& level : verdict.judgement.levels)
        line["detectable_relative"][level.name] = level.minimum_detectable_relative;
    print(line);
}

// Half of effort 0, as patterns show before small amounts do.
void signature(const Mutant& mutant, const std::string& scene) {
    const SceneVerdict verdict = verdict_of(mutant.fault, mutant.planting, scene, signature_effort);
    json line{{"id", mutant.id()}, {"bug", planted_bug_names.at(static_cast<std::size_t>(mutant.fault.bug))},
        {"planting", name_of(mutant.planting)}, {"scene", scene}, {"verdict", name_of(verdict.verdict)},
        {"subsystem", subsystem_names.at(static_cast<std::size_t>(subsystem_of(mutant.fault.bug)))},
        {"seconds", verdict.seconds}, {"signature", nullptr}};
    if (verdict.signature)
        for (std::size_t i = 0; i < figure_count; ++i)
            line["signature"][figure_name(static_cast<Figure>(i))] =
                std::round(1e4 * static_cast<double>(verdict.signature->figures[i])) / 1e4;
    print(line);
}

// Beside the pattern, what suspects are ranked by: the features that the difference needs, and how far apart draws are.
void needs(const Mutant& mutant, const std::string& scene) {
    const Needs found = needs_of(mutant.fault, mutant.planting, scene);
    json line{{"id", mutant.id()}, {"bug", planted_bug_names.at(static_cast<std::size_t>(mutant.fault.bug))},
        {"planting", name_of(mutant.planting)}, {"scene", scene}, {"seconds", found.elimination.seconds},
        {"subsystem", subsystem_names.at(static_cast<std::size_t>(subsystem_of(mutant.fault.bug)))},
        {"paths", found.partings.paths}, {"parted", found.partings.parted},
        {"independence", std::round(1e4 * found.partings.independence) / 1e4}, {"needs", json::object()},
        {"numbers", number_use_names.at(static_cast<std::size_t>(found.partings.numbers.use))},
        {"numbers_words", found.partings.numbers.words}, {"left_out", found.elimination.left_out},
        {"parts", json::object()}};
    const PartNeeds by_part = needs_by_part(found.elimination);
    for (std::size_t i = 0; i < by_part.size(); ++i)
        line["parts"][std::string(subsystem_names.at(i))] = part_need_names.at(static_cast<std::size_t>(by_part.at(i)));
    for (const FeatureTrial& trial : found.elimination.trials)
        line["needs"][std::string(trial.feature.words)] = need_names.at(static_cast<std::size_t>(trial.need));
    print(line);
}

void print_formulas() {
    for (const Formula& formula : formulas())
        for (const std::string& scene : formula.scenes)
            if (calls_for(formula, scene)) fmt::print("{}\t{}\t{}\n", effect_name(formula.effect), scene, formula.name);
}

bool print_change(const std::string& effect, const std::string& scene, const std::string& name) {
    for (const Formula& formula : formulas()) {
        if (effect_name(formula.effect) != effect || formula.name != name) continue;
        const ImageChange change = change_of(formula, scene);
        print({{"effect", effect}, {"formula", name}, {"scene", scene}, {"change_relative", change.relative.value},
            {"low_relative", change.relative.low}, {"high_relative", change.relative.high}, {"width", change.width},
            {"height", change.height}, {"samples", change.samples}, {"seconds", change.seconds}});
        return true;
    }
    return false;
}

std::size_t count_from(const std::vector<std::string>& arguments, std::size_t index, std::size_t otherwise) {
    return index < arguments.size() ? static_cast<std::size_t>(std::stoul(arguments[index])) : otherwise;
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    const std::string command = arguments.empty() ? "" : arguments[0];
    try {
        if (command == "list" && arguments.size() == 1) {
            for (const Mutant& mutant : catalogue()) fmt::print("{} {}\n", mutant.id(), name_of(mutant.planting));
            return 0;
        }
        if (command == "scenes" && arguments.size() == 1) {
            for (const Mutant& mutant : catalogue())
                if (mutant.planting != Planting::both)
                    fmt::print("{} {} {}\n", mutant.id(), name_of(mutant.planting), fmt::join(mutant.scenes, " "));
            return 0;
        }
        if (command == "reasons" && arguments.size() == 1) {
            for (const NotInBoth& bug : not_in_both())
                fmt::print("{}: {}\n", planted_bug_names.at(static_cast<std::size_t>(bug.bug)), bug.reason);
            return 0;
        }
        if (command == "sound" && arguments.size() > 1) {
            sound(arguments[1], count_from(arguments, 2, 1));
            return 0;
        }
        if (command == "needs" && arguments.size() == 4)
            for (const Mutant& mutant : catalogue())
                if (mutant.id() == arguments[1] && name_of(mutant.planting) == arguments[2]) {
                    needs(mutant, arguments[3]);
                    return 0;
                }
        if (command == "signature" && arguments.size() == 4)
            for (const Mutant& mutant : catalogue())
                if (mutant.id() == arguments[1] && name_of(mutant.planting) == arguments[2]) {
                    signature(mutant, arguments[3]);
                    return 0;
                }
        if (command == "formulas" && arguments.size() == 1) {
            print_formulas();
            return 0;
        }
        if (command == "change" && arguments.size() == 4 && print_change(arguments[1], arguments[2], arguments[3]))
            return 0;
        if (command == "run" && arguments.size() > 2)
            for (const Mutant& mutant : catalogue())
                if (mutant.id() == arguments[1] && name_of(mutant.planting) == arguments[2]) {
                    run(mutant, std::min(count_from(arguments, 3, efforts.size()), efforts.size()),
                        count_from(arguments, 4, 0));
                    return 0;
                }
    } catch (const std::exception& error) {
        fmt::print(stderr, "mutants: {}\n", error.what());
        return 1;
    }
    fmt::print(stderr,
        "usage: mutants list | scenes | reasons | run ID PLANTING [EFFORTS [FIRST]] | sound SCENE [EFFORT] | "
        "signature ID PLANTING SCENE | needs ID PLANTING SCENE | formulas | change EFFECT SCENE FORMULA\n");
    return 2;
}
