#include "common/experiment/claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/statistics/multiple_tests.h"
#include "common/statistics/paired_effect.h"

namespace tandem {

namespace {

// The log of a ratio of two arms with what its uncertainty is, or why there is none.
struct Measured {
    std::optional<PairedEffect> effect = {};
    std::string reason = {};
    std::string workload = {}, clock = {};
};

// "samples=12": the first workload with that factor.
std::string workload_with(const Contrast& contrast, const std::vector<ExperimentSamples>& samples) {
    const auto equals = std::ranges::find(contrast.workload, '=');
    const std::string factor(contrast.workload.begin(), equals);
    const double value = std::stod(std::string(equals + 1, contrast.workload.end()));
    for (const ExperimentSamples& one : samples) {
        const auto found = one.workload.factors.find(factor);
        if (one.family == contrast.family && found != one.workload.factors.end() && found->second == value)
            return one.workload.name;
    }
    return {};
}

std::string workload_of(const Contrast& contrast, const std::vector<ExperimentSamples>& samples) {
    const ExperimentSamples* best = nullptr;
    const bool smallest = contrast.workload == "smallest";
    if (std::ranges::find(contrast.workload, '=') != contrast.workload.end()) return workload_with(contrast, samples);
    if (!smallest && !contrast.workload.empty() && contrast.workload != "largest") return contrast.workload;
    const auto size = [](const ExperimentSamples& s) {
        const auto found = s.workload.factors.find(s.along);
        return found == s.workload.factors.end() ? 0.0 : found->second;
    };
    for (const ExperimentSamples& one : samples)
        if (one.family == contrast.family &&
            (best == nullptr || (smallest ? size(one) < size(*best) : size(one) > size(*best))))
            best = &one;
    return best == nullptr ? "" : best->workload.name;
}

const ArmSamples* arm_of(const ExperimentSamples& samples, const std::string& name) {
    const auto found = std::ranges::find(samples.arms, name, &ArmSamples::arm);
    return found == samples.arms.end() ? nullptr : &*found;
}

// Why the arm was not timed; empty if it was.
std::string missing(const ArmSamples* arm, const std::string& name, const std::string& clock) {
    if (arm == nullptr) return "the arm " + name + " was not run";
    if (arm->identity == Identity::not_applicable || arm->identity == Identity::differs)
        return name + ": " + arm->reason;
    if (!arm->seconds.contains(clock)) return name + " has no clock '" + clock + "' here";
    return {};
}

Measured measure(const Contrast& contrast, const std::vector<ExperimentSamples>& samples) {
    const std::string workload = workload_of(contrast, samples);
    ProcessBlocks logs;
    std::string clock;
    std::string reason = "the family " + contrast.family + " was not run";
    if (!workload.empty()) reason += " at " + workload;
    for (const ExperimentSamples& one : samples) {
        if (one.family != contrast.family || one.workload.name != workload) continue;
        clock = contrast.clock.empty() ? one.clock : contrast.clock;
        const std::string against = contrast.against.empty() ? one.arms.front().arm : contrast.against;
        const ArmSamples *own = arm_of(one, contrast.arm), *other = arm_of(one, against);
        reason = missing(own, contrast.arm, clock);
        if (reason.empty()) reason = missing(other, against, clock);
        if (!reason.empty()) return {std::nullopt, reason};
        const auto &a = own->seconds.at(clock), &b = other->seconds.at(clock);
        std::vector<double> blocks;
        for (std::size_t i = warm_up_blocks(one); i < std::min(a.size(), b.size()); ++i)
            if (a[i] > 0.0 && b[i] > 0.0) blocks.push_back(std::log(a[i] / b[i]));
        if (!blocks.empty()) logs.push_back(std::move(blocks));
    }
    if (logs.empty()) return {std::nullopt, reason.empty() ? "no readings" : reason};
    return {paired_effect(logs), {}, workload, clock};
}

// The difference of two independent effects: errors add in squares; degrees of freedom after Welch and Satterthwaite.
PairedEffect difference_of(const PairedEffect& a, const PairedEffect& b) {
    const MeanDifference difference = welch(
        {b.value, b.standard_error * b.standard_error, b.dof}, {a.value, a.standard_error * a.standard_error, a.dof});
    PairedEffect result;
    result.value = difference.difference;
    result.standard_error = difference.standard_error;
    result.dof = difference.dof;
    result.p = difference.p_value();
    const Interval interval = difference.interval(0.025);
    result.low = interval.low;
    result.high = interval.high;
    result.blocks = std::min(a.blocks, b.blocks);
    result.processes = std::min(a.processes, b.processes);
    return result;
}

ClaimResult measured_claim(const Claim& claim, const std::vector<ExperimentSamples>& samples) {
    ClaimResult result;
    result.claim = claim;
    Measured measured = measure(claim.contrast, samples);
    if (measured.effect && claim.over) {
        const Measured over = measure(*claim.over, samples);
        measured.reason = over.reason;
        if (over.effect)
            measured.effect = difference_of(*measured.effect, *over.effect);
        else
            measured.effect.reset();
    }
    result.reason = measured.reason;
    if (!measured.effect) return result;
    const PairedEffect& effect = *measured.effect;
    result.workload = measured.workload;
    result.clock = measured.clock;
    result.verdict = ClaimVerdict::below_resolution;
    result.effect = std::expm1(effect.value);
    result.low = std::expm1(effect.low);
    result.high = std::expm1(effect.high);
    result.smallest_detectable = std::expm1(smallest_detectable(effect));
    result.p = effect.p;
    return result;
}

// A directional claim, the effect counted in the claimed direction.
ClaimVerdict judge_direction(double low, double high, double negligible, bool significant) {
    if (high < negligible) return ClaimVerdict::refuted;
    return low > 0.0 && significant ? ClaimVerdict::confirmed : ClaimVerdict::below_resolution;
}

ClaimVerdict judge(const ClaimResult& result, bool significant) {
    const double negligible = result.claim.negligible_relative;
    switch (result.claim.predicted) {
        case Predicted::less:
            return judge_direction(-result.high, -result.low, negligible, significant);
        case Predicted::more:
            return judge_direction(result.low, result.high, negligible, significant);
        case Predicted::no_difference:
            if (equivalent({result.low, result.high}, negligible)) return ClaimVerdict::confirmed;
            if (significant && (result.low > negligible || result.high < -negligible)) return ClaimVerdict::refuted;
            break;
        case Predicted::no_more:
            if (result.high < negligible) return ClaimVerdict::confirmed;
            if (significant && result.low > negligible) return ClaimVerdict::refuted;
            break;
    }
    return ClaimVerdict::below_resolution;
}

}  // namespace

const char* name_of(ClaimVerdict verdict) {
    constexpr std::array<const char*, 4> names{"confirmed", "refuted", "below-resolution", "not-applicable"};
    return names[static_cast<std::size_t>(verdict)];
}

std::vector<ClaimResult> judge_claims(const std::vector<Claim>& claims, const std::vector<ExperimentSamples>& samples) {
    std::vector<ClaimResult> results;
    std::vector<double> p_values;
    std::vector<std::size_t> tested;
    for (const Claim& claim : claims) {
        results.push_back(measured_claim(claim, samples));
        if (results.back().verdict == ClaimVerdict::not_applicable) continue;
        tested.push_back(results.size() - 1);
        p_values.push_back(results.back().p);
    }
    const std::vector<double> adjusted = holm_adjusted(p_values);
    constexpr double alpha = 0.05;
    for (std::size_t i = 0; i < tested.size(); ++i) {
        ClaimResult& result = results[tested[i]];
        result.p_family = adjusted[i];
        result.verdict = judge(result, adjusted[i] <= alpha);
    }
    return results;
}

}  // namespace tandem
