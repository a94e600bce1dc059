// A bug in all path tracers shows against a closed form alone. How often the part that it lies in is named then, by the
// scene's features and by what was tried on the closed form. Each kind counts once, with its greatest amount.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <set>
#include <sstream>

#include "common/scene/loader/scene_loader.h"
#include "common/validation/explanation/suspects.h"
#include "common/validation/verdict/verdict.h"
#include "cpu_ref/backend.h"
#include "tests/mutants/plant_data.h"
#include "tests/mutants/trial.h"

using namespace tandem;
using namespace tandem::test;

namespace {

struct Right {
    std::size_t first = 0, among_three = 0, of = 0;
    void add(const std::vector<Suspect>& suspects, Subsystem part) {
        const auto found = std::ranges::find(suspects, part, &Suspect::part);
        first += found == suspects.begin() && found != suspects.end() ? 1 : 0;
        among_three += found != suspects.end() ? 1 : 0;
        ++of;
    }
};

std::string names_of(const std::vector<Suspect>& suspects) {
    std::vector<std::string_view> names;
    for (const Suspect& suspect : suspects) names.push_back(name_of(suspect.part));
    return fmt::format("{}", fmt::join(names, ", "));
}

// The CPU path tracer stands for both sides.
void name_each(Right& by_features, Right& by_trials) {
    std::set<PlantedBug> kinds;
    for (const Mutant& mutant : catalogue()) {
        if (mutant.planting != Planting::both || !kinds.insert(mutant.fault.bug).second) continue;
        CAPTURE(mutant.id());
        const Scene scene = load_scene(scene_file(mutant.scenes.front()));
        constexpr std::uint32_t longer_side = 64;
        RenderSettings settings = verification_settings(scene, longer_side);
        make_visible(mutant.fault.bug, settings);
        const ClosedFormUse use = closed_form_of(scene, settings);
        REQUIRE(use.form);
        BackendOptions single;
        single.precision = Precision::single_precision;
        const auto renderer = renderer_with(cpu_backend(), mutant.fault, single);
        constexpr std::uint64_t samples = 256;
        const SampledImage image = sampled_image_of(renderer->prepare(scene, settings)->render({0, samples}).estimate);
        const MissedForm tried = look_into_miss({.scene = scene,
            .settings = settings,
            .renderer = *renderer,
            .form = *use.form,
            .criteria = {},
            .most_samples = 1u << 11,
            .stop = {},
            .progress = {},
            .now = [] { return 0.0; }});  // samples end it, so that the machine's speed decides nothing
        const std::vector<SceneFeature> features = features_of(scene, settings);
        MissEvidence evidence{.features = features, .film = film_misses(*use.form, image)};
        const Subsystem part = subsystem_of(mutant.fault.bug);
        const std::vector<Suspect> before = suspects_of_miss(evidence);
        evidence.tried = &tried;
        const std::vector<Suspect> after = suspects_of_miss(evidence);
        by_features.add(before, part);
        by_trials.add(after, part);
        const std::string line = fmt::format("{} on {} ({}): {}; then {}; {}", mutant.id(), mutant.scenes.front(),
            name_of(part), names_of(before), names_of(after), told(tried));
        CAPTURE(line);
    }
}

// The counts of a row of the page: first, among three, of.
std::array<std::size_t, 3> row_of(const std::string& by) {
    std::ifstream file(TANDEM_SOURCE_DIR "/common/validation/README.md");
    std::array<std::size_t, 3> counts{};
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("| " + by + " | ")) {
            std::istringstream rest(line.substr(by.size() + 5));
            std::string word;
            rest >> counts[0] >> word >> counts[2] >> word >> counts[1];
        }
    return counts;
}

}  // namespace

TEST_CASE("bugs planted in both sides are named as often as the room's page says" * doctest::test_suite("full")) {
    Right by_features, by_trials;
    name_each(by_features, by_trials);
    CHECK(by_trials.first > by_features.first);
    for (const auto& [by, right] :
        {std::pair{"the scene's features alone", by_features}, {"and what was tried on the closed form", by_trials}}) {
        const auto [first, among_three, of] = row_of(by);
        MESSAGE(fmt::format("| {} | {} of {} | {} of {} |", by, right.first, right.of, right.among_three, right.of));
        CHECK(of == right.of);
        CHECK(first == right.first);
        CHECK(among_three == right.among_three);
    }
}
