// tandem bench: the Vulkan patterns and the claims about them, measured on one device.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/error.h"
#include "common/experiment/results.h"
#include "common/scene_loader.h"

namespace tandem {

namespace {

struct BenchArguments {
    std::string scene = "scenes/cornell-thesis.json", device;
    std::vector<std::string> families, arms, sizes;
    double seconds = 120.0, narrow = 0.01;
    std::uint64_t seed = 1;
    bool list = false;
};

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

std::pair<std::uint32_t, std::uint32_t> size_from(const std::string& text) {
    RenderOptions options;
    options.size = text;
    if (std::ranges::find(text, 'x') == text.end())
        throw InputError("--size: '" + text + "' is no image size; give WxH");
    const RenderSettings settings = settings_from(options, Scene{});
    return {settings.width, settings.height};
}

BenchTarget make_target(const BenchArguments& arguments, const CommandContext& context) {
    BenchRequest request{arguments.device, load_scene(arguments.scene), {}};
    for (const std::string& size : arguments.sizes) request.sizes.push_back(size_from(size));
    std::ranges::sort(request.sizes, {}, [](const auto& size) { return std::uint64_t{size.first} * size.second; });
    return context.program.bench(request);
}

bool wanted(const std::string& name, const std::vector<std::string>& only) {
    return only.empty() || std::ranges::find(only, name) != only.end();
}

std::string names_of(const std::vector<Family>& families) {
    std::string names;
    for (const Family& family : families) names += (names.empty() ? "" : ", ") + family.name;
    return names;
}

// Families and arms by name. Throws InputError for names that there are not.
std::vector<Family> chosen(const std::vector<Family>& all, const BenchArguments& arguments) {
    for (const std::string& name : arguments.families)
        if (std::ranges::find(all, name, &Family::name) == all.end())
            throw InputError("--family: there is no '" + name + "'; there are " + names_of(all));
    std::vector<Family> families;
    for (const Family& family : all)
        if (wanted(family.name, arguments.families)) families.push_back(family);
    for (const std::string& name : arguments.arms) {
        const bool known = std::ranges::any_of(families, [&](const Family& family) {
            const std::vector<Arm> arms = family.arms(family.workloads.front());
            return std::ranges::find(arms, name, &Arm::name) != arms.end();
        });
        if (!known) throw InputError("--arm: there is no '" + name + "'; see tandem bench --list");
    }
    return families;
}

void print_list(const std::vector<Family>& families) {
    for (const Family& family : families) {
        fmt::print("{}: {}\n  hypothesis: {} [{}]\n  held: {}\n", family.name, family.question, family.hypothesis,
            family.source, family.held);
        for (const Arm& arm : family.arms(family.workloads.front())) fmt::print("    {:18} {}\n", arm.name, arm.text);
        for (const Workload& workload : family.workloads) fmt::print("  at {}\n", workload.name);
    }
}

// Each experiment gets its share of what is left, so that what one leaves over helps the others.
void run_all(const std::vector<Family>& families, const BenchArguments& arguments, const CommandContext& context,
    BenchResults& results) {
    std::size_t left = 0, done = 0;
    for (const Family& family : families) left += family.workloads.size();
    const double end = now() + arguments.seconds;
    const double all = static_cast<double>(left);
    ProgressLine line;
    for (const Family& family : families)
        for (const Workload& workload : family.workloads) {
            if (context.stop.stop_requested()) return;
            RunnerOptions options;
            options.seconds = std::max(0.0, end - now()) / static_cast<double>(left--);
            options.narrow = arguments.narrow;
            options.seed = arguments.seed + 1000 * done;
            options.only = arguments.arms;
            options.stop = context.stop;
            options.progress = [&](double fraction) {
                line.update((static_cast<double>(done) + fraction) / all, family.name + " at " + workload.name);
            };
            results.samples.push_back(run_experiment(family, workload, options));
            ++done;
        }
}

ExitStatus bench(const BenchArguments& arguments, const CommandContext& context, const std::string& command_line) {
    check_outputs({context.json_file}, {arguments.scene});
    const BenchTarget target = make_target(arguments, context);
    const std::vector<Family> families = chosen(target.families, arguments);
    if (arguments.list) {
        print_list(families);
        return ExitStatus::fine;
    }
    BenchResults results;
    results.device = target.device;
    results.command = command_line;
    results.scene = arguments.scene;
    for (const Family& family : families) results.families.push_back(texts_of(family));
    results.empty_submissions = target.empty_submissions(200);
    run_all(families, arguments, context, results);
    write_json(context, to_json(results, target.claims));
    fmt::print("{}", to_text(results, target.claims));
    return ExitStatus::fine;
}

}  // namespace

void add_bench_command(CLI::App& app, CommandContext& context) {
    CLI::App* command =
        app.add_subcommand("bench", "Measure what ways of using Vulkan are worth, and judge what is claimed of them");
    const auto arguments = std::make_shared<BenchArguments>();
    command->add_option("--scene", arguments->scene, "Scene file that is rendered")
        ->type_name("SCENE")
        ->capture_default_str();
    command->add_option("--device", arguments->device, "Vulkan device: index or part of its name (see tandem devices)");
    command->add_option("--family", arguments->families, "Only these families of arms")
        ->type_name("NAME")
        ->delimiter(',');
    command->add_option("--arm", arguments->arms, "Only these arms, each against its family's baseline")
        ->type_name("NAME")
        ->delimiter(',');
    command->add_option("--size", arguments->sizes, "Image sizes WxH (default: three that fit the device)")
        ->type_name("SIZE")
        ->delimiter(',');
    command->add_option("--time", arguments->seconds, "Seconds for all experiments together")
        ->check(above_zero(most_seconds))
        ->capture_default_str();
    command
        ->add_option(
            "--narrow", arguments->narrow, "An experiment ends early once each ratio is known to within ± this")
        ->check(above_zero(1.0))
        ->capture_default_str();
    command->add_option("--seed", arguments->seed, "Seed of the order in which arms run")->capture_default_str();
    command->add_flag("--list", arguments->list, "List families, arms and workloads, and run nothing");
    add_common_options(*command, context,
        "  tandem bench --list\n"
        "  tandem bench --family memory,recording --time 60 --json bench.json\n"
        "  tandem bench --family submission --arm 1-a-submit --size 1920x1080");
    command->callback([&context, arguments] {
        context.action = [&context, arguments] { return bench(*arguments, context, context.command_line); };
    });
}

}  // namespace tandem
