// tandem bench: the Vulkan patterns and the claims about them, measured on one device.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <mutex>
#include <optional>
#include <tuple>

#include "common/commands/arguments.h"
#include "common/commands/bench_arguments.h"
#include "common/commands/bench_library.h"
#include "common/commands/child_process.h"
#include "common/commands/command.h"
#include "common/commands/command_time.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/shipped_files.h"
#include "common/error.h"
#include "common/experiment/campaign.h"
#include "common/experiment/compare_results.h"
#include "common/experiment/results.h"
#include "common/experiment/thesis.h"
#include "common/files/write_file.h"
#include "common/stopwatch.h"
#include "common/text.h"

namespace tandem {

namespace {

std::pair<std::uint32_t, std::uint32_t> size_from(const std::string& text) {
    RenderOptions options;
    options.size = text;
    if (std::ranges::find(text, 'x') == text.end())
        throw InputError("--size: '" + text + "' is no image size; give WxH");
    const RenderSettings settings = settings_from(options, Scene{});
    return {settings.width, settings.height};
}

// The library's arms as a target. No scene is loaded.
BenchTarget make_library_target(const BenchArguments& arguments, const CommandContext& context) {
    BenchRequest request{arguments.device, {}, {}, arguments.arm_library, arguments.validation, {}};
    const auto note = std::make_shared<CallNote>(arguments.call_note);
    request.entering = [note](const std::string& where) { note->write(where); };
    return context.program.bench(request);
}

BenchTarget make_target(const BenchArguments& arguments, const CommandContext& context) {
    const NothingToKeep starting(context.interrupts);
    if (!arguments.arm_library.empty()) return make_library_target(arguments, context);
    std::vector<std::string> inputs;
    BenchRequest request{arguments.device, scene_from(shipped_file(arguments.scene), inputs), {}};
    check_outputs(arguments, context, inputs);
    for (const std::string& size : arguments.sizes) request.sizes.push_back(size_from(size));
    std::ranges::sort(request.sizes, {}, [](const auto& size) { return std::uint64_t{size.first} * size.second; });
    return context.program.bench(request);
}

// Families and arms by name. Throws InputError for names that there are not.
std::vector<Family> chosen(const std::vector<Family>& all, const BenchArguments& arguments) {
    std::vector<std::string> known;
    for (const Family& family : all) known.push_back(family.name);
    for (const std::string& name : arguments.families)
        if (std::ranges::find(known, name) == known.end())
            throw InputError(fmt::format(
                "--family: there is no '{}'; {}there are {}", name, did_you_mean(name, known), fmt::join(known, ", ")));
    std::vector<Family> families;
    for (const Family& family : all)
        if (asked_for(family.name, arguments.families)) families.push_back(family);
    std::vector<std::string> arms;
    for (const Family& family : families)
        for (const Arm& arm : family.arms(family.workloads.front())) arms.push_back(arm.name);
    for (const std::string& name : arguments.arms)
        if (std::ranges::find(arms, name) == arms.end())
            throw InputError(
                fmt::format("--arm: there is no '{}'; {}see tandem bench --list", name, did_you_mean(name, arms)));
    return families;
}

void print_list(const std::vector<Family>& families) {
    for (const Family& family : families) {
        fmt::print("{}: {}\n  hypothesis: {} [{}]\n  held: {}\n  base: {}; compared by '{}'\n", family.name,
            family.question, family.hypothesis, family.source, family.held, family.base, family.clock);
        for (const Arm& arm : family.arms(family.workloads.front())) fmt::print("    {:18} {}\n", arm.name, arm.text);
        for (const Workload& workload : family.workloads) fmt::print("  at {}\n", workload.name);
    }
}

// Families with their arms, and claims, whatever the device: what guidelines say of what was not measured yet.
nlohmann::json list_of(const std::vector<Family>& families, const std::vector<Claim>& claims) {
    nlohmann::json list{{"families", nlohmann::json::array()}, {"claims", nlohmann::json::array()}};
    for (const Family& family : families) {
        nlohmann::json entry = texts_of(family);
        for (const Arm& arm : family.arms(family.workloads.front()))
            entry["arms"].push_back({{"arm", arm.name}, {"text", arm.text}});
        list["families"].push_back(std::move(entry));
    }
    for (const Claim& claim : claims)
        list["claims"].push_back({{"id", claim.id}, {"text", claim.text}, {"source", claim.source},
            {"family", claim.contrast.family}, {"rule", claim.rule}});
    return list;
}

// Before anything is measured: with the readings of `earlier`, if any.
BenchResults begin_results(const BenchArguments& arguments, const CommandContext& context, const BenchTarget& target,
    const std::vector<Family>& families, std::optional<BenchResults> earlier) {
    BenchResults results;
    results.device = target.device;
    results.command = context.command_line;
    results.git = git_version();
    results.scene = arguments.arm_library.empty() ? arguments.scene
                                                  : std::filesystem::path(arguments.arm_library).filename().string();
    for (const Family& family : families) results.families.push_back(texts_of(family));
    results.empty_submissions = target.empty_submissions(200);
    if (earlier) merge(results, std::move(*earlier), arguments.resume);
    return results;
}

// Writes what there is so far to the --json file. A stream takes one document only, the last.
void keep(const CommandContext& context, const BenchTarget& target, const BenchResults& results) {
    if (context.json_descriptor < 0 && !is_stream(context.json_file))
        write_json(context, to_json(results, target.claims));
}

// The results so far, for a command that must end without a driver's leave.
class ResultsSoFar {
public:
    void take(const BenchResults& results) {
        const std::lock_guard lock(mutex_);
        results_ = results;
    }
    // No file is being written meanwhile.
    void use(const std::function<void(const std::optional<BenchResults>&)>& user) {
        const std::lock_guard lock(mutex_);
        user(results_);
    }

private:
    std::mutex mutex_;
    std::optional<BenchResults> results_;
};

// Goes on from `earlier`, if any. A --json file gets what there is between experiments, so that a killed run loses
// little.
BenchResults measure(const BenchArguments& arguments, const CommandContext& context, const CommandTime& time,
    const BenchTarget& target, const std::vector<Family>& families, ResultsSoFar& so_far,
    std::optional<BenchResults> earlier = {}) {
    BenchResults results = begin_results(arguments, context, target, families, std::move(earlier));
    CampaignOptions options = campaign_options(arguments, time);
    Stopwatch since_kept;
    options.keep = [&](const BenchResults& known) {
        so_far.take(known);
        // What calls a user's code may end at any time.
        const double seconds_between_keeping = arguments.arm_library.empty() ? 20.0 : 0.0;
        if (since_kept.seconds() < seconds_between_keeping) return;
        so_far.use([&](const auto& all) { keep(context, target, *all); });
        since_kept = {};
    };
    unsigned rounds = 0;
    {
        ProgressLine line;
        options.progress = [&](double fraction, const std::string& text) { line.update(fraction, text); };
        rounds = run_campaign(families, options, results);
    }
    if (rounds < arguments.replicates && rounds > 0 && !context.stop.stop_requested())
        fmt::print(stderr,
            "tandem: --time was enough for {} replicate{}, not {}; from {} on, intervals hold for any replicate\n",
            rounds, rounds == 1 ? "" : "s", arguments.replicates, fewest_resampled_processes);
    return results;
}

// Prints and writes; the status says whether every arm that was asked for is told of.
ExitStatus conclude(const BenchArguments& arguments, const CommandContext& context, const CommandTime& time,
    const BenchTarget& target, const std::vector<Family>& families, const BenchResults& results) {
    tell_results(arguments, context, results, target.claims);
    const ArmCount arms = count_arms(families, arguments.arms, results);
    if (arms.missing == 0) return ExitStatus::fine;
    return time.too_short(fmt::format("{} of {} arms were not measured", arms.missing, arms.all));
}

// Process after process, each with the readings of those before. The --json file gets what there is after each, also
// where one of them fails, so that --resume can go on from there.
BenchResults measure_in_processes(const BenchArguments& arguments, const CommandContext& context,
    const CommandTime& time, const BenchTarget& target, const std::vector<Family>& families,
    std::optional<BenchResults> earlier) {
    BenchResults results = begin_results(arguments, context, target, families, std::move(earlier));
    std::vector<CampaignPart> parts = parts_of(campaign_options(arguments, time), arguments.processes);
    ProgressLine line;
    for (std::size_t i = 0; i < parts.size() && !time.token().stop_requested(); ++i) {
        line.update(static_cast<double>(i) / static_cast<double>(parts.size()), fmt::format("process {}", i + 1));
        const TemporaryFile known, file;
        write_text_file(known.name(), to_json(results, {}).dump());
        parts[i].seconds = std::max(1e-3, time.left() / static_cast<double>(parts.size() - i));
        const int status = run_self(words_of(arguments, parts[i], known.name(), file.name()));
        // It wrote while it ran, too.
        if (std::filesystem::file_size(file.name()) > 0) results.samples = load_results(file.name()).samples;
        keep(context, target, results);
        if (status != 0 && status != static_cast<int>(ExitStatus::undecided))  // its time was short
            throw Error(fmt::format("process {} of --processes ended with status {}{}", i + 1, status,
                context.json_file.empty() ? "" : "; the file of --json has what was measured: go on with --resume"));
    }
    return results;
}

// Each arm at each amount of work once, compared and under the layer; nothing is timed.
ExitStatus look_at_arms(const BenchArguments& arguments, const CommandContext& context) {
    const BenchTarget target = make_target(arguments, context);
    for (const Family& family : chosen(target.families, arguments))
        for (const Workload& workload : family.workloads)
            for (const Arm& arm : family.arms(workload)) {
                std::string told = "runs";
                try {
                    const std::unique_ptr<ArmRun> run = arm.make();
                    if (run->output()) told += ", its result is the first arm's";
                    (void)run->run();
                } catch (const UnsupportedError& reason) {
                    told = std::string("not applicable: ") + reason.what();
                }
                fmt::print("{:18} at {}: {}\n", arm.name, workload.name, told);
            }
    fmt::print("The validation layer is silent.\n");
    return ExitStatus::fine;
}

ExitStatus measure_patterns(const BenchArguments& arguments, const CommandContext& context, const CommandTime& time) {
    std::optional<BenchResults> earlier;
    if (!arguments.resume.empty()) earlier = load_results(arguments.resume);
    const BenchTarget target = make_target(arguments, context);
    const std::vector<Family> families = chosen(target.families, arguments);
    if (arguments.list) {
        write_json(context, list_of(families, target.claims));
        print_list(families);
        return ExitStatus::fine;
    }
    ResultsSoFar so_far;
    const auto last_resort = time.at_any_rate([&] {
        ExitStatus status = ExitStatus::undecided;
        so_far.use([&](const std::optional<BenchResults>& known) {
            status = known ? conclude(arguments, context, time, target, families, *known)
                           : time.too_short("nothing was measured");
        });
        return status;
    });
    if (arguments.processes > 1) last_resort->done();  // each has its own
    const BenchResults results =
        arguments.processes == 1 ? measure(arguments, context, time, target, families, so_far, std::move(earlier))
                                 : measure_in_processes(arguments, context, time, target, families, std::move(earlier));
    last_resort->done();
    return conclude(arguments, context, time, target, families, results);
}

ExitStatus measure_thesis(const BenchArguments& arguments, const CommandContext& context) {
    if (arguments.sizes.size() > 1) throw InputError("--size: the thesis's method takes one size");
    if (!arguments.families.empty() || !arguments.arms.empty() || !arguments.resume.empty() ||
        arguments.processes != 1 || arguments.self_test || arguments.list)
        throw InputError(
            "--method thesis has its own arms and protocol; of the other options it takes --scene, --device, "
            "--size and --json");
    const BenchTarget target = make_target(arguments, context);
    ThesisOptions options;
    if (!arguments.sizes.empty())
        std::tie(options.setup.width, options.setup.height) = size_from(arguments.sizes.front());
    options.stop = context.stop;
    ThesisReport report;
    {
        ProgressLine line;
        options.progress = [&](double fraction, const std::string& text) { line.update(fraction, text); };
        report = run_thesis(target, options);
    }
    fmt::print("{}, {} {}\n{}", target.device.value("name", "?"), target.device.value("driver_name", ""),
        target.device.value("driver_version", ""), to_text(report));
    write_json(context, {{"version", results_version}, {"device", target.device}, {"command", context.command_line},
                            {"git", git_version()}, {"scene", arguments.scene}, {"thesis", to_json(report)}});
    return report.stopped ? ExitStatus::undecided : ExitStatus::fine;
}

// The runner on this device, with a known effect and with none.
ExitStatus test_self(const BenchArguments& arguments, const CommandContext& context, const CommandTime& time) {
    const BenchTarget target = make_target(arguments, context);
    ResultsSoFar so_far;
    const BenchResults results = measure(arguments, context, time, target, {target.self_test}, so_far);
    const std::vector<ArmResult> arms = analyse(results.samples);
    if (arms.empty()) throw StoppedError("stopped before the self-test's first block");
    const auto arm = [&](const std::string& name) { return *std::ranges::find(arms, name, &ArmResult::arm); };
    const ArmResult twin = arm("twin"), busy = arm("busy");
    const double planted = busy.seconds.at("busy");  // what the wait really took
    const bool covers = busy.difference.low <= planted && planted <= busy.difference.high;
    const bool quiet = twin.ratio_low() <= 1.0 && 1.0 <= twin.ratio_high();
    nlohmann::json report = to_json(results, {});
    report["self_test"] = {{"planted_milliseconds", 1e3 * planted}, {"covers", covers}, {"quiet", quiet}};
    fmt::print("planted {:.4f} ms: seen {:.4f} ms (95 %: {:.4f} to {:.4f}), {}\n", 1e3 * planted,
        1e3 * busy.difference.value, 1e3 * busy.difference.low, 1e3 * busy.difference.high,
        covers ? "covered" : "NOT covered");
    fmt::print("nothing planted: {:.4f} times (95 %: {:.4f} to {:.4f}), {}\n", twin.ratio(), twin.ratio_low(),
        twin.ratio_high(), quiet ? "no effect" : "an effect where there is none");
    fmt::print("Either line may be wrong once in twenty runs: that is what 95 % says.\n");
    write_json(context, report);
    return covers && quiet ? ExitStatus::fine : ExitStatus::disagree;
}

// What a process with the library does, and no other.
ExitStatus call_library(const BenchArguments& arguments, const CommandContext& context, const CommandTime& time) {
    try {
        return arguments.validation ? look_at_arms(arguments, context) : measure_patterns(arguments, context, time);
    } catch (const DifferentResults& difference) {
        fmt::print(stderr, "tandem: {}\n", escaped(difference.what()));
        return ExitStatus::disagree;
    }
}

ExitStatus compare_files(const std::vector<std::string>& files, const CommandContext& context) {
    check_outputs(context, {}, files);
    const ResultsComparison comparison = compare_results(load_results(files[0]), load_results(files[1]));
    if (comparison.arms.empty())
        throw input_error(files[1], "", "has no arm at any workload in common with " + files[0],
            "compare results of "
            "the same families and sizes");
    fmt::print("{}", to_text(comparison));
    write_json(context, to_json(comparison));
    const bool slower =
        std::ranges::any_of(comparison.arms, [](const ChangeOfArm& arm) { return arm.change == Change::slower; });
    return slower ? ExitStatus::disagree : ExitStatus::fine;
}

ExitStatus bench(const BenchArguments& arguments, const CommandContext& context) {
    if (arguments.call_note.empty()) refuse_beside_library(arguments, context);
    if (!arguments.csv.empty() && (!arguments.compare.empty() || arguments.method == "thesis" || arguments.list ||
                                      arguments.self_test || arguments.validation))
        throw InputError(
            "--csv is for arms that are measured; leave it out, or --compare, --method thesis, --list, --self-test "
            "and --validation");
    if (!arguments.compare.empty()) return compare_files(arguments.compare, context);
    if (arguments.method == "thesis") return measure_thesis(arguments, context);
    const CommandTime time(context, arguments.seconds);
    return time.work([&] {
        if (!arguments.call_note.empty()) return call_library(arguments, context, time);
        if (!arguments.arm_library.empty()) return measure_library(arguments, context, time);
        return arguments.self_test ? test_self(arguments, context, time) : measure_patterns(arguments, context, time);
    });
}

}  // namespace

void add_bench_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("bench", "Measure patterns of Vulkan use, and test the claims about them");
    const auto arguments = std::make_shared<BenchArguments>();
    command->add_option("--scene", arguments->scene, "Scene file that is rendered")
        ->type_name("SCENE")
        ->capture_default_str();
    command->add_option("--device", arguments->device, device_help);
    command->add_option("--family", arguments->families, "Only these families of arms")
        ->type_name("NAME")
        ->delimiter(',');
    command->add_option("--arm", arguments->arms, "Only these arms, each against its family's baseline")
        ->type_name("NAME")
        ->delimiter(',');
    command->add_option("--size", arguments->sizes, "Image sizes WxH (default: three that fit the device)")
        ->type_name("SIZE")
        ->delimiter(',');
    command
        ->add_option(
            "--time", arguments->seconds, "Seconds for everything, making arms included. What gets no time is listed")
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS")
        ->capture_default_str();
    command
        ->add_option("--narrow", arguments->narrow, "End an experiment early once each ratio is known to within ± this")
        ->check(above_zero(1.0))
        ->capture_default_str()
        ->group(rare_options);
    command->add_option("--seed", arguments->seed, "Seed of the order in which arms run")
        ->check(whole_between(0, std::numeric_limits<std::uint64_t>::max()))
        ->capture_default_str()
        ->group(rare_options);
    command
        ->add_option("--replicates", arguments->replicates,
            "Times that every arm is created anew. From five on, intervals hold for any replicate")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command->add_option("--processes", arguments->processes, "Processes that share the time and the replicates")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command->add_option("--resume", arguments->resume, "Go on from an earlier --json file")->type_name("FILE");
    command
        ->add_option("--method", arguments->method,
            "paired (interleaved blocks) or thesis (Ferreira's protocol, which takes no --time)")
        ->check(one_of({"paired", "thesis"}))
        ->capture_default_str();
    command
        ->add_option("--arm-library", arguments->arm_library,
            "Measure the arms of your own shared library, made with <tandem/arm.h> (vulkan/README.md)")
        ->type_name("FILE");
    command->add_flag("--validation", arguments->validation,
        "With --arm-library: run each arm once under Vulkan's validation layer, and time nothing");
    command->add_option("--call-note", arguments->call_note)->group("");  // for the process that calls the library
    command->add_option("--csv", arguments->csv, "Write a row for each arm, workload and replicate")->type_name("FILE");
    command->add_option("--compare", arguments->compare, "Compare result B with result A; run nothing")
        ->type_name("A B")
        ->expected(2);
    command->add_flag("--self-test", arguments->self_test, "Test the measurement itself on a known wait and on none")
        ->group(rare_options);
    command->add_flag("--list", arguments->list, "List families, arms, workloads and claims; run nothing");
    add_common_options(*command, context,
        "  tandem bench --list\n"
        "  tandem bench --family memory,recording --time 60 --json old.json\n"
        "  tandem bench --family memory,recording --time 60 --processes 2 --json new.json\n"
        "  tandem bench --compare old.json new.json\n"
        "  tandem bench --family submission --arm 1-a-submit --size 320x180 --time 20\n"
        "  tandem bench --method thesis --size 160x90 --json thesis.json\n"
        "  tandem bench --arm-library ./my.so --time 20 --json my.json --csv my.csv\n"
        "Exit status: 0; 1 where --compare finds an arm slower, --self-test fails, or the results of a library's arms "
        "differ; 3 where arms were not measured.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return bench(*arguments, context); }; });
}

}  // namespace tandem
