#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/experiment/results.h"
#include "common/files/read_file.h"
#include "common/text.h"

namespace tandem {

namespace {

using nlohmann::json;

// Seven significant digits: more than any clock has, and half the bytes.
double shortened(double value) {
    if (!std::isfinite(value)) return value;
    return std::stod(fmt::format("{:.7g}", value));
}

json finite_or_null(double value) { return std::isfinite(value) ? json(shortened(value)) : json(); }

json milliseconds(const std::vector<double>& seconds) {
    json list = json::array();
    for (const double value : seconds) list.push_back(shortened(1e3 * value));
    return list;
}

json to_json(const Workload& workload) { return {{"name", workload.name}, {"factors", workload.factors}}; }

json to_json(const ExperimentSamples& samples) {
    json arms = json::array();
    for (const ArmSamples& arm : samples.arms) {
        json readings = json::object();
        for (const auto& [clock, seconds] : arm.seconds) readings[clock] = milliseconds(seconds);
        arms.push_back({{"arm", arm.arm}, {"text", arm.text}, {"identity", name_of(arm.identity)},
            {"reason", arm.reason}, {"milliseconds", readings}});
    }
    return {{"family", samples.family}, {"clock", samples.clock}, {"along", samples.along},
        {"workload", to_json(samples.workload)}, {"seed", samples.seed}, {"runs_a_reading", samples.runs_a_reading},
        {"ended", samples.ended}, {"made_seconds", shortened(samples.made_seconds)},
        {"seconds", shortened(samples.seconds)}, {"arms", arms}};
}

json to_json(const ArmResult& result) {
    json entry{{"family", result.family}, {"arm", result.arm}, {"text", result.text}, {"baseline", result.baseline},
        {"workload", to_json(result.workload)}, {"clock", result.clock}, {"unit", "ratio of times, arm over baseline"},
        {"identical", result.identity == Identity::identical}, {"identity", name_of(result.identity)},
        {"samples", result.log_ratio.blocks}, {"processes", result.log_ratio.processes},
        {"warm_up_blocks", result.warm_up}};
    if (!result.reason.empty()) entry["reason"] = result.reason;
    json clocks = json::object();
    for (const auto& [clock, seconds] : result.seconds) clocks[clock] = finite_or_null(1e3 * seconds);
    entry["milliseconds"] = clocks;
    entry["replicate_milliseconds"] = milliseconds(result.replicate_seconds);
    if (!result.timed()) return entry;
    entry["ratio"] = finite_or_null(result.ratio());
    entry["ratio_low"] = finite_or_null(result.ratio_low());
    entry["ratio_high"] = finite_or_null(result.ratio_high());
    if (result.arm == result.baseline) return entry;
    entry["verdict"] = name_of(result.verdict());
    entry["p"] = result.log_ratio.p;
    entry["p_family"] = result.p_family;
    entry["smallest_detectable_relative"] = finite_or_null(result.smallest_detectable_relative());
    entry["difference_milliseconds"] = finite_or_null(1e3 * result.difference.value);
    entry["difference_milliseconds_low"] = finite_or_null(1e3 * result.difference.low);
    entry["difference_milliseconds_high"] = finite_or_null(1e3 * result.difference.high);
    return entry;
}

json to_json(const ClaimResult& result) {
    json entry{{"id", result.claim.id}, {"text", result.claim.text}, {"source", result.claim.source},
        {"rule", result.claim.rule}, {"family", result.claim.contrast.family}, {"arm", result.claim.contrast.arm},
        {"against", result.claim.contrast.against}, {"verdict", name_of(result.verdict)},
        {"negligible_relative", result.claim.negligible_relative}};
    const bool measured = result.verdict != ClaimVerdict::not_applicable;
    const auto figure = [&](double value) { return measured ? finite_or_null(value) : json(); };
    entry["effect"] = figure(result.effect);
    entry["effect_low"] = figure(result.low);
    entry["effect_high"] = figure(result.high);
    entry["smallest_detectable"] = figure(result.smallest_detectable);
    entry["p_family"] = figure(result.p_family);
    if (measured) {
        entry["workload"] = result.workload;
        entry["clock"] = result.clock;
    } else {
        entry["reason"] = result.reason;
    }
    return entry;
}

json to_json(const Crossover& crossover) {
    json entry{{"family", crossover.family}, {"arm", crossover.arm}, {"along", crossover.along},
        {"exists", crossover.exists}, {"text", crossover.text}};
    if (crossover.exists) {
        entry["faster_above"] = crossover.faster_above;
        entry["below"] = crossover.below;
        entry["at"] = finite_or_null(crossover.at);
        entry["above"] = crossover.above;
    }
    return entry;
}

json floor_json(std::vector<double> seconds) {
    if (seconds.empty()) return nullptr;
    std::ranges::sort(seconds);
    const auto at = [&](double share) {
        return shortened(1e3 * seconds[static_cast<std::size_t>(share * static_cast<double>(seconds.size() - 1))]);
    };
    return {{"text", "a submission of nothing, and its wait"}, {"count", seconds.size()},
        {"median_milliseconds", at(0.5)}, {"low_milliseconds", at(0.05)}, {"high_milliseconds", at(0.95)},
        {"milliseconds", milliseconds(seconds)}};
}

std::vector<double> seconds_from(const json& list) {
    std::vector<double> seconds;
    for (const json& value : list) seconds.push_back(1e-3 * value.get<double>());
    return seconds;
}

ExperimentSamples samples_from(const json& entry) {
    ExperimentSamples samples;
    samples.family = entry.at("family");
    samples.clock = entry.at("clock");
    samples.along = entry.at("along");
    samples.workload = {entry.at("workload").at("name"), entry.at("workload").at("factors")};
    samples.seed = entry.at("seed");
    samples.runs_a_reading = entry.at("runs_a_reading");
    samples.ended = entry.at("ended");
    samples.made_seconds = entry.at("made_seconds");
    samples.seconds = entry.at("seconds");
    for (const json& arm : entry.at("arms")) {
        ArmSamples own{arm.at("arm"), arm.at("text"), identity_named(arm.at("identity")), arm.at("reason"), {}};
        for (const auto& [clock, list] : arm.at("milliseconds").items()) own.seconds[clock] = seconds_from(list);
        samples.arms.push_back(std::move(own));
    }
    if (samples.arms.empty()) throw InputError("an experiment without arms");
    return samples;
}

}  // namespace

json texts_of(const Family& family) {
    return {{"name", family.name}, {"question", family.question}, {"hypothesis", family.hypothesis},
        {"source", family.source}, {"held", family.held}, {"base", family.base}, {"clock", family.clock},
        {"along", family.along}};
}

json to_json(const BenchResults& results, const std::vector<Claim>& claims) {
    const std::vector<ArmResult> arms = analyse(results.samples);
    json report{{"version", results_version}, {"device", results.device}, {"command", results.command},
        {"git", results.git}, {"scene", results.scene}, {"floor", floor_json(results.empty_submissions)},
        {"families", results.families}, {"arms", json::array()}, {"crossovers", json::array()},
        {"claims", json::array()}, {"raw", json::array()}};
    for (const ArmResult& arm : arms) report["arms"].push_back(to_json(arm));
    for (const json& family : results.families)
        for (const Crossover& crossover : crossovers(arms, family.at("along"), family.at("name")))
            report["crossovers"].push_back(to_json(crossover));
    for (const ClaimResult& claim : judge_claims(claims, results.samples)) report["claims"].push_back(to_json(claim));
    for (const ExperimentSamples& samples : results.samples) report["raw"].push_back(to_json(samples));
    report["raw_checksum"] = hash_of(report["raw"].dump());
    return report;
}

BenchResults results_from_json(const json& report, const std::string& file) {
    try {
        if (report.at("version") != results_version)
            throw input_error(file, "/version", "is of another version", "run tandem bench again");
        if (report.contains("left_out"))
            throw input_error(file, "/raw", "lacks raw readings, which were left out as it was stored",
                "measure again, or give the file that tandem bench --json wrote");
        // Results that were stored before there were checksums have none.
        if (report.contains("raw_checksum") && report.at("raw_checksum") != hash_of(report.at("raw").dump()))
            throw input_error(
                file, "/raw", "is damaged: its checksum is of something else", "restore the file, or measure again");
        BenchResults results;
        results.device = report.at("device");
        results.command = report.at("command");
        results.git = report.at("git");
        results.scene = report.at("scene");
        if (!report.at("floor").is_null())
            results.empty_submissions = seconds_from(report.at("floor").at("milliseconds"));
        for (const json& family : report.at("families")) results.families.push_back(family);
        for (const json& entry : report.at("raw")) results.samples.push_back(samples_from(entry));
        return results;
    } catch (const json::exception& error) {
        throw input_error(file, "", std::string("is no result of tandem bench (") + error.what() + ")",
            "give a file that tandem bench --json wrote");
    }
}

BenchResults load_results(const std::string& file) {
    const json report = json::parse(read_file(file), nullptr, false);
    if (report.is_discarded()) throw input_error(file, "", "is no JSON", "give a file that tandem bench --json wrote");
    return results_from_json(report, file);
}

}  // namespace tandem
