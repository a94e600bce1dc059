// How much observations count for and against a part, counted over planted bugs. Also how often their sum is right for
// bugs of a kind that is left out.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "common/validation/explanation/part_evidence.h"

using namespace tandem;

namespace {

constexpr std::size_t index(Subsystem part) { return static_cast<std::size_t>(part); }

SceneFeature feature(Subsystem part, Naming naming = Naming::particular, bool whole = false) {
    return {part, "a feature", "1", nullptr, whole, naming};
}

PartNeeds needs_of(std::initializer_list<std::pair<SceneFeature, Need>> trials) {
    Elimination elimination;
    for (const auto& [one, need] : trials)
        elimination.trials.push_back({.feature = one, .need = need, .with = {}, .without = {}});
    return needs_by_part(elimination);
}

std::string page() {
    std::ifstream file(TANDEM_SOURCE_DIR "/common/validation/README.md");
    return {std::istreambuf_iterator<char>(file), {}};
}

// Planted bugs whose subsystem comes first, or among three, without the rows of their own kind.
struct Right {
    std::size_t first = 0, among_three = 0, of = 0;
};
Right right(bool with_needs) {
    Right right;
    for (const PlantedSignature& row : planted_signatures()) {
        const auto needs = std::ranges::find_if(planted_needs(),
            [&](const PlantedNeeds& one) { return one.bug == row.bug && one.planting == row.planting; });
        if (needs == planted_needs().end()) continue;
        PartEvidence evidence{scores_of(row.signature, planted_signatures(), row.bug), std::nullopt, false};
        if (with_needs) evidence.needs = needs->needs;
        if (with_needs) evidence.independent_draws = needs->independent_draws;
        const Scores sums =
            weight_of_evidence(evidence, evidence_weights(planted_signatures(), planted_needs(), row.bug));
        const auto above = std::ranges::count_if(sums, [&](double sum) { return sum > sums.at(index(row.subsystem)); });
        right.first += above == 0 ? 1 : 0;
        right.among_three += above < 3 ? 1 : 0;
        ++right.of;
    }
    return right;
}

}  // namespace

TEST_CASE("of a part's features the most particular one that is needed counts") {
    using S = Subsystem;
    const PartNeeds needs = needs_of({{feature(S::geometry, Naming::shape), Need::needed},
        {feature(S::light_sampling, Naming::general), Need::needed}, {feature(S::bsdf), Need::not_needed},
        {feature(S::textures, Naming::particular, true), Need::not_needed}, {feature(S::volumes), Need::unknown},
        {feature(S::roulette, Naming::nobody), Need::needed}});
    CHECK(needs.at(index(S::geometry)) == PartNeed::needed_shape);
    CHECK(needs.at(index(S::light_sampling)) == PartNeed::needed_generally);
    CHECK(needs.at(index(S::bsdf)) == PartNeed::not_needed);
    CHECK(needs.at(index(S::textures)) == PartNeed::cleared);
    CHECK(needs.at(index(S::volumes)) == PartNeed::unknown);
    CHECK(needs.at(index(S::roulette)) == PartNeed::unknown);
    const PartNeeds both =
        needs_of({{feature(S::camera), Need::needed}, {feature(S::geometry, Naming::shape), Need::needed},
            {feature(S::light_sampling, Naming::general), Need::needed}, {feature(S::light_sampling), Need::needed}});
    CHECK(both.at(index(S::camera)) == PartNeed::needed);
    CHECK(both.at(index(S::geometry)) == PartNeed::needed_beside);
    CHECK(both.at(index(S::light_sampling)) == PartNeed::needed);
}

TEST_CASE("a ratio is that of how often bugs of the part show it to how often others do") {
    std::vector<PlantedNeeds> rows;
    for (int i = 0; i < 20; ++i) {
        PlantedNeeds row{i < 10 ? "a" : "b", "cpu", i < 10 ? Subsystem::camera : Subsystem::bsdf, {}, false};
        row.needs.at(index(row.subsystem)) = i % 10 < 8 ? PartNeed::needed : PartNeed::unknown;
        rows.push_back(row);
    }
    const EvidenceWeights weights = evidence_weights({}, rows);
    const double unseen = 0.5, states = 0.5 * static_cast<double>(part_need_names.size());
    const double parts = static_cast<double>(subsystem_names.size());
    const double expected = std::log((16.0 + unseen) / (20.0 + states) / (unseen / (20.0 * (parts - 1.0) + states)));
    CHECK(weights.need.at(static_cast<std::size_t>(PartNeed::needed)) == doctest::Approx(expected));
    CHECK(weights.need.at(static_cast<std::size_t>(PartNeed::unknown)) < 0.0);
    CHECK(weights.pattern.front() == doctest::Approx(0.0));  // no row tells
    CHECK(evidence_weights({}, rows, "a").need != weights.need);
    Scores pattern{};
    const Scores sums = weight_of_evidence({pattern, rows.front().needs, false}, weights);
    CHECK(sums.at(index(Subsystem::camera)) - sums.at(index(Subsystem::textures)) ==
          doctest::Approx(need_share * (weights.need.at(1) - weights.need.at(0))));
}

TEST_CASE("what is needed of planted bugs counts as the room's page says") {
    const EvidenceWeights weights = evidence_weights(planted_signatures(), planted_needs());
    const std::string text = page();
    const auto check_said = [&](const std::string& said) {
        CAPTURE(said);
        CHECK(text.find(said) != std::string::npos);
    };
    for (std::size_t i = 0; i < part_need_names.size(); ++i)
        check_said(fmt::format("| {} | {:+.1f} |", part_need_names[i], weights.need.at(i)));
    check_said(fmt::format("{:.1f} to {:+.1f}.", weights.pattern.front(), weights.pattern.back()));
    check_said(fmt::format("random numbers count {:+.1f}, else {:.1f}.", weights.draws[1], weights.draws[0]));
    check_said(fmt::format("random numbers count {:+.1f}, where none does {:.1f}.",
        weights.numbers.at(static_cast<std::size_t>(NumberUse::own)), weights.numbers.front()));
    for (std::size_t i = 1; i < weights.pattern.size(); ++i) CHECK(weights.pattern[i] >= weights.pattern[i - 1] - 1.0);
    CHECK(weights.draws[1] > weights.draws[0]);
}

TEST_CASE("bugs of kinds that are left out are named as often as the room's page says, by all evidence") {
    const std::string text = page();
    for (const bool with_needs : {false, true}) {
        const Right found = right(with_needs);
        const std::string line =
            fmt::format("| {} | {} of {} | {} of {} |", with_needs ? "and features, draws" : "the pattern alone",
                found.first, found.of, found.among_three, found.of);
        CAPTURE(line);
        CHECK(found.of > 0);
        CHECK(text.find(line) != std::string::npos);
    }
}
