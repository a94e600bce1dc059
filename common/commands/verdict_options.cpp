#include "common/commands/verdict_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>

#include "common/error.h"
#include "common/files/write_file.h"
#include "common/text.h"
#include "common/validation/report/junit.h"
#include "common/validation/report/report.h"
#include "common/validation/report/verdict_json.h"

namespace tandem {

namespace {

ExitStatus status_of(Verdict verdict) {
    switch (verdict) {
        case Verdict::agree:
            return ExitStatus::fine;
        case Verdict::disagree:
            return ExitStatus::disagree;
        case Verdict::undecided:
            return ExitStatus::undecided;
    }
    return ExitStatus::undecided;
}

}  // namespace

void add_criteria(CLI::App& command, CriteriaArguments& arguments, const Criteria& defaults) {
    command
        .add_option("--margin", arguments.image_margin,
            fmt::format("Agreement needs the image mean within this (default: {})", percent(defaults.margins.image)))
        ->type_name("FRACTION");
    command
        .add_option("--tile-margin", arguments.tile_margin,
            fmt::format("Agreement needs every 16x16 tile within this (default: {})", percent(defaults.margins.tile)))
        ->type_name("FRACTION");
    command.add_option("--report", arguments.report, "Write report.json and images to a folder (see scripts/report)")
        ->type_name("FOLDER");
    command
        .add_option(
            "--junit", arguments.junit, "Write the verdicts as JUnit XML. Disagree is a failure, undecided an error")
        ->type_name("FILE");
}

Criteria criteria_from(const CriteriaArguments& arguments, Criteria criteria) {
    if (!arguments.image_margin.empty()) criteria.margins.image = fraction_from(arguments.image_margin, "--margin");
    if (!arguments.tile_margin.empty()) criteria.margins.tile = fraction_from(arguments.tile_margin, "--tile-margin");
    return criteria;
}

void print_verdict(const SceneVerdict& verdict, bool verbose) {
    fmt::print("{}: {}\n", escaped(verdict.scene), escaped(verdict.sentence));
    const auto said = [&](const std::string& reason) { return verdict.sentence.find(reason) != std::string::npos; };
    if (verdict.verdict != Verdict::agree || verbose)
        for (const std::string& reason : verdict.judgement.reasons)
            if (!said(reason)) fmt::print("    {}\n", escaped(reason));
    if (verdict.forecast_seconds)
        fmt::print("    forecast: decided after about {:.0f} s, if both sides are right\n",
            std::ceil(*verdict.forecast_seconds));
    for (const std::string& note : verdict.notes) fmt::print("    note: {}\n", escaped(note));
    if (verdict.worst && (verdict.verdict == Verdict::disagree || verbose)) {
        const WorstPixel& worst = *verdict.worst;
        fmt::print("    worst pixel: ({}, {}){}{}\n", worst.x, worst.y, worst.reason.empty() ? "" : "; ",
            escaped(worst.reason));
        if (!worst.command.empty()) fmt::print("        {}\n", escaped(worst.command));
    }
    if (!verdict.suspects.empty()) fmt::print("    {}\n", told(verdict.suspects));
    if (verdict.elimination) fmt::print("    {}\n", told(*verdict.elimination));
    if (verdict.missed_form) fmt::print("    {}\n", told(*verdict.missed_form));
    if (verdict.likeness) fmt::print("    {}\n", told(*verdict.likeness));
    if (!verdict.closed_form.skipped.empty())
        fmt::print("    the scene's closed form is left out: {}\n", verdict.closed_form.skipped);
    std::fflush(stdout);
}

void check_outputs(const CriteriaArguments& arguments, const CommandContext& context,
    const std::vector<std::string>& scenes, const std::vector<std::string>& inputs) {
    check_outputs(context,
        {{"--junit", arguments.junit}, {"--report", arguments.report, OutputKind::folder, report_files(scenes)}},
        inputs);
}

ExitStatus conclude(const std::string& command, const std::vector<SceneVerdict>& verdicts,
    const CriteriaArguments& arguments, const CommandContext& context, const std::vector<std::string>& not_run,
    const std::vector<DeviceSelfTest>& self_tests, const LayerMessages& layer) {
    std::vector<Verdict> each;
    const bool failed =
        std::ranges::any_of(verdicts, [](const SceneVerdict& verdict) { return !verdict.failure.empty(); });
    for (const SceneVerdict& verdict : verdicts) each.push_back(verdict.verdict);
    nlohmann::json report = to_json(verdicts, not_run);
    if (context.stop.stop_requested()) report["stopped"] = true;
    report["device_self_tests"] = to_json(self_tests);
    report["validation_layer"] = nlohmann::json::array();
    for (const auto& [scene, text] : layer)
        report["validation_layer"].push_back({{"scene", scene}, {"messages", text}});
    const Verdict all = combined(each, not_run.empty());
    fmt::print("Verdict: {}{}\n", failed && all != Verdict::disagree ? "failed" : name_of(all),
        layer.empty() ? "" : "; failed by messages of the validation layer");
    std::exception_ptr failure;  // one file that cannot be written takes no other with it
    const auto attempt = [&](const std::function<void()>& write) {
        try {
            write();
        } catch (const Error&) {
            if (!failure) failure = std::current_exception();
        }
    };
    attempt([&] { write_json(context, report); });
    if (!arguments.junit.empty())
        attempt([&] { write_text_file(arguments.junit, junit_xml(command, report), context.read); });
    if (!arguments.report.empty())
        attempt([&] { write_report(arguments.report, verdicts, self_tests, not_run, context.read); });
    if (failure) std::rethrow_exception(failure);
    return failed || !layer.empty() ? ExitStatus::disagree : status_of(all);
}

}  // namespace tandem
