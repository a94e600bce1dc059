#include <fmt/format.h>

#include <algorithm>

#include "common/experiment/results.h"

namespace tandem {

namespace {

std::string line_of(const ArmResult& arm) {
    const auto total = arm.seconds.find(arm.clock);
    const std::string time =
        total == arm.seconds.end() ? std::string(11, ' ') : fmt::format("{:8.4g} ms", 1e3 * total->second);
    if (!arm.timed()) return fmt::format("    {:18} {}  {}: {}\n", arm.arm, time, name_of(arm.identity), arm.reason);
    if (arm.arm == arm.baseline) {
        const auto [lowest, highest] = std::ranges::minmax(arm.replicate_seconds);
        return fmt::format("    {:18} {}  baseline; replicates take {:.4g} to {:.4g} ms\n", arm.arm, time, 1e3 * lowest,
            1e3 * highest);
    }
    return fmt::format("    {:18} {}  {:6.3f} times ({:.3f} to {:.3f}){}  {} blocks, {}\n", arm.arm, time, arm.ratio(),
        arm.ratio_low(), arm.ratio_high(), arm.p_family <= 0.05 ? " *" : "  ", arm.log_ratio.blocks,
        name_of(arm.identity));
}

// What is said of an arm of a user's library: there are no claims to judge it by.
std::string verdict_line(const ArmResult& arm) {
    const std::string effect = fmt::format("{:+.1f} % ({:+.1f} to {:+.1f})", 100.0 * (arm.ratio() - 1.0),
        100.0 * (arm.ratio_low() - 1.0), 100.0 * (arm.ratio_high() - 1.0));
    switch (arm.verdict()) {
        case Change::faster:
        case Change::slower:
            return fmt::format("  {} is {} than {} at {}: {}\n", arm.arm, name_of(arm.verdict()), arm.baseline,
                arm.workload.name, effect);
        case Change::same:
            return fmt::format("  {} takes as long as {} at {}, to within {:g} %: {}\n", arm.arm, arm.baseline,
                arm.workload.name, 100.0 * negligible_change, effect);
        case Change::ambiguous:
            break;
    }
    return fmt::format("  {} beside {} at {}: not known well enough, {}; give more --time\n", arm.arm, arm.baseline,
        arm.workload.name, effect);
}

// Empty for results from before the clocks were related.
std::string clocks_line(const nlohmann::json& device) {
    if (!device.contains("calibrated_clocks")) return {};
    const nlohmann::json& clocks = device.at("calibrated_clocks");
    if (clocks.contains("not_applicable"))
        return fmt::format(
            "Device's clock beside the host's: not applicable, {}\n", clocks.at("not_applicable").get<std::string>());
    return fmt::format("Device's clock beside the host's: known to {:.3g} us (median; greatest {:.3g})\n",
        1e-3 * clocks.value("deviation_nanoseconds_median", 0.0),
        1e-3 * clocks.value("deviation_nanoseconds_greatest", 0.0));
}

// Whether what refused the baseline refused the whole family.
bool without_baseline(const std::vector<ArmResult>& arms, const ArmResult& arm) {
    return std::ranges::any_of(arms, [&](const ArmResult& other) {
        return other.family == arm.family && other.workload.name == arm.workload.name && other.arm == arm.baseline &&
               other.identity == Identity::not_applicable;
    });
}

}  // namespace

std::string to_text(const BenchResults& results, const std::vector<Claim>& claims) {
    std::string text = fmt::format("{}, {} {}\n", results.device.value("name", "?"),
        results.device.value("driver_name", ""), results.device.value("driver_version", ""));
    if (!results.empty_submissions.empty()) {
        std::vector<double> sorted = results.empty_submissions;
        std::ranges::sort(sorted);
        text += fmt::format("A submission of nothing and its wait: {:.3g} ms (median; never subtracted)\n",
            1e3 * sorted[sorted.size() / 2]);
    }
    text += clocks_line(results.device);
    const std::vector<ArmResult> arms = analyse(results.samples);
    for (const nlohmann::json& family : results.families) {
        const std::string name = family.at("name");
        text += fmt::format("\n{}: {}\n", name, family.at("question").get<std::string>());
        // Stored results may know no base.
        if (const std::string base = family.value("base", ""); !base.empty())
            text += fmt::format("  base: {}; compared by '{}'\n", base, family.at("clock").get<std::string>());
        std::string workload;
        for (const ArmResult& arm : arms) {
            if (arm.family != name) continue;
            if (arm.workload.name != workload) text += "  " + arm.workload.name + "\n";
            workload = arm.workload.name;
            const bool refused = without_baseline(arms, arm);
            if (!refused)
                text += line_of(arm);
            else if (arm.arm == arm.baseline)
                text += fmt::format("    not applicable: {}\n", arm.reason);
        }
        for (const Crossover& crossover : crossovers(arms, family.at("along"), name))
            text += fmt::format("  {}: {}\n", crossover.arm, crossover.text);
    }
    text += "\nTimes the baseline's time, 95 % interval; *: significant, Holm over the family.\n";
    if (results.device.contains("arm_library_hash")) {
        text += "\nVerdict on this device\n";
        for (const ArmResult& arm : arms)
            if (arm.timed() && arm.arm != arm.baseline) text += verdict_line(arm);
    }
    const std::vector<ClaimResult> verdicts = judge_claims(claims, results.samples);
    const auto measured = [](const ClaimResult& claim) { return claim.verdict != ClaimVerdict::not_applicable; };
    if (std::ranges::any_of(verdicts, measured)) text += "\nClaims on this device\n";
    for (const ClaimResult& claim : verdicts) {
        if (!measured(claim)) continue;
        text +=
            fmt::format("  {:12} {:16} {:+.1f} % ({:+.1f} to {:+.1f}); smallest seen {:.1f} %: {} [{}; {}, clock {}]\n",
                claim.claim.id, name_of(claim.verdict), 100.0 * claim.effect, 100.0 * claim.low, 100.0 * claim.high,
                100.0 * claim.smallest_detectable, claim.claim.text, claim.claim.source, claim.workload, claim.clock);
    }
    return text;
}

}  // namespace tandem
