// tandem merge-results: what the items of a plan say together.
#include <fmt/format.h>

#include <algorithm>

#include "common/commands/merge.h"
#include "common/distribution/plan.h"
#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

using nlohmann::json;

struct ResultsArguments {
    std::string plan, results, output;
    bool allow_gaps = false;
    double exposure = 1.0;
};

// Those of the items that have a result; the others' numbers.
struct Found {
    std::vector<PlanItem> items;
    std::vector<std::uint64_t> lacking;
};

Found found_in(const std::vector<PlanItem>& items, const std::filesystem::path& folder) {
    Found found;
    for (const PlanItem& item : items)
        if (std::filesystem::exists(result_file(folder, item)))
            found.items.push_back(item);
        else
            found.lacking.push_back(item.number);
    return found;
}

void append(json& list, const json& more) {
    for (const json& one : more) list.push_back(one);
}

// Reports of verify, each of one scene.
json verdict_of_all(const std::vector<json>& reports, const std::vector<std::string>& not_run) {
    json all{{"scenes", json::array()}, {"not_run", not_run}, {"device_self_tests", json::array()},
        {"validation_layer", json::array()}, {"device", reports.front().at("device")}};
    bool disagree = false, undecided = !not_run.empty();
    for (const json& report : reports) {
        append(all["scenes"], report.at("scenes"));
        append(all["validation_layer"], report.at("validation_layer"));
        for (const json& test : report.at("device_self_tests"))
            if (std::ranges::find(all["device_self_tests"], test) == all["device_self_tests"].end())
                all["device_self_tests"].push_back(test);
        for (const json& scene : report.at("scenes")) {
            disagree = disagree || scene.at("verdict") == "disagree" || !scene.at("failure").is_null();
            undecided = undecided || scene.at("verdict") == "undecided";
        }
    }
    all["verdict"] = disagree ? "disagree" : undecided ? "undecided" : "agree";
    return all;
}

ExitStatus tell_verdicts(const json& all) {
    for (const json& scene : all.at("scenes"))
        fmt::print("{}: {}\n", escaped(scene.at("scene").get<std::string>()),
            escaped(scene.at("sentence").get<std::string>()));
    for (const json& layer : all.at("validation_layer"))
        fmt::print("{}: the Vulkan validation layer reports: {}\n", escaped(layer.at("scene").get<std::string>()),
            escaped(layer.at("messages").get<std::string>()));
    const auto verdict = all.at("verdict").get<std::string>();
    fmt::print("Verdict: {}{}\n", verdict,
        all.at("validation_layer").empty() ? "" : "; failed by messages of the validation layer");
    if (verdict == "disagree" || !all.at("validation_layer").empty()) return ExitStatus::disagree;
    return verdict == "agree" ? ExitStatus::fine : ExitStatus::undecided;
}

// Reports of stability, each of one case.
json stability_of_all(const std::vector<json>& reports, bool lacking) {
    json all = reports.front();
    for (std::size_t i = 1; i < reports.size(); ++i) {
        append(all["cases"], reports[i].at("cases"));
        for (const json& skipped : reports[i].at("unsupported"))
            if (std::ranges::find(all["unsupported"], skipped) == all["unsupported"].end())
                all["unsupported"].push_back(skipped);
        for (const char* const sum : {"rays_aimed_at_seams", "arms_not_run"})
            all[sum] = all.at(sum).get<std::uint64_t>() + reports[i].at(sum).get<std::uint64_t>();
        all["complete"] = all.at("complete").get<bool>() && reports[i].at("complete").get<bool>();
        if (reports[i].at("verdict") == "fail") all["verdict"] = "fail";
    }
    all["complete"] = all.at("complete").get<bool>() && !lacking;
    return all;
}

ExitStatus tell_cases(const json& all) {
    std::size_t failed = 0;
    for (const json& one : all.at("cases"))
        if (one.at("outcome") == "fail") {
            ++failed;
            fmt::print("{} {} {} {}: failed\n", escaped(one.at("id").get<std::string>()),
                one.at("backend").get<std::string>(), one.at("precision").get<std::string>(),
                one.at("kernel").get<std::string>());
        }
    fmt::print("{} arms, {} failed{}\nVerdict: {}\n", all.at("cases").size(), failed,
        all.at("complete").get<bool>() ? "" : ", others not run", all.at("verdict").get<std::string>());
    if (all.at("verdict") == "fail") return ExitStatus::disagree;
    return all.at("complete").get<bool>() ? ExitStatus::fine : ExitStatus::undecided;
}

ExitStatus merge_results(const ResultsArguments& arguments, const CommandContext& context) {
    const std::vector<PlanItem> items = read_plan(arguments.plan);
    const std::filesystem::path folder = results_folder(arguments.plan, arguments.results);
    const std::string command = items.front().words.front();
    for (const PlanItem& item : items)
        if (item.words.front() != command)
            throw input_error(arguments.plan, "", "has items of several commands", "merge those of one");
    const Found found = found_in(items, folder);
    if (found.items.empty() || (!found.lacking.empty() && !arguments.allow_gaps))
        throw input_error(arguments.plan, "",
            fmt::format("{} of {} items have no result in {}: {}", found.lacking.size(), items.size(), folder.string(),
                fmt::join(found.lacking, ", ")),
            "do them with tandem work, or --allow-gaps for what there is");
    if (items.front().is_part() == arguments.output.empty())
        throw InputError(arguments.output.empty() ? "merge-results: this plan makes an image; name it with -o"
                                                  : "-o: this plan makes no image; --json takes its result");
    if (items.front().is_part()) {
        MergeArguments merge{.parts = {},
            .output = arguments.output,
            .allow_gaps = arguments.allow_gaps,
            .exposure = arguments.exposure};
        for (const PlanItem& item : found.items) merge.parts.push_back(result_file(folder, item).string());
        return merge_parts(merge, context);
    }
    std::vector<std::string> inputs{arguments.plan}, not_run;
    std::vector<json> reports;
    for (const PlanItem& item : found.items) {
        inputs.push_back(result_file(folder, item).string());
        reports.push_back(read_result(inputs.back(), item).at("report"));
    }
    for (const std::uint64_t number : found.lacking) not_run.push_back(items[number - 1].words.at(1));
    check_outputs(context, {}, inputs);
    const json all =
        command == "verify" ? verdict_of_all(reports, not_run) : stability_of_all(reports, !not_run.empty());
    const ExitStatus status = command == "verify" ? tell_verdicts(all) : tell_cases(all);
    write_json(context, all);
    return status;
}

}  // namespace

void add_merge_results_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("merge-results", "Make one result of those of a plan's items");
    const auto arguments = std::make_shared<ResultsArguments>();
    command->add_option("plan", arguments->plan, "File that tandem plan wrote")->required()->type_name("PLAN");
    command->add_option("--results", arguments->results, "Folder of the results (default: the plan's name in .results)")
        ->type_name("FOLDER");
    command->add_option("-o,--output", arguments->output, "Image to write, where the plan is of render")
        ->type_name("FILE");
    command->add_flag("--allow-gaps", arguments->allow_gaps, "Take what there is, where items have no result");
    command->add_option("--exposure", arguments->exposure, "Factor of a PNG's radiance")
        ->check(above_zero(1e9))
        ->capture_default_str();
    add_common_options(*command, context,
        "  tandem merge-results plan.jsonl --json verdict.json\n"
        "  tandem merge-results plan.jsonl -o glass.exr\n"
        "Exit status: that of the command that was planned.");
    command->callback([&context, arguments] {
        context.action = [&context, arguments] { return merge_results(*arguments, context); };
    });
}

}  // namespace tandem
