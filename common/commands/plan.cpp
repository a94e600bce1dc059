// tandem plan: a command split into items, for engines that run farms of jobs.
#include "common/distribution/plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/commands/bench_arguments.h"
#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/plan_items.h"
#include "common/commands/shipped_files.h"
#include "common/commands/verify_presets.h"
#include "common/distribution/part.h"
#include "common/distribution/range_render.h"
#include "common/error.h"
#include "common/stability/catalogue.h"
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
            throw InputError(fmt::format("{}: {} is not for one item of many; {}", command.get_name(), option, mend));
}

std::vector<Words> verify_items(const CLI::App& command, Words& read) {
    refuse(command, {"--total-time"}, "give --time for a scene");
    refuse(command, {"--among"}, "leave it out");
    Words scenes = results_of(command, "scenes");
    Words words = given_words(command, {"--preset", "--devices", "--json", "--junit", "--report"});
    if (const std::string name = value_of(command, "--preset", ""); !name.empty()) {
        const VerifyPreset preset = verify_preset(name);
        if (scenes.empty()) scenes = preset.scenes;
        if (!preset.size.empty() && command.get_option("--size")->count() == 0)
            words.insert(words.end(), {"--size", preset.size});
        if (command.get_option("--time")->count() == 0)
            words.insert(words.end(),
                {"--time", fmt::format("{:.1f}", preset.total_seconds / static_cast<double>(scenes.size()))});
    }
    if (scenes.empty()) throw InputError("plan verify: no scene is named; name scene files, or a --preset");
    for (const std::string& scene : scenes) static_cast<void>(scene_from(shipped_file(scene), read));
    Words devices = command.get_option_no_throw("--devices") != nullptr ? results_of(command, "--devices") : Words{};
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

std::vector<Words> render_items(const CLI::App& command, Words& read) {
    refuse(command, {"--output", "--range", "--resume"}, "leave it out; merge-results takes -o");
    refuse(command, {"--time", "--target-error"}, "give --samples");
    refuse(command, {"--aov", "--every"}, "leave it out");
    RenderSettings settings;  // of what has no parts
    if (value_of(command, "--sampling", "") == "adaptive") settings.sampling = Sampling::adaptive;
    if (value_of(command, "--accumulation", "") == "plain") settings.accumulation = Accumulation::plain;
    check_splittable(settings);
    const std::string scene = results_of(command, "scene").front();
    static_cast<void>(scene_from(shipped_file(scene), read));
    const std::uint64_t samples = std::stoull(value_of(command, "--samples", "64"));
    const std::uint64_t pieces = std::stoull(value_of(command, "--pieces", "8"));
    const std::uint64_t blocks = (samples + samples_per_block - 1) / samples_per_block;
    const std::uint64_t each = (blocks + pieces - 1) / pieces * samples_per_block;
    const Words words = given_words(command, {"--pieces", "--samples", "--json"});
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
    const Words words = given_words(command, {"--case", "--json"});
    std::vector<Words> items;
    for (const std::string& one : cases) {
        Words item{"stability", "--case", one};
        item.insert(item.end(), words.begin(), words.end());
        items.push_back(std::move(item));
    }
    return items;
}

// A scene each: the times of its settings are to be compared, so one machine measures them all.
std::vector<Words> cost_items(const CLI::App& command, Words& read) {
    refuse(command, {"--list", "--reference-only"}, "leave it out");
    refuse(command, {"--resume"}, "leave it out; tandem work does an item again from its start");
    const Words scenes = results_of(command, "scene");
    if (scenes.size() > 1) refuse(command, {"--reference"}, "a reference is of one scene; name --references");
    const Words words = given_words(command, {"--json"});
    std::vector<Words> items;
    for (const std::string& scene : scenes) {
        static_cast<void>(scene_from(shipped_file(scene), read));
        Words item{"cost", scene};
        item.insert(item.end(), words.begin(), words.end());
        items.push_back(std::move(item));
    }
    return items;
}

// A family each, whose arms one device measures side by side. They share the time.
std::vector<Words> bench_items(const CLI::App& command, const CommandContext& context, Words& read) {
    refuse(command, {"--compare", "--method", "--arm-library", "--validation", "--self-test", "--list"},
        "run it as it is");
    refuse(command, {"--csv", "--resume", "--arm"}, "leave it out");
    BenchRequest request;
    request.device = value_of(command, "--device", "");
    request.scene = scene_from(shipped_file(value_of(command, "--scene", BenchArguments{}.scene)), read);
    Words known;
    for (const Family& family : context.program.bench(request).families) known.push_back(family.name);
    Words families = results_of(command, "--family");
    for (const std::string& name : families)
        if (std::ranges::find(known, name) == known.end())
            throw InputError(fmt::format(
                "--family: there is no '{}'; {}there are {}", name, did_you_mean(name, known), fmt::join(known, ", ")));
    if (families.empty()) families = known;
    const double seconds = std::stod(value_of(command, "--time", fmt::format("{}", BenchArguments{}.seconds)));
    const Words words = given_words(command, {"--family", "--time", "--json"});
    std::vector<Words> items;
    for (const std::string& family : families) {
        Words item{"bench", "--family", family, "--time",
            fmt::format("{:.2f}", std::max(0.01, seconds / static_cast<double>(families.size())))};
        item.insert(item.end(), words.begin(), words.end());
        items.push_back(std::move(item));
    }
    return items;
}

std::vector<Words> words_of_items(const CLI::App& command, const CommandContext& context, Words& read) {
    const std::string name = command.get_name();
    if (name == "verify") return verify_items(command, read);
    if (name == "render") return render_items(command, read);
    if (name == "cost") return cost_items(command, read);
    if (name == "bench") return bench_items(command, context, read);
    return stability_items(command);
}

ExitStatus plan(const CLI::App& command, const CommandContext& context) {
    refuse(command, {"--json"}, "merge-results takes it");
    if (command.get_name() == "verify") refuse(command, {"--junit", "--report"}, "merge-results takes it");
    const NothingToKeep at_work(context.interrupts);
    Words read;
    const std::vector<PlanItem> items = plan_items(command, context, read);
    check_outputs(context, {}, read);
    for (const PlanItem& item : items) fmt::print("{}\n", to_json(item).dump());
    return ExitStatus::fine;
}

}  // namespace

std::vector<PlanItem> plan_items(
    const CLI::App& command, const CommandContext& context, std::vector<std::string>& read) {
    std::vector<PlanItem> items;
    for (Words& words : words_of_items(command, context, read))
        items.push_back({items.size() + 1, std::move(words), git_version()});
    return items;
}

void add_plan_command(CLI::App& app, CommandContext& context) {
    CLI::App* command =
        app.add_subcommand("plan", "Split render, verify, cost, bench or stability into items for a farm");
    command->require_subcommand(1);
    command->footer(
        "Examples:\n"
        "  tandem plan verify scenes/*.json --samples 4096 > plan.jsonl\n"
        "  tandem plan verify scenes/*.json --devices 0,1 --time 60 > plan.jsonl\n"
        "  tandem plan render scenes/glass.json --samples 4096 --pieces 16 > plan.jsonl\n"
        "  tandem plan cost scenes/*.json --time 300 > plan.jsonl\n"
        "  tandem plan bench --time 600 > plan.jsonl\n"
        "  tandem plan stability > plan.jsonl\n"
        "An item is a line. tandem work does one, tandem merge-results makes one result of all.");
    add_verify_command(*command, context);
    add_render_command(*command, context);
    add_cost_command(*command, context);
    add_bench_command(*command, context);
    add_stability_command(*command, context);
    for (CLI::App* const one : command->get_subcommands({})) {
        if (one->get_name() == "verify")
            one->add_option("--devices", "Verify each scene on each of these Vulkan devices")
                ->expected(1, CLI::detail::expected_max_vector_size)
                ->delimiter(',')
                ->type_name("DEVICE");
        if (one->get_name() == "cost")
            one->get_option("scene")->expected(1, CLI::detail::expected_max_vector_size)->allow_extra_args();
        if (one->get_name() == "render") {
            one->get_option("--output")->required(false);
            one->add_option("--pieces", "Ranges of samples to split the image into, at most (default: 8)")
                ->check(whole_between(1, 1'000'000));
        }
    }
    // After that of the command to be split, whose action it takes the place of.
    command->callback([&context, command] {
        context.action = [&context, command] { return plan(*command->get_subcommands().front(), context); };
    });
}

}  // namespace tandem
