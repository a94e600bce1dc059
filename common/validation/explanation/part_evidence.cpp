#include "common/validation/explanation/part_evidence.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace tandem {

namespace {

// How often each of several looks was seen, of parts at fault and of others.
template <std::size_t n>
class Counts {
public:
    void add(std::size_t look, bool at_fault) { (at_fault ? fault_ : others_).at(look) += 1.0; }
    [[nodiscard]] std::array<double, n> ratios() const {
        std::array<double, n> result{};
        const double all_fault = sum(fault_), all_others = sum(others_);
        for (std::size_t i = 0; i < n; ++i)
            result.at(i) = std::log(share(fault_.at(i), all_fault) / share(others_.at(i), all_others));
        return result;
    }

private:
    static double sum(const std::array<double, n>& counts) {
        double all = 0.0;
        for (const double count : counts) all += count;
        return all;
    }
    static double share(double count, double all) { return (count + unseen) / (all + unseen * static_cast<double>(n)); }
    static constexpr double unseen = 0.5;  // of Jeffreys's prior
    std::array<double, n> fault_{}, others_{};
};

Subsystem part_at(std::size_t i) { return static_cast<Subsystem>(i); }

constexpr bool is_needed(PartNeed need) { return need >= PartNeed::needed && need <= PartNeed::needed_beside; }

// Where one part is needed and no other.
constexpr void mark_alone(PartNeeds& needs) {
    PartNeed* only = nullptr;
    for (PartNeed& need : needs) {
        if (!is_needed(need)) continue;
        if (only != nullptr) return;
        only = &need;
    }
    if (only != nullptr && *only == PartNeed::needed) *only = PartNeed::needed_alone;
}

constexpr PlantedNeeds row(std::string_view bug, std::string_view planting, std::string_view subsystem,
    std::string_view needs, bool independent_draws, std::string_view numbers) {
    constexpr std::string_view letters = "unagsboc";  // of PartNeed
    PlantedNeeds result{bug, planting, Subsystem::count, {}, independent_draws, NumberUse::same};
    for (std::size_t i = 0; i < number_use_names.size(); ++i)
        if (number_use_names[i] == numbers) result.numbers = static_cast<NumberUse>(i);
    for (std::size_t i = 0; i < subsystem_names.size(); ++i) {
        if (subsystem_names[i] == subsystem) result.subsystem = part_at(i);
        result.needs[i] = static_cast<PartNeed>(letters.find(needs[i]));
    }
    mark_alone(result.needs);  // the record's letters are of each part by itself
    return result;
}

}  // namespace

PartNeeds needs_by_part(const Elimination& elimination) {
    PartNeeds needs{};
    const auto rank = [](PartNeed need) {  // what is told of two features of a part
        constexpr std::array<int, part_need_names.size()> ranks{0, 4, 4, 3, 2, 2, 1, 0};
        return ranks.at(static_cast<std::size_t>(need));
    };
    for (const FeatureTrial& trial : elimination.trials) {
        if (trial.need == Need::unknown || trial.feature.naming == Naming::nobody) continue;
        const PartNeed told = trial.need == Need::not_needed            ? PartNeed::not_needed
                              : trial.feature.naming == Naming::shape   ? PartNeed::needed_shape
                              : trial.feature.naming == Naming::general ? PartNeed::needed_generally
                                                                        : PartNeed::needed;
        PartNeed& need = needs.at(static_cast<std::size_t>(trial.feature.part));
        if (rank(told) > rank(need)) need = told;
    }
    if (std::ranges::find(needs, PartNeed::needed) != needs.end())
        for (PartNeed& need : needs)
            if (need == PartNeed::needed_generally || need == PartNeed::needed_shape) need = PartNeed::needed_beside;
    for (const Subsystem part : cleared_parts(elimination))
        needs.at(static_cast<std::size_t>(part)) = PartNeed::cleared;
    mark_alone(needs);
    return needs;
}

bool draws_are_independent(const PathPartings& partings) {
    constexpr double independent = 0.4, most_paths = 0.5;
    return partings.independence > independent &&
           static_cast<double>(partings.parted) > most_paths * static_cast<double>(partings.paths);
}

std::span<const PlantedNeeds> planted_needs() {
    static const std::vector<PlantedNeeds> rows{
#define NEEDS(bug, planting, subsystem, needs, draws, numbers) row(bug, planting, subsystem, needs, draws, numbers),
#include "common/validation/explanation/planted_needs.def"
#undef NEEDS
    };
    return rows;
}

std::size_t pattern_band(double score) {
    return static_cast<std::size_t>(std::ranges::upper_bound(pattern_bands, score) - pattern_bands.begin());
}

EvidenceWeights evidence_weights(
    std::span<const PlantedSignature> patterns, std::span<const PlantedNeeds> needs, std::string_view left_out) {
    std::vector<PlantedSignature> rows;
    std::ranges::copy_if(
        patterns, std::back_inserter(rows), [&](const PlantedSignature& one) { return one.bug != left_out; });
    Counts<pattern_bands.size() + 1> by_pattern;
    for (const PlantedSignature& one : rows) {
        const Scores scores = scores_of(one.signature, rows, one.bug);
        for (std::size_t i = 0; i < scores.size(); ++i)
            by_pattern.add(pattern_band(scores[i]), one.subsystem == part_at(i));
    }
    Counts<part_need_names.size()> by_need;
    Counts<2> by_draws;
    Counts<number_use_names.size()> by_numbers;
    for (const PlantedNeeds& one : needs) {
        if (one.bug == left_out) continue;
        for (std::size_t i = 0; i < one.needs.size(); ++i)
            by_need.add(static_cast<std::size_t>(one.needs[i]), one.subsystem == part_at(i));
        const bool of_numbers = one.subsystem == Subsystem::random_numbers;
        by_draws.add(one.independent_draws ? 1 : 0, of_numbers);
        by_numbers.add(static_cast<std::size_t>(one.numbers), of_numbers);
    }
    return {by_pattern.ratios(), by_need.ratios(), by_draws.ratios(), by_numbers.ratios()};
}

Scores weight_of_evidence(const PartEvidence& evidence, const EvidenceWeights& weights) {
    constexpr double within_band = 0.01;  // the score itself, where all else is equal
    Scores sums{};
    for (std::size_t i = 0; i < sums.size(); ++i) {
        sums[i] =
            pattern_share * weights.pattern.at(pattern_band(evidence.pattern[i])) + within_band * evidence.pattern[i];
        if (evidence.needs) sums[i] += need_share * weights.need.at(static_cast<std::size_t>(evidence.needs->at(i)));
    }
    sums.at(static_cast<std::size_t>(Subsystem::random_numbers)) +=
        weights.draws.at(evidence.independent_draws ? 1 : 0) +
        weights.numbers.at(static_cast<std::size_t>(evidence.numbers));
    return sums;
}

}  // namespace tandem
