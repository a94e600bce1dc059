// Results as a table for other programs: a row for each arm, workload and replicate.
#include <fmt/format.h>

#include <cmath>

#include "common/experiment/results.h"

namespace tandem {

namespace {

// Values between quotes where they hold what ends a value.
std::string in_quotes(const std::string& value) {
    if (value.find_first_of(",\"\r\n") == std::string::npos) return value;
    std::string text;
    for (const char c : value) text.append(c == '"' ? 2 : 1, c);
    return fmt::format("\"{}\"", text);
}

// What is not known stays empty.
std::string finite_or_empty(double value) {
    return std::isfinite(value) ? fmt::format("{:.7g}", value) : std::string();
}

std::string row(std::vector<std::string> values) {
    for (std::string& value : values) value = in_quotes(value);
    return fmt::format("{}\r\n", fmt::join(values, ","));
}

// Family, workload, what grows and how much of it, arm, baseline, clock.
std::vector<std::string> place_of(const std::string& family, const Workload& workload, const std::string& along,
    const std::string& arm, const std::string& baseline, const std::string& clock) {
    const auto work = workload.factors.find(along);
    return {family, workload.name, along, work == workload.factors.end() ? "" : fmt::format("{:.15g}", work->second),
        arm, baseline, clock};
}

std::string row_of(const ArmResult& arm, const std::string& along) {
    std::vector<std::string> values = place_of(arm.family, arm.workload, along, arm.arm, arm.baseline, arm.clock);
    const bool compared = arm.timed() && arm.arm != arm.baseline;
    const auto seconds = arm.seconds.find(arm.clock);
    const auto told = [&](double value) { return compared ? finite_or_empty(value) : std::string(); };
    values.insert(
        values.end(), {"all", std::to_string(arm.log_ratio.blocks),
                          seconds == arm.seconds.end() ? "" : finite_or_empty(1e3 * seconds->second), told(arm.ratio()),
                          told(arm.ratio_low()), told(arm.ratio_high()), told(1e3 * arm.difference.value),
                          told(1e3 * arm.difference.low), told(1e3 * arm.difference.high), told(arm.p_family),
                          compared ? name_of(arm.verdict()) : "", name_of(arm.identity), arm.reason});
    return row(values);
}

std::string row_of(const ReplicateResult& one, const std::string& along) {
    std::vector<std::string> values = place_of(one.family, one.workload, along, one.arm, one.baseline, one.clock);
    values.insert(
        values.end(), {std::to_string(one.replicate), std::to_string(one.blocks), finite_or_empty(1e3 * one.seconds),
                          finite_or_empty(one.ratio), "", "", "", "", "", "", "", "", ""});
    return row(values);
}

}  // namespace

std::string to_csv(const BenchResults& results) {
    std::map<std::string, std::string> along;
    for (const ExperimentSamples& samples : results.samples) along[samples.family] = samples.along;
    std::string text = row({"family", "workload", "work unit", "work [work unit]", "arm", "baseline", "clock",
        "replicate", "blocks [1]", "time a run [ms]", "ratio to baseline [1]", "ratio 95 % low [1]",
        "ratio 95 % high [1]", "difference to baseline [ms]", "difference 95 % low [ms]", "difference 95 % high [ms]",
        "p, Holm over family [1]", "verdict", "result", "reason"});
    const std::vector<ReplicateResult> replicates = replicates_of(results.samples);
    for (const ArmResult& arm : analyse(results.samples)) {
        for (const ReplicateResult& one : replicates)
            if (one.family == arm.family && one.workload.name == arm.workload.name && one.arm == arm.arm)
                text += row_of(one, along[arm.family]);
        text += row_of(arm, along[arm.family]);
    }
    return text;
}

}  // namespace tandem
