// tandem plan and tandem work: a command split into items, and one of them done, for engines that run farms of jobs.
#include "common/distribution/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "common/commands/command.h"
#include "common/commands/shipped_files.h"
#include "common/commands/verify_presets.h"
#include "common/deadline.h"
#include "common/distribution/part.h"
#include "common/distribution/range_render.h"
#include "common/error.h"
#include "common/external/child.h"
#include "common/stability/catalogue.h"
#include "common/stopwatch.h"
#include "common/text.h"

namespace tandem {

namespace {

using Words = std::vector<std::string>;

// The options that were given, as a command line has them, but for `left_out`.
Words given_words(const CLI::App& command, const Words& left_out) {
    Words words;
    for (const CLI::Option* option : command.get_options()) {
        if (option->count() == 0 || option->get_positional()) continue;
        const std::string name = "--" + option->get_lnames().front();
        if (std::ranges::find(left_out, name) != left_out.end()) continue;
        if (option->get_expected_max() == 0)
            words.push_back(name);
        else
            words.insert(words.end(), {name, fmt::format("{}", fmt::join(option->results(), ","))});
    }
    return words;
}

Words results_of(const CLI::App& command, const std::string& option) { return command.get_option(option)->results(); }

std::string value_of(const CLI::App& command, const std::string& option, const std::string& otherwise) {
    const Words results = results_of(command, option);
    return results.empty() ? otherwise : results.front();
}

void refuse(const CLI::App& command, const Words& options, const std::string& mend) {
    for (const std::string& option : options)
        if (command.get_option(option)->count() > 0)
            throw InputError(
                fmt::format("plan {}: {} is not for one item of many; {}", command.get_name(), option, mend));
}

std::vector<Words> verify_items(const CLI::App& command) {
    refuse(command, {"--total-time"}, "give --time for a scene");
    refuse(command, {"--junit", "--report", "--among"}, "leave it out");
    Words scenes = results_of(command, "scenes");
    Words words = given_words(command, {"--preset", "--devices"});
    if (const std::string name = value_of(command, "--preset", ""); !name.empty()) {
        const VerifyPreset preset = verify_preset(name);
        if (scenes.empty()) scenes = preset.scenes;
        if (command.get_option("--size")->count() == 0) words.insert(words.end(), {"--size", preset.size});
        if (command.get_option("--time")->count() == 0)
            words.insert(words.end(),
                {"--time", fmt::format("{:.1f}", preset.total_seconds / static_cast<double>(scenes.size()))});
    }
    if (scenes.empty()) throw InputError("plan verify: no scene is named; name scene files, or a --preset");
    for (const std::string& scene : scenes) {
        Words inputs;
        static_cast<void>(scene_from(shipped_file(scene), inputs));
    }
    Words devices = results_of(command, "--devices");
    if (devices.empty()) devices.emplace_back();
    std::vector<Words> items;
    for (const std::string& device : devices)
        for (const std::string& scene : scenes) {
            Words item{"verify", scene, "--among", std::to_string(scenes.size() * devices.size())};
            item.insert(item.end(), words.begin(), words.end());
            if (!device.empty()) item.insert(item.end(), {"--device", device});
            items.push_back(std::move(item));
        }
    return items;
}

std::vector<Words> render_items(const CLI::App& command) {
    refuse(command, {"--output", "--range", "--resume"}, "leave it out; merge-results takes -o");
    refuse(command, {"--time", "--target-error"}, "give --samples");
    const std::string scene = results_of(command, "scene").front();
    Words inputs;
    static_cast<void>(scene_from(shipped_file(scene), inputs));
    const std::uint64_t samples = std::stoull(value_of(command, "--samples", "64"));
    const std::uint64_t pieces = std::stoull(value_of(command, "--pieces", "8"));
    const std::uint64_t blocks = (samples + samples_per_block - 1) / samples_per_block;
    const std::uint64_t each = (blocks + pieces - 1) / pieces * samples_per_block;
    const Words words = given_words(command, {"--pieces", "--samples"});
    std::vector<Words> items;
    for (const SampleRange& range : cut({{0, samples}}, each)) {
        Words item{"render", scene, "--range", to_string(range), "--samples", std::to_string(samples)};
        item.insert(item.end(), words.begin(), words.end());
        items.push_back(std::move(item));
    }
    return items;
}

std::vector<Words> stability_items(const CLI::App& command) {
    Words cases = results_of(command, "--case");
    if (cases.empty())
        for (const stability::HardCase& one :
            stability::load_catalogue(shipped_file(value_of(command, "--catalogue", "scenes/hard/catalogue.json"))))
            cases.push_back(one.id);
    const Words words = given_words(command, {"--case"});
    std::vector<Words> items;
    for (const std::string& one : cases) {
        Words item{"stability", "--case", one};
        item.insert(item.end(), words.begin(), words.end());
        items.push_back(std::move(item));
    }
    return items;
}

ExitStatus plan(const CLI::App& command) {
    refuse(command, {"--json"}, "merge-results takes it");
    const std::string name = command.get_name();
    const std::vector<Words> all = name == "verify"   ? verify_items(command)
                                   : name == "render" ? render_items(command)
                                                      : stability_items(command);
    std::uint64_t number = 0;
    for (const Words& words : all) fmt::print("{}\n", to_json(PlanItem{++number, words, git_version()}).dump());
    return ExitStatus::fine;
}

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
bool is_whole(const nlohmann::json& report) {
    if (!report.is_object()) return false;
    if (!report.contains("scenes")) return report.contains("cases");
    return report.at("not_run").empty() &&
           std::ranges::none_of(report.at("scenes"), [](const auto& scene) { return scene.value("stopped", true); });
}

// The exit status of the item's command. Throws StoppedError.
int run_item(const PlanItem& item, const std::filesystem::path& folder, const WorkArguments& arguments,
    const CommandContext& context) {
    Words words{"/proc/self/exe"};
    words.insert(words.end(), item.words.begin(), item.words.end());
    words.insert(
        words.end(), {item.is_part() ? "--output" : "--json", result_file(folder, item, "unchecked").string()});
    Child child(words, result_file(folder, item, "log"), false);
    const Stopwatch watch;
    constexpr double poll_seconds = 0.05;  // how late a stop may be heeded
    while (!child.ended_within(poll_seconds)) {
        if (context.stop.stop_requested())
            throw StoppedError(fmt::format("item {} was stopped and has no result", item.number));
        if (arguments.limit > 0.0 && watch.seconds() > arguments.limit)
            throw StoppedError(
                fmt::format("item {} had not ended after the {:g} s of --limit; it was ended, and has no "
                            "result",
                    item.number, arguments.limit));
    }
    return child.exit_status();
}

// Puts the result of an item in its place.
void keep_result(const PlanItem& item, const std::filesystem::path& folder, int status, const CommandContext& context) {
    const std::filesystem::path unchecked = result_file(folder, item, "unchecked"), result = result_file(folder, item);
    if (item.is_part()) {
        std::filesystem::rename(unchecked, result);
        return;
    }
    const nlohmann::json report = nlohmann::json::parse(std::ifstream(unchecked), nullptr, false);
    if (!is_whole(report)) throw StoppedError(fmt::format("item {} was stopped and has no result", item.number));
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
    context.read.add(arguments.plan);
    if (arguments.item > items.size())
        throw input_error(arguments.plan, "", fmt::format("has {} items and no item {}", items.size(), arguments.item),
            "name one of them");
    const PlanItem& item = items[arguments.item - 1];
    if (item.version != git_version())
        throw input_error(arguments.plan, "",
            fmt::format("is by version {} of the program, not {}", item.version, git_version()), "make it again");
    const std::filesystem::path folder = results_folder(arguments.plan, arguments.results);
    std::error_code ignored;
    std::filesystem::create_directories(folder, ignored);
    const std::filesystem::path result = result_file(folder, item);
    if (std::filesystem::exists(result)) {
        if (!item.is_part()) static_cast<void>(read_result(result, item));
        return tell_result(item, result, context, ", which was there");
    }
    check_outputs(context, {{"--results", result, item.is_part() ? OutputKind::image : OutputKind::text}}, {});
    const int status = run_item(item, folder, arguments, context);
    const bool has_result = status == 0 || (!item.is_part() && (status == 1 || status == 3));
    if (!has_result || !std::filesystem::exists(result_file(folder, item, "unchecked"))) {
        fmt::print(stderr, "tandem: item {} has no result (status {}): {}\n", item.number, status,
            escaped(last_line_of(result_file(folder, item, "log"))));
        return status == 2 || status == 3 || status == 4 ? static_cast<ExitStatus>(status) : ExitStatus::disagree;
    }
    keep_result(item, folder, status, context);
    return tell_result(item, result, context, "");
}

}  // namespace

void add_plan_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("plan", "Split verify, render or stability into items for a farm");
    command->require_subcommand(1);
    command->footer(
        "Examples:\n"
        "  tandem plan verify scenes/*.json --samples 4096 > plan.jsonl\n"
        "  tandem plan verify scenes/*.json --devices 0,1 --time 60 > plan.jsonl\n"
        "  tandem plan render scenes/glass.json --samples 4096 --pieces 16 > plan.jsonl\n"
        "  tandem plan stability > plan.jsonl\n"
        "An item is a line. tandem work does one, tandem merge-results makes one result of all.");
    add_verify_command(*command, context);
    add_render_command(*command, context);
    add_stability_command(*command, context);
    for (CLI::App* const one : command->get_subcommands({})) {
        if (one->get_name() == "verify")
            one->add_option("--devices", "Verify each scene on each of these Vulkan devices")
                ->expected(1, CLI::detail::expected_max_vector_size)
                ->delimiter(',')
                ->type_name("DEVICE");
        if (one->get_name() == "render") {
            one->get_option("--output")->required(false);
            one->add_option("--pieces", "Ranges of samples to split the image into, at most (default: 8)")
                ->check(whole_between(1, 1'000'000));
        }
    }
    // After that of the command to be split, whose action it takes the place of.
    command->callback(
        [&context, command] { context.action = [command] { return plan(*command->get_subcommands().front()); }; });
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
    command->add_option("--limit", arguments->limit, "End the item after so long, without a result (default: never)")
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS");
    add_common_options(*command, context,
        "  tandem work plan.jsonl 3\n"
        "  seq $(wc -l < plan.jsonl) | parallel --joblog jobs.log --resume-failed tandem work plan.jsonl\n"
        "Exit status: 0 where the item has a result, whatever that says; else 1, 2, 3 or 4.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return work(*arguments, context); }; });
}

}  // namespace tandem
