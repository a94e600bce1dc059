#include "common/experiment/compare_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/statistics/multiple_tests.h"
#include "common/statistics/paired_effect.h"

namespace tandem {

namespace {

// Logarithms of an arm's settled readings by the family's clock, of each replicate.
struct OwnTimes {
    std::string family, arm, workload;
    std::vector<std::vector<double>> replicates;
    bool differs = false;  // its output, in some replicate: later ones time it without the gate

    // Readings of a replicate share its luck with memory and threads. So replicates are the unit, where there are
    // several.
    [[nodiscard]] MeanEstimate mean_log() const {
        if (replicates.size() == 1) return trimmed_mean_estimate(replicates.front());
        SampleMoments means;
        for (const std::vector<double>& logs : replicates) means.add(trimmed_mean_estimate(logs).mean);
        return MeanEstimate(means);
    }
};

std::vector<OwnTimes> own_times(const BenchResults& results) {
    constexpr std::size_t fewest_readings = 3;
    std::vector<OwnTimes> list;
    for (const ExperimentSamples& samples : results.samples) {
        const std::size_t warm_up = warm_up_blocks(samples);
        for (const ArmSamples& arm : samples.arms) {
            const auto same = [&](const OwnTimes& other) {
                return other.family == samples.family && other.arm == arm.arm &&
                       other.workload == samples.workload.name;
            };
            auto found = std::ranges::find_if(list, same);
            if (found == list.end())
                found = list.insert(list.end(), {samples.family, arm.arm, samples.workload.name, {}});
            found->differs = found->differs || arm.identity == Identity::differs;
            const auto readings = arm.seconds.find(samples.clock);
            if (readings == arm.seconds.end()) continue;
            std::vector<double> logs;
            for (std::size_t i = std::min(warm_up, readings->second.size()); i < readings->second.size(); ++i)
                logs.push_back(std::log(readings->second[i]));
            if (logs.size() >= fewest_readings) found->replicates.push_back(std::move(logs));
        }
    }
    std::erase_if(list, [](const OwnTimes& times) { return times.differs || times.replicates.empty(); });
    return list;
}

const OwnTimes* find_same(const std::vector<OwnTimes>& list, const OwnTimes& wanted) {
    for (const OwnTimes& times : list)
        if (times.family == wanted.family && times.arm == wanted.arm && times.workload == wanted.workload)
            return &times;
    return nullptr;
}

std::string described(const OwnTimes& times, const char* where) {
    return fmt::format("{}, {} at {}: only in {}", times.family, times.arm, times.workload, where);
}

}  // namespace

ResultsComparison compare_results(const BenchResults& a, const BenchResults& b) {
    const std::vector<OwnTimes> first = own_times(a), second = own_times(b);
    ResultsComparison comparison;
    std::vector<double> p_values;
    for (const OwnTimes& times : first) {
        const OwnTimes* other = find_same(second, times);
        if (other == nullptr) {
            comparison.only_in_one.push_back(described(times, "A"));
            continue;
        }
        const MeanDifference difference = welch(times.mean_log(), other->mean_log());
        const Interval interval = difference.interval(0.025);
        comparison.arms.push_back({times.family, times.arm, times.workload, std::exp(difference.difference),
            std::exp(interval.low), std::exp(interval.high), 1.0, Change::ambiguous});
        p_values.push_back(difference.p_value());
    }
    for (const OwnTimes& times : second)
        if (find_same(first, times) == nullptr) comparison.only_in_one.push_back(described(times, "B"));
    const std::vector<double> adjusted = holm_adjusted(p_values);
    for (std::size_t i = 0; i < adjusted.size(); ++i) {
        ChangeOfArm& arm = comparison.arms[i];
        arm.p_family = adjusted[i];
        arm.change = change_of(arm.low, arm.high, arm.p_family);
    }
    return comparison;
}

nlohmann::json to_json(const ResultsComparison& comparison) {
    nlohmann::json arms = nlohmann::json::array();
    for (const ChangeOfArm& arm : comparison.arms)
        arms.push_back({{"family", arm.family}, {"arm", arm.arm}, {"workload", arm.workload}, {"ratio", arm.ratio},
            {"ratio_low", arm.low}, {"ratio_high", arm.high}, {"p_family", arm.p_family},
            {"change", name_of(arm.change)}});
    return {{"arms", arms}, {"only_in_one", comparison.only_in_one}, {"negligible_relative", negligible_change}};
}

std::string to_text(const ResultsComparison& comparison) {
    std::string text;
    for (const ChangeOfArm& arm : comparison.arms)
        text += fmt::format("{:10} {:6.3f} times ({:.3f} to {:.3f})  {}, {} at {}\n", name_of(arm.change), arm.ratio,
            arm.low, arm.high, arm.family, arm.arm, arm.workload);
    for (const std::string& line : comparison.only_in_one) text += line + "\n";
    std::array<std::size_t, 4> counts{};
    for (const ChangeOfArm& arm : comparison.arms) ++counts[static_cast<std::size_t>(arm.change)];
    return text + fmt::format("B against A: {} same, {} faster, {} slower, {} ambiguous\n", counts[0], counts[1],
                      counts[2], counts[3]);
}

}  // namespace tandem
