#include "common/experiment/analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "common/statistics/multiple_tests.h"
#include "common/statistics/paired_effect.h"

namespace tandem {

namespace {

using Experiments = std::vector<std::vector<const ExperimentSamples*>>;  // by experiment, the processes

Experiments by_experiment(const std::vector<ExperimentSamples>& samples) {
    Experiments experiments;
    for (const ExperimentSamples& one : samples) {
        const auto same = [&](const auto& processes) {
            return processes.front()->family == one.family && processes.front()->workload.name == one.workload.name;
        };
        const auto found = std::ranges::find_if(experiments, same);
        if (found != experiments.end())
            found->push_back(&one);
        else
            experiments.push_back({&one});
    }
    return experiments;
}

std::optional<std::size_t> arm_named(const ExperimentSamples& samples, const std::string& name) {
    for (std::size_t i = 0; i < samples.arms.size(); ++i)
        if (samples.arms[i].arm == name) return i;
    return std::nullopt;
}

// The readings of one clock without warm-up.
std::vector<double> settled(const ExperimentSamples& samples, std::size_t arm, const std::string& clock) {
    const auto found = samples.arms[arm].seconds.find(clock);
    if (found == samples.arms[arm].seconds.end()) return {};
    const std::size_t skipped = std::min(warm_up_blocks(samples), found->second.size());
    return {found->second.begin() + static_cast<std::ptrdiff_t>(skipped), found->second.end()};
}

void add_seconds(ArmResult& result, const std::vector<const ExperimentSamples*>& processes) {
    std::map<std::string, std::vector<double>> means;
    for (const ExperimentSamples* process : processes) {
        const auto arm = arm_named(*process, result.arm);
        if (!arm) continue;
        for (const auto& [clock, all] : process->arms[*arm].seconds)
            if (const std::vector<double> seconds = settled(*process, *arm, clock); !seconds.empty())
                means[clock].push_back(trimmed_mean(seconds));
    }
    for (const auto& [clock, seconds] : means) result.seconds[clock] = median(seconds);
    if (const auto found = means.find(result.clock); found != means.end()) result.replicate_seconds = found->second;
}

ArmResult result_of(const std::vector<const ExperimentSamples*>& processes, std::size_t arm) {
    const ExperimentSamples& first = *processes.front();
    const ArmSamples& own = first.arms[arm];
    ArmResult result{.family = first.family,
        .arm = own.arm,
        .text = own.text,
        .baseline = first.arms[0].arm,
        .clock = first.clock,
        .workload = first.workload,
        .identity = own.identity,
        .reason = own.reason,
        .seconds = {},
        .replicate_seconds = {},
        .log_ratio = {},
        .difference = {}};
    ProcessBlocks ratios, differences_;
    for (const ExperimentSamples* process : processes) {
        const auto here = arm_named(*process, own.arm);
        if (!here) continue;
        // One process in which the arm failed the gate is enough.
        if (process->arms[*here].identity == Identity::differs) {
            result.identity = Identity::differs;
            result.reason = process->arms[*here].reason;
        }
        const std::vector<double> blocks = log_ratios(*process, *here);
        if (blocks.empty()) continue;
        ratios.push_back(blocks);
        differences_.push_back(differences(*process, *here));
        result.warm_up += warm_up_blocks(*process);
    }
    add_seconds(result, processes);
    if (ratios.empty() || result.identity == Identity::differs) return result;
    if (arm > 0) {
        result.log_ratio = paired_effect(ratios);
        result.difference = paired_effect(differences_);
    } else {
        for (const auto& blocks : ratios) result.log_ratio.blocks += blocks.size();
        result.log_ratio.processes = ratios.size();
    }
    return result;
}

void correct_families(std::vector<ArmResult>& results) {
    std::set<std::string> families;
    for (const ArmResult& result : results) families.insert(result.family);
    for (const std::string& family : families) {
        std::vector<ArmResult*> tested;
        std::vector<double> p_values;
        for (ArmResult& result : results)
            if (result.family == family && result.timed() && result.arm != result.baseline) {
                tested.push_back(&result);
                p_values.push_back(result.log_ratio.p);
            }
        const std::vector<double> adjusted = holm_adjusted(p_values);
        for (std::size_t i = 0; i < tested.size(); ++i) tested[i]->p_family = adjusted[i];
    }
}

// -1: surely below the baseline's time, 1: surely above, 0: neither.
int side_of(const ArmResult& result) {
    if (result.log_ratio.high < 0.0) return -1;
    return result.log_ratio.low > 0.0 ? 1 : 0;
}

Crossover crossover_of(const std::vector<const ArmResult*>& sizes, const std::string& along) {
    Crossover crossover;
    crossover.family = sizes.front()->family;
    crossover.arm = sizes.front()->arm;
    crossover.along = along;
    const auto size = [&](std::size_t i) { return sizes[i]->workload.factors.at(along); };
    std::optional<std::size_t> last;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const int side = side_of(*sizes[i]);
        if (side == 0) continue;
        if (last && side_of(*sizes[*last]) != side) {
            crossover.exists = true;
            crossover.faster_above = side < 0;
            crossover.below = size(*last);
            crossover.above = size(i);
            const double from = sizes[*last]->log_ratio.value, to = sizes[i]->log_ratio.value;
            crossover.at = std::exp(std::log(crossover.below) +
                                    from / (from - to) * (std::log(crossover.above) - std::log(crossover.below)));
        }
        last = i;
    }
    if (crossover.exists)
        crossover.text = fmt::format("{} from about {:.3g} {} on (between {:g} and {:g})",
            crossover.faster_above ? "faster" : "slower", crossover.at, along, crossover.below, crossover.above);
    else if (!last)
        crossover.text = "no difference was seen at any size";
    else
        crossover.text = side_of(*sizes[*last]) < 0 ? "faster wherever a difference was seen"
                                                    : "slower wherever a difference was seen";
    return crossover;
}

}  // namespace

const char* name_of(Change change) {
    constexpr std::array<const char*, 4> names{"same", "faster", "slower", "ambiguous"};
    return names[static_cast<std::size_t>(change)];
}

Change change_of(double low, double high, double p) {
    constexpr double alpha = 0.05;
    if (equivalent({low - 1.0, high - 1.0}, negligible_change)) return Change::same;
    if (p <= alpha && high < 1.0) return Change::faster;
    if (p <= alpha && low > 1.0) return Change::slower;
    return Change::ambiguous;
}

Change ArmResult::verdict() const { return change_of(ratio_low(), ratio_high(), p_family); }
double ArmResult::ratio() const { return std::exp(log_ratio.value); }
double ArmResult::ratio_low() const { return std::exp(log_ratio.low); }
double ArmResult::ratio_high() const { return std::exp(log_ratio.high); }
double ArmResult::smallest_detectable_relative() const { return std::expm1(smallest_detectable(log_ratio)); }

std::vector<ArmResult> analyse(const std::vector<ExperimentSamples>& samples) {
    std::vector<ArmResult> results;
    for (auto processes : by_experiment(samples)) {
        // Later replicates may have arms that the first had not.
        std::set<std::string> seen;
        for (std::size_t i = 0; i < processes.size(); ++i)
            for (std::size_t arm = 0; arm < processes[i]->arms.size(); ++arm) {
                if (!seen.insert(processes[i]->arms[arm].arm).second) continue;
                std::swap(processes.front(), processes[i]);
                results.push_back(result_of(processes, arm));
                std::swap(processes.front(), processes[i]);
            }
    }
    correct_families(results);
    return results;
}

std::vector<ReplicateResult> replicates_of(const std::vector<ExperimentSamples>& samples) {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    std::map<std::pair<std::string, std::string>, std::size_t> counts;
    std::vector<ReplicateResult> results;
    for (const ExperimentSamples& one : samples) {
        const std::size_t replicate = ++counts[{one.family, one.workload.name}];
        for (std::size_t arm = 0; arm < one.arms.size(); ++arm) {
            const std::vector<double> seconds = settled(one, arm, one.clock);
            const std::vector<double> ratios = arm > 0 ? log_ratios(one, arm) : std::vector<double>{};
            results.push_back({one.family, one.arms[arm].arm, one.arms.front().arm, one.clock, one.workload, replicate,
                seconds.size(), seconds.empty() ? unknown : trimmed_mean(seconds),
                ratios.empty() ? unknown : std::exp(trimmed_mean(ratios))});
        }
    }
    return results;
}

std::vector<Crossover> crossovers(
    const std::vector<ArmResult>& results, const std::string& along, const std::string& family) {
    // By arm, and by the workload's other factors: a crossover is sought along one factor alone.
    std::vector<std::pair<std::string, std::map<std::string, double>>> groups;
    std::vector<std::vector<const ArmResult*>> members;
    for (const ArmResult& result : results) {
        if (result.family != family || result.arm == result.baseline || !result.timed() ||
            !result.workload.factors.contains(along))
            continue;
        std::map<std::string, double> others = result.workload.factors;
        others.erase(along);
        if (along == "pixels") others.erase("width");
        const auto group = std::ranges::find(groups, std::pair(result.arm, others));
        const auto number = static_cast<std::size_t>(group - groups.begin());
        if (group == groups.end()) {
            groups.emplace_back(result.arm, others);
            members.emplace_back();
        }
        members[number].push_back(&result);
    }
    std::vector<Crossover> list;
    for (std::vector<const ArmResult*>& sizes : members) {
        if (sizes.size() < 2) continue;
        std::ranges::sort(sizes, {}, [&](const ArmResult* r) { return r->workload.factors.at(along); });
        list.push_back(crossover_of(sizes, along));
        const auto pixels = sizes.front()->workload.factors.find("pixels");
        if (along != "pixels" && pixels != sizes.front()->workload.factors.end())
            list.back().text += fmt::format(", at {:g} pixels", pixels->second);
    }
    return list;
}

}  // namespace tandem
