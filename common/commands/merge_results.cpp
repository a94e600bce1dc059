// tandem merge-results: one result from the results of a plan's items.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "common/commands/help.h"
#include "common/commands/merge.h"
#include "common/commands/plan_items.h"
#include "common/distribution/plan.h"
#include "common/error.h"
#include "common/experiment/campaign.h"
#include "common/files/write_file.h"
#include "common/text.h"
#include "common/validation/report/junit.h"
#include "common/validation/report/report.h"

namespace tandem {

namespace {

using nlohmann::json;

struct ResultsArguments {
    std::string plan, results, output, junit, report, stage;
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

// A share of an image's items, merged into a part of its own by one of many workers.
struct Stage {
    std::uint64_t number = 0, count = 0;  // number of 1 to count
    std::filesystem::path file;

    // Whether it holds item `number` of `items`.
    [[nodiscard]] bool holds(std::uint64_t item, std::uint64_t items) const {
        return (item - 1) * count / items == number - 1;
    }
};

Stage stage_from(const std::string& text, std::uint64_t items, const std::filesystem::path& folder) {
    Stage stage;
    int end = 0;
    if (std::sscanf(text.c_str(), "%9lu/%9lu%n", &stage.number, &stage.count, &end) != 2 ||
        static_cast<std::size_t>(end) != text.size() || stage.number < 1 || stage.number > stage.count ||
        stage.count > items)
        throw InputError(fmt::format(
            "--stage: '{}' is no stage of {} items; write 3/32 for the third of 32, at most one an item", text, items));
    stage.file = folder / fmt::format("stage-{}-of-{}.exr", stage.number, stage.count);
    return stage;
}

// Those that are there; where items were split in several ways, those of the way with most files.
std::vector<Stage> stages_in(const std::filesystem::path& folder, std::uint64_t items) {
    std::map<std::uint64_t, std::vector<Stage>> by_count;
    std::error_code none;
    for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder, none)) {
        Stage stage;
        int end = 0;
        const std::string name = entry.path().filename().string();
        if (std::sscanf(name.c_str(), "stage-%9lu-of-%9lu.exr%n", &stage.number, &stage.count, &end) != 2 ||
            static_cast<std::size_t>(end) != name.size() || stage.count > items)
            continue;
        stage.file = entry.path();
        by_count[stage.count].push_back(stage);
    }
    std::vector<Stage> most;
    for (auto& [count, stages] : by_count)
        if (stages.size() > most.size()) most = std::move(stages);
    return most;
}

// The parts of an image: its stages, and the items that no stage holds. Takes off `found.lacking` what stages hold.
std::vector<std::string> parts_of(
    Found& found, std::uint64_t items, const std::filesystem::path& folder, const std::vector<Stage>& stages) {
    const auto is_held = [&](std::uint64_t item) {
        return std::ranges::any_of(stages, [&](const Stage& stage) { return stage.holds(item, items); });
    };
    std::vector<std::string> parts;
    for (const Stage& stage : stages) parts.push_back(stage.file.string());
    for (const PlanItem& item : found.items)
        if (!is_held(item.number)) parts.push_back(result_file(folder, item).string());
    std::erase_if(found.lacking, is_held);
    return parts;
}

// The scene, case or family that an item is of.
std::string name_of(const PlanItem& item) {
    const std::string& first = item.words.at(1);
    return first.starts_with("--") ? item.words.at(2) : first;
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
    if (all.at("verdict") != "fail") all["verdict"] = all.at("complete").get<bool>() ? "pass" : "undecided";
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

// Reports of cost, each of one scene.
json costs_of_all(const std::vector<json>& reports, const std::vector<std::string>& not_run) {
    if (reports.size() == 1 && not_run.empty()) return reports.front();
    return {{"scenes", reports}, {"not_run", not_run}};
}

void tell_costs(const std::vector<json>& reports) {
    for (const json& report : reports) {
        fmt::print("{} on {} ({}), {}x{}\n", escaped(report.at("scene").get<std::string>()),
            escaped(report.at("device").get<std::string>()), report.at("backend").get<std::string>(),
            report.at("width").get<unsigned>(), report.at("height").get<unsigned>());
        for (const json& sentence : report.at("recommendations"))
            fmt::print("  {}\n", escaped(sentence.get<std::string>()));
    }
}

// Results of bench, each of one family: what one run of all would have written.
BenchResults measured_by_all(const std::vector<json>& reports, const std::vector<std::string>& files) {
    BenchResults all = results_from_json(reports.front(), files.front());
    for (std::size_t i = 1; i < reports.size(); ++i) merge(all, results_from_json(reports[i], files[i]), files[i]);
    return all;
}

// What is said of all items whose results are reports, with the exit status of the whole.
struct Told {
    json report;
    ExitStatus status = ExitStatus::fine;
};

struct Results {
    std::vector<json> reports;
    std::vector<std::string> files, not_run;
    std::vector<int> statuses;
};

Told tell(const std::string& command, const Results& results, const CommandContext& context) {
    // What was measured is not all: for some items the time was too short, or they are not there.
    const bool short_of_time =
        !results.not_run.empty() || std::ranges::find(results.statuses, 3) != results.statuses.end();
    const ExitStatus measured = short_of_time ? ExitStatus::undecided : ExitStatus::fine;
    if (command == "verify") {
        Told told{verdict_of_all(results.reports, results.not_run)};
        told.status = tell_verdicts(told.report);
        return told;
    }
    if (command == "stability") {
        Told told{stability_of_all(results.reports, !results.not_run.empty())};
        told.status = tell_cases(told.report);
        return told;
    }
    if (command == "cost") {
        tell_costs(results.reports);
        return {costs_of_all(results.reports, results.not_run), measured};
    }
    if (command != "bench")
        throw InputError(fmt::format("merge-results: {} has no results that merge; each item's is a file", command));
    BenchResults all = measured_by_all(results.reports, results.files);
    all.command = context.command_line;
    const std::vector<Claim> claims = context.program.claims();
    fmt::print("{}", to_text(all, claims));
    return {to_json(all, claims), measured};
}

void check_options(const ResultsArguments& arguments, const std::string& command, bool is_part) {
    if (!arguments.stage.empty()) {
        if (!is_part) throw InputError("--stage: is for the parts of an image; leave it out");
        if (arguments.allow_gaps || !arguments.output.empty())
            throw InputError("--stage: has a file of its own and no gaps; leave -o and --allow-gaps out");
        return;
    }
    if (is_part == arguments.output.empty())
        throw InputError(arguments.output.empty() ? "merge-results: this plan makes an image; name it with -o"
                                                  : "-o: this plan makes no image; --json takes its result");
    if (command != "verify" && !(arguments.junit.empty() && arguments.report.empty()))
        throw InputError(fmt::format("{}: is for verdicts, but this plan is of {}; leave it out",
            arguments.junit.empty() ? "--report" : "--junit", command));
}

std::vector<std::string> scenes_of(const std::vector<json>& reports) {
    std::vector<std::string> scenes;
    for (const json& report : reports)
        for (const json& scene : report.at("scenes")) scenes.push_back(scene.at("scene").get<std::string>());
    return scenes;
}

ExitStatus merge_results(const ResultsArguments& arguments, const CommandContext& context) {
    const std::vector<PlanItem> items = read_plan(arguments.plan);
    const std::filesystem::path folder = results_folder(arguments.plan, arguments.results);
    const std::string command = items.front().words.front();
    for (const PlanItem& item : items)
        if (item.words.front() != command)
            throw input_error(arguments.plan, "", "has items of several commands", "merge those of one");
    Found found = found_in(items, folder);
    check_options(arguments, command, items.front().is_part());
    MergeArguments merge{
        .parts = {}, .output = arguments.output, .allow_gaps = arguments.allow_gaps, .exposure = arguments.exposure};
    if (!arguments.stage.empty()) {
        const Stage stage = stage_from(arguments.stage, items.size(), folder);
        const auto is_other = [&](std::uint64_t item) { return !stage.holds(item, items.size()); };
        std::erase_if(found.items, [&](const PlanItem& item) { return is_other(item.number); });
        std::erase_if(found.lacking, is_other);
        merge.output = stage.file.string();
        merge.sums = merge.allow_gaps = true;
    }
    if (items.front().is_part())
        merge.parts = parts_of(found, items.size(), folder,
            arguments.stage.empty() ? stages_in(folder, items.size()) : std::vector<Stage>{});
    const bool nothing = items.front().is_part() ? merge.parts.empty() : found.items.empty();
    if (nothing || (!found.lacking.empty() && !arguments.allow_gaps))
        throw input_error(arguments.plan, "",
            fmt::format("{} of {} items have no result in {}: {}", found.lacking.size(), items.size(), folder.string(),
                fmt::join(found.lacking, ", ")),
            "do them with tandem work, or --allow-gaps for what there is");
    check_outputs(context, {{"-o", merge.output, OutputKind::image}}, {arguments.plan});
    if (items.front().is_part()) return merge_parts(merge, context);
    return merge_reports_of(items, folder, {arguments.junit, arguments.report}, context);
}

}  // namespace

ExitStatus merge_reports_of(const std::vector<PlanItem>& items, const std::filesystem::path& folder,
    const VerdictFiles& files, const CommandContext& context) {
    const std::string command = items.front().words.front();
    const Found found = found_in(items, folder);
    Results results;
    std::vector<std::filesystem::path> report_folders;
    for (const PlanItem& item : found.items) {
        results.files.push_back(result_file(folder, item).string());
        const json result = read_result(results.files.back(), item);
        results.reports.push_back(result.at("report"));
        results.statuses.push_back(result.at("status").get<int>());
        report_folders.push_back(result_file(folder, item, "report"));
    }
    for (const std::uint64_t number : found.lacking) results.not_run.push_back(name_of(items[number - 1]));
    std::vector<Output> outputs{{"--junit", files.junit}};
    if (!files.report.empty())
        outputs.push_back({"--report", files.report, OutputKind::folder, report_files(scenes_of(results.reports))});
    check_outputs(context, outputs, results.files);
    const Told told = tell(command, results, context);
    write_json(context, told.report);
    if (!files.junit.empty()) write_text_file(files.junit, junit_xml(command, told.report), context.read);
    if (!files.report.empty()) merge_reports(files.report, told.report, report_folders, context.read);
    return told.status;
}

void add_merge_results_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("merge-results", "Make one result from the results of a plan's items");
    const auto arguments = std::make_shared<ResultsArguments>();
    command->add_option("plan", arguments->plan, "File that tandem plan wrote")->required()->type_name("PLAN");
    command->add_option("--results", arguments->results, "Folder of the results (default: the plan's name in .results)")
        ->type_name("FOLDER");
    command->add_option("-o,--output", arguments->output, "Image to write, for a plan of render")->type_name("FILE");
    command->add_flag("--allow-gaps", arguments->allow_gaps, "Merge even if items have no result");
    command
        ->add_option("--stage", arguments->stage,
            "Merge only the K-th of N shares of an image's parts, beside them. Without it, shares that are there are "
            "taken "
            "in place of their parts")
        ->type_name("K/N")
        ->group(rare_options);
    command->add_option("--exposure", arguments->exposure, "Factor of a PNG's radiance")
        ->check(above_zero(1e9))
        ->capture_default_str();
    command->add_option("--junit", arguments->junit, "Write the verdicts as JUnit XML, as verify does")
        ->type_name("FILE");
    command->add_option("--report", arguments->report, "Write report.json and images to a folder, as verify does")
        ->type_name("FOLDER");
    add_common_options(*command, context,
        "  tandem merge-results plan.jsonl --json verdict.json --report report\n"
        "  tandem merge-results plan.jsonl -o glass.exr\n"
        "  seq 32 | parallel tandem merge-results plan.jsonl --stage {}/32\n"
        "Exit status: that of the command that was planned.");
    command->callback([&context, arguments] {
        context.action = [&context, arguments] { return merge_results(*arguments, context); };
    });
}

}  // namespace tandem
