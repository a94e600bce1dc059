// Renders pairs of images, clean ones and such with a planted bug, and asks all judges. Run by scripts/measure/judges.
//
//     contest list                 bugs, with amount and scene, a line each
//     contest rules                name and rule of each judge
//     contest clean FIRST COUNT    pairs of equal renderers, COUNT seeds a scene, from FIRST
//     contest planted FIRST COUNT  the same with each bug of the catalogue that is planted on the CPU
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "common/scene/loader/scene_loader.h"
#include "common/validation/compare/compare.h"
#include "common/validation/judges/judges.h"
#include "cpu_ref/backend.h"
#include "tests/mutants/catalogue.h"
#include "tests/mutants/plant_data.h"

using namespace tandem;
using namespace tandem::test;
using nlohmann::json;

namespace {

constexpr std::uint32_t side = 64;
constexpr std::uint64_t samples = 128;
// Other bugs than these lie where a scene of its own has to be rendered; the whole catalogue is MUTANTS.md's matter.
const std::set<std::string> scenes{"cornell-classic", "glass", "conductors", "lights", "textures"};

struct Entry {
    Mutant mutant;
    std::string scene;
};

std::vector<Entry> entries() {
    std::vector<Entry> found;
    for (const Mutant& mutant : catalogue()) {
        if (mutant.planting != Planting::cpu || mutant.unbiased) continue;
        const auto scene =
            std::ranges::find_if(mutant.scenes, [](const std::string& name) { return scenes.contains(name); });
        if (scene != mutant.scenes.end()) found.push_back({mutant, *scene});
    }
    return found;
}

Image rendered(const std::string& name, const PlantedFault& fault, std::uint64_t seed) {
    const Scene scene = load_scene(std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / (name + ".json"));
    RenderSettings settings = with_longer_side(default_settings(scene), side);
    settings.seed = seed;
    const auto renderer = renderer_with(cpu_backend(), fault);
    return image_of(renderer->prepare(scene, settings)->render({0, samples}).estimate, {});
}

// How far Tandem's least p lies below what it was held to, in powers of ten.
double excess(const SceneVerdict& verdict) {
    double greatest = -300.0;
    for (const LevelResult& level : verdict.judgement.levels)
        greatest =
            std::max(greatest, std::log10(std::max(level.threshold, 1e-300)) - std::log10(std::max(level.p, 1e-300)));
    return verdict.verdict == Verdict::disagree ? std::max(greatest, 1e-9) : std::min(greatest, 0.0);
}

void print_pair(json line, const Image& a, const Image& b) {
    json scores = json::object(), notices = json::object();
    for (const JudgeFinding& finding : ask_judges(judged_pair(a, b))) {
        scores[std::string(finding.name)] = finding.score;
        notices[std::string(finding.name)] = finding.notices();
    }
    const SceneVerdict verdict = compare_images({{"a", a}}, {{"b", b}});
    scores["tandem compare"] = excess(verdict);
    notices["tandem compare"] = verdict.verdict == Verdict::disagree;
    line["scores"] = scores;
    line["notices"] = notices;
    fmt::print("{}\n", line.dump());
    std::fflush(stdout);
}

std::uint64_t number(const char* text) {
    std::uint64_t value = 0;
    std::from_chars(text, text + std::string_view(text).size(), value);
    return value;
}

void run(std::string_view what, std::uint64_t first, std::uint64_t count) {
    for (std::uint64_t seed = first; seed < first + count; ++seed) {
        const std::uint64_t a = 2 * seed + 1, b = 2 * seed + 2;
        if (what == "clean")
            for (const std::string& scene : scenes)
                print_pair({{"scene", scene}, {"seed", seed}}, rendered(scene, {}, a), rendered(scene, {}, b));
        else
            for (const auto& [mutant, scene] : entries())
                print_pair({{"bug", mutant.id()}, {"amount", mutant.fault.amount}, {"scene", scene}, {"seed", seed}},
                    rendered(scene, {}, a), rendered(scene, mutant.fault, b));
    }
}

}  // namespace

int main(int argc, char** argv) {
    const std::string_view what = argc > 1 ? argv[1] : "";
    if (what == "list")
        for (const auto& [mutant, scene] : entries()) fmt::print("{} {} {}\n", mutant.id(), mutant.fault.amount, scene);
    else if (what == "rules")
        for (const JudgeFinding& finding :
            ask_judges(JudgedPair{1, 1, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, 2.0}))
            fmt::print("{}\t{}\n", finding.name, finding.rule);
    else if ((what == "clean" || what == "planted") && argc == 4)
        run(what, number(argv[2]), number(argv[3]));
    else
        return 2;
    return 0;
}
