// tandem work: one item of a plan done, for engines that run farms of jobs.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "common/commands/command.h"
#include "common/commands/plan_items.h"
#include "common/commands/shipped_files.h"
#include "common/deadline.h"
#include "common/error.h"
#include "common/external/child.h"
#include "common/stopwatch.h"
#include "common/text.h"

namespace tandem {

namespace {

using Words = std::vector<std::string>;

struct WorkArguments {
    std::string plan, results;
    std::uint64_t item = 0;
    double limit = 0.0;
};

std::string last_line_of(const std::filesystem::path& log) {
    std::ifstream file(log);
    std::string last;
    for (std::string line; std::getline(file, line);)
        if (!line.empty()) last = line;
    return last.empty() ? "it wrote nothing" : last;
}

// Whether the report of an item is one of all its work, not of what a stop left of it.
bool is_whole(const nlohmann::json& report, const std::string& command) {
    if (!report.is_object() || report.value("stopped", false)) return false;
    if (command != "verify") return report.contains(command == "stability" ? "cases" : "arms");
    return report.at("not_run").empty();  // a scene whose own --time ended it has the verdict of its last look
}

// What the item's command writes, beside what it was planned with. The sums of an image are kept on the way, so that a
// lost item goes on from there.
Words written_by(const PlanItem& item, const std::filesystem::path& folder) {
    const std::string unchecked = result_file(folder, item, "unchecked").string();
    if (item.is_part()) return {"--output", unchecked, "--resume", result_file(folder, item, "sums").string()};
    if (item.words.front() == "verify")
        return {"--json", unchecked, "--report", result_file(folder, item, "report").string()};
    return {"--json", unchecked};
}

StoppedError stopped(const PlanItem& item) {
    return StoppedError(fmt::format("item {} was stopped and has no result", item.number));
}

// The exit status of the item's command. Throws StoppedError.
int run_item(const PlanItem& item, const std::filesystem::path& folder, const std::function<std::string()>& over,
    const CommandContext& context) {
    Words words{"/proc/self/exe"};
    for (const Words& more : {item.words, written_by(item, folder)})
        words.insert(words.end(), more.begin(), more.end());
    std::filesystem::remove(
        result_file(folder, item, "unchecked"));  // what an earlier attempt left is no result of this
    Child child(words, result_file(folder, item, "log"), false);
    constexpr double poll_seconds = 0.05;  // how late a stop may be heeded
    while (!child.ended_within(poll_seconds)) {
        if (context.stop.stop_requested()) throw stopped(item);
        if (const std::string reason = over(); !reason.empty()) throw StoppedError(reason);
    }
    return child.exit_status();
}

// Puts the result of an item in its place.
void keep_result(const PlanItem& item, const std::filesystem::path& folder, int status, const CommandContext& context) {
    const std::filesystem::path unchecked = result_file(folder, item, "unchecked"), result = result_file(folder, item);
    if (item.is_part()) {
        std::filesystem::rename(unchecked, result);
        std::filesystem::remove(result_file(folder, item, "sums"));
        return;
    }
    const nlohmann::json report = nlohmann::json::parse(std::ifstream(unchecked), nullptr, false);
    if (!is_whole(report, item.words.front())) throw stopped(item);
    write_text_file(result,
        nlohmann::json{{"item", to_json(item)}, {"status", status}, {"report", report}}.dump() + "\n", context.read);
    std::filesystem::remove(unchecked);
}

ExitStatus tell_result(
    const PlanItem& item, const std::filesystem::path& result, const CommandContext& context, const std::string& how) {
    fmt::print("item {}: {}{}\n", item.number, escaped(result.string()), how);
    write_json(context, {{"item", item.number}, {"result", result.string()}});
    return ExitStatus::fine;
}

ExitStatus work(const WorkArguments& arguments, const CommandContext& context) {
    const std::vector<PlanItem> items = read_plan(arguments.plan);
    if (arguments.item > items.size())
        throw input_error(arguments.plan, "", fmt::format("has {} items and no item {}", items.size(), arguments.item),
            "name one of them");
    const PlanItem& item = items[arguments.item - 1];
    if (item.version != git_version())
        throw input_error(arguments.plan, "",
            fmt::format("is by version {} of the program, not {}", item.version, git_version()), "make it again");
    std::vector<std::string> inputs{arguments.plan};
    if (item.words.front() != "stability" && item.words.front() != "bench")
        inputs.push_back(shipped_file(item.words[1]));
    check_outputs(context, {}, inputs);
    const std::filesystem::path folder = results_folder(arguments.plan, arguments.results);
    std::error_code ignored;
    std::filesystem::create_directories(folder, ignored);
    const std::filesystem::path result = result_file(folder, item);
    if (std::filesystem::exists(result)) {
        if (!item.is_part()) static_cast<void>(read_result(result, item));
        return tell_result(item, result, context, ", which was there");
    }
    check_outputs(context, {{"--results", result, item.is_part() ? OutputKind::image : OutputKind::text}}, {});
    const Stopwatch watch;
    const auto over = [&]() -> std::string {
        if (arguments.limit <= 0.0 || watch.seconds() <= arguments.limit) return "";
        return fmt::format("item {} had not ended after the {:g} s of --limit; it was ended, and has no result",
            item.number, arguments.limit);
    };
    const ItemOutcome outcome = do_item(item, folder, over, context);
    if (outcome.has_result) return tell_result(item, result, context, "");
    fmt::print(
        stderr, "tandem: item {} has no result (status {}): {}\n", item.number, outcome.status, escaped(outcome.told));
    return outcome.status >= 2 && outcome.status <= 4 ? static_cast<ExitStatus>(outcome.status) : ExitStatus::disagree;
}

}  // namespace

ItemOutcome do_item(const PlanItem& item, const std::filesystem::path& folder, const std::function<std::string()>& over,
    const CommandContext& context) {
    const int status = run_item(item, folder, over, context);
    const bool has_result = status == 0 || (!item.is_part() && (status == 1 || status == 3));
    if (!has_result || !std::filesystem::exists(result_file(folder, item, "unchecked")))
        return {false, status, last_line_of(result_file(folder, item, "log"))};
    keep_result(item, folder, status, context);
    return {true, status, ""};
}

void add_work_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("work", "Do one item of a plan, unless its result is there");
    const auto arguments = std::make_shared<WorkArguments>();
    command->add_option("plan", arguments->plan, "File that tandem plan wrote")->required()->type_name("PLAN");
    command->add_option("item", arguments->item, "Number of the item, from 1")
        ->required()
        ->check(whole_between(1, 1'000'000'000))
        ->type_name("N");
    command->add_option("--results", arguments->results, "Folder of the results (default: the plan's name in .results)")
        ->type_name("FOLDER");
    command->add_option("--limit", arguments->limit, "End the item after this time, without a result (default: never)")
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS");
    add_common_options(*command, context,
        "  tandem work plan.jsonl 3\n"
        "  seq $(wc -l < plan.jsonl) | parallel --joblog jobs.log --resume-failed tandem work plan.jsonl\n"
        "An item of render goes on from its sums. A kill loses a quarter of a second's work, or a\n"
        "twenty-fifth of all that was rendered, whichever is more.\n"
        "Exit status: 0 where the item has a result, whatever that says; else 1, 2, 3 or 4.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return work(*arguments, context); }; });
}

}  // namespace tandem
