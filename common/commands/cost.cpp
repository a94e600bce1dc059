// tandem cost: what accuracy costs in time, knob by knob.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <mutex>
#include <optional>

#include "common/commands/command.h"
#include "common/commands/command_time.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/shipped_files.h"
#include "common/cost/reference.h"
#include "common/error.h"
#include "common/files/read_file.h"
#include "common/files/write_file.h"
#include "common/text.h"

namespace tandem {

namespace {

struct CostArguments {
    std::string scene, backend = "cpu", device, kernel, precision, reference_backend = "cpu", references, reference,
                       resume, error = "1%";
    std::vector<std::string> knobs;
    RenderOptions options;
    double seconds = 120.0;
    unsigned threads = 0;
    bool list = false, no_cache = false, all = false, reference_only = false;
};

constexpr const char* default_size = "64";

// Where the user's other programs keep what can be made again. [XDG Base Directory Specification]
std::filesystem::path cache_folder() {
    if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && cache[0] == '/')
        return std::filesystem::path(cache) / "tandem" / "references";
    if (const char* home = std::getenv("HOME"); home != nullptr && home[0] == '/')
        return std::filesystem::path(home) / ".cache" / "tandem" / "references";
    return {};
}

Output output_of(const std::filesystem::path& references) { return {"--references", references, OutputKind::folder}; }

void tell_cache_fault(const InputError& error) {
    fmt::print(stderr, "tandem: the cache of long references: {}\n", escaped(error.what()));
}

// Empty: they are not kept. That they are is for later runs, so a cache that cannot be written is no reason to refuse
// this one. A folder that was named is.
std::filesystem::path references_of(const CostArguments& arguments) {
    if (arguments.no_cache || arguments.list || !arguments.reference.empty()) return {};
    if (!arguments.references.empty()) return arguments.references;
    const std::filesystem::path cache = cache_folder();
    try {
        check_outputs({output_of(cache)}, {});
    } catch (const InputError& error) {
        tell_cache_fault(error);
        return {};
    }
    return cache;
}

MakeRenderer maker(const CommandContext& context, const std::string& name, const CostArguments& arguments) {
    const Backend& backend = find_backend(context.program.backends, name);
    return [&backend, &arguments, name](BackendOptions options) {
        if (name == "vulkan") {
            options.device = arguments.device;
            if (options.kernel.empty()) options.kernel = arguments.kernel;
        } else {
            options.threads = arguments.threads;
        }
        return backend.create(options);
    };
}

std::vector<std::pair<std::string, std::string>> baseline_options(const CostArguments& arguments) {
    std::vector<std::pair<std::string, std::string>> given;
    const auto add = [&](const char* name, const std::string& value) {
        if (!value.empty()) given.emplace_back(name, value);
    };
    add("--backend", arguments.backend == "cpu" ? "" : arguments.backend);
    if (arguments.backend == "vulkan") add("--device", arguments.device);
    add("--kernel", arguments.kernel);
    add("--precision", arguments.precision);
    if (arguments.backend == "cpu" && arguments.threads > 0) add("--threads", fmt::format("{}", arguments.threads));
    add("--size", arguments.options.size.empty() ? default_size : arguments.options.size);
    std::ranges::move(given_options(arguments.options), std::back_inserter(given));
    return given;
}

CostRequest request_of(const CostArguments& arguments, const CommandContext& context, const Scene& scene,
    const std::vector<std::string>& inputs, const std::filesystem::path& references) {
    CostRequest request;
    request.scene_file = arguments.scene;
    for (const std::string& file : inputs) request.scene_bytes += hash_of(read_file(file));
    request.program = git_version();
    RenderOptions options = arguments.options;
    if (options.size.empty()) options.size = default_size;
    request.baseline.render = settings_from(options, scene);
    request.baseline.backend.precision = precision_from(arguments.precision);
    request.baseline.backend.kernel = arguments.kernel;
    request.given = baseline_options(arguments);
    request.backend = arguments.backend;
    request.reference_backend = arguments.reference_backend;
    request.make = maker(context, arguments.backend, arguments);
    request.make_reference = maker(context, arguments.reference_backend, arguments);
    request.knobs = arguments.knobs;
    request.references = references;
    if (arguments.references.empty() && arguments.reference.empty()) request.cache_fault = tell_cache_fault;
    request.reference_file = arguments.reference;
    request.seconds = arguments.seconds;
    request.seed = arguments.options.seed;
    request.threads = arguments.threads;
    if (!arguments.resume.empty() && std::filesystem::exists(arguments.resume))
        request.earlier = samples_from_bytes(read_file(arguments.resume), arguments.resume);
    return request;
}

void list_arms(const CommandContext& context, const Scene& scene, const CostRequest& request) {
    std::vector<SkippedArm> skipped;
    nlohmann::json list{{"arms", nlohmann::json::array()}, {"not_measured", nlohmann::json::array()}};
    const RendererInfo renderer = request.make(request.baseline.backend)->info();
    for (const CostArm& arm : single_arms(scene, request, renderer, 0.0, skipped)) {
        fmt::print("{:32} {}\n", arm.name(), arm.options);
        list["arms"].push_back({{"knob", arm.knob}, {"setting", arm.setting}, {"options", arm.options}});
    }
    for (const SkippedArm& arm : skipped) {
        fmt::print("{} {}: not measured: {}\n", arm.knob, arm.setting, arm.reason);
        list["not_measured"].push_back({{"knob", arm.knob}, {"setting", arm.setting}, {"reason", arm.reason}});
    }
    write_json(context, list);
}

// What was not done for want of time; empty: all was.
std::string not_done(const CostReport& report) {
    const auto skipped = std::ranges::count_if(report.skipped, &SkippedArm::for_time);
    std::string text = skipped == 0 ? "" : fmt::format("{} setting{} not measured", skipped, skipped == 1 ? "" : "s");
    if (!report.whole)
        text += std::string(text.empty() ? "" : "; ") +
                (report.confirmations.empty() ? "nothing was measured anew" : "not all settings had their replicates");
    return text;
}

ExitStatus conclude(
    CostReport report, const CostArguments& arguments, const CommandContext& context, const CommandTime& time) {
    report.asked_error = fraction_from(arguments.error, "--error");
    report.asked_knobs = arguments.knobs;
    nlohmann::json json = to_json(report);
    json["command"] = context.command_line;
    json["git"] = git_version();
    if (context.stop.stop_requested()) json["stopped"] = true;
    fmt::print("{}", arguments.all ? all_to_text(report) : to_text(report));
    write_json(context, json);
    const std::string missing = not_done(report);
    return missing.empty() ? ExitStatus::fine : time.too_short(missing);
}

// The reference alone, for later measurements, maybe on another device.
ExitStatus reference_alone(const Scene& scene, const CostRequest& request, const CommandContext& context,
    const CommandTime& time, const CostArguments& arguments) {
    ProgressLine line;
    CostControl control;
    control.stop = time.token();
    control.progress = [&](double fraction, const std::string& text) { line.update(fraction, text); };
    const CostReference reference = render_reference_file(scene, request, time.left(), control);
    fmt::print("{}: {} samples a pixel in {:.0f} s by {}, known to {}\n", printable(arguments.reference),
        reference.samples, reference.seconds, reference.made_by, percent(reference.relative_uncertainty()));
    write_json(context, {{"reference", arguments.reference}, {"samples", reference.samples},
                            {"seconds", reference.seconds}, {"relative_uncertainty", reference.relative_uncertainty()},
                            {"image_mean", reference.image_mean()}, {"made_by", reference.made_by},
                            {"options", reference.options}, {"image", reference.image}, {"git", reference.program}});
    return ExitStatus::fine;
}

ExitStatus cost(const CostArguments& arguments, const CommandContext& context, const CommandTime& time) {
    (void)fraction_from(arguments.error, "--error");  // refused before any work
    if (!arguments.device.empty() && arguments.backend != "vulkan" && arguments.reference_backend != "vulkan")
        throw InputError("--device: the cpu backend has no choice of devices; leave it out, or add --backend vulkan");
    if (arguments.reference_only && arguments.reference.empty())
        throw InputError("--reference-only: say with --reference which file it is");
    NothingToKeep until_reference(context.interrupts);
    std::vector<std::string> inputs;
    const Scene scene = scene_from(arguments.scene, inputs);
    std::vector<std::string> read = inputs;  // the reference is no part of the scene that it is recognised by
    if (!arguments.reference_only && !arguments.reference.empty()) read.push_back(arguments.reference);
    const std::filesystem::path references = references_of(arguments);
    // A file to go on from is written again.
    check_outputs(context,
        {{"--resume", arguments.resume}, output_of(references),
            {"--reference", arguments.reference_only ? arguments.reference : ""}},
        read);
    CostRequest request = request_of(arguments, context, scene, inputs, references);
    check_memory(request.baseline.render);
    if (arguments.list) {
        list_arms(context, scene, request);
        return ExitStatus::fine;
    }
    request.seconds = time.left();
    request.read = &context.read;
    if (arguments.reference_only) {
        until_reference.end();
        return reference_alone(scene, request, context, time, arguments);
    }
    std::mutex mutex;  // no file is left half-written
    std::optional<CostReport> so_far;
    request.keep = [&](const CostReport& known) {
        const std::lock_guard lock(mutex);
        so_far = known;
    };
    std::optional<InputError> not_saved;  // why the last save was none: what was measured is told first
    const auto last_resort = time.at_any_rate([&] {
        const std::lock_guard lock(mutex);
        if (!so_far) return time.too_short("nothing is known yet");
        const ExitStatus status = conclude(*so_far, arguments, context, time);
        return not_saved ? throw *not_saved : status;
    });
    CostReport report;
    {
        ProgressLine line;
        CostControl control;
        control.stop = time.token();
        control.progress = [&](double fraction, const std::string& text) {
            until_reference.end();
            line.update(fraction, text);
        };
        if (!arguments.resume.empty())
            control.save = [&](const CostSamples& samples) {
                const std::lock_guard lock(mutex);
                not_saved.reset();
                try {
                    write_text_file(arguments.resume, to_bytes(samples), context.read);
                } catch (const InputError& error) {
                    not_saved = error;
                }
            };
        report = run_cost(scene, std::move(request), control);
    }
    last_resort->done();
    const ExitStatus status = conclude(report, arguments, context, time);
    return not_saved ? throw *not_saved : status;
}

void add_measuring(CLI::App& command, CostArguments& arguments) {
    command
        .add_option("--time", arguments.seconds,
            "Seconds for everything, making kernels and the long reference included. What gets no time is listed")
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS")
        ->capture_default_str();
    command.add_option("--knob", arguments.knobs, "Only these knobs (see --list)")->type_name("NAME")->delimiter(',');
    command
        .add_option("--resume", arguments.resume, "Save all samples to FILE at intervals. Go on from it if it exists")
        ->type_name("FILE");
    command
        .add_option("--error", arguments.error, "Error that the table is for: 1% or 0.01, relative to the image's mean")
        ->type_name("ERROR")
        ->capture_default_str();
    command.add_flag("--all", arguments.all, "Print every setting that was measured, and those that were not");
    command
        .add_option("--reference", arguments.reference,
            "Long reference to measure against, written by --reference-only, maybe on another device")
        ->type_name("FILE")
        ->group(rare_options);
    command
        .add_flag("--reference-only", arguments.reference_only,
            "Render the long reference alone for --time seconds into the --reference FILE. Continue it where it exists")
        ->group(rare_options);
    command
        .add_option("--references", arguments.references,
            "Folder of long references, which later runs continue (default: tandem/references in the user's cache "
            "folder)")
        ->type_name("FOLDER")
        ->group(rare_options);
    command.add_flag("--no-cache", arguments.no_cache, "Neither read nor store the long reference")
        ->group(rare_options);
    command
        .add_option("--reference-backend", arguments.reference_backend, "Backend of the long reference: cpu or vulkan")
        ->capture_default_str()
        ->group(rare_options);
    command.add_flag("--list", arguments.list, "List the settings that would be measured; run nothing");
}

}  // namespace

void add_cost_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("cost", "Measure error against time for every setting that buys accuracy");
    const auto arguments = std::make_shared<CostArguments>();
    command->add_option("scene", arguments->scene, scene_help)->required()->transform(scene_name())->type_name("SCENE");
    add_render_options(*command, arguments->options);
    command->get_option("--size")->description(fmt::format(
        "Image size in pixels, WxH or the longer side. Times are for this size (default: {})", default_size));
    command->get_option("--seed")->description("Seed of the replicates and of their order");
    command->add_option("--backend", arguments->backend, "cpu or vulkan")->capture_default_str();
    command->add_option("--device", arguments->device, device_help);
    command->add_option("--kernel", arguments->kernel, kernel_help)->group(rare_options);
    command->add_option(
        "--precision", arguments->precision, fmt::format("Precision of the baseline: {}", precision_help));
    command->add_option("--threads", arguments->threads, "CPU threads (default: all)")->check(whole_between(1, 1024));
    add_measuring(*command, *arguments);
    add_common_options(*command, context,
        "  tandem cost scenes/cornell-classic.json --time 60\n"
        "  tandem cost scenes/cornell-classic.json --knob integrator,roulette --json cost.json\n"
        "  tandem cost scenes/glass.json --backend vulkan --time 300 --resume glass.samples --json glass.json\n"
        "  tandem cost scenes/glass.json --error 0.3% --time 300\n"
        "  tandem cost scenes/glass.json --list\n"
        "The baseline is the scene's own settings, changed by the options given. Every other arm changes one knob, "
        "or combines the best. All arms run shortly, then the best run until they reach 5, 1 and 0.3 %. "
        "Times are of rendering and denoising. "
        "Errors are against a long reference without a bounce limit, on the CPU in double precision. "
        "Ctrl-C concludes from what is there.\n"
        "Exit status: 0; 3 where the time was too short for some of the settings.");
    command->callback([&context, arguments] {
        context.action = [&context, arguments] {
            const CommandTime time(context, arguments->seconds);
            return time.work([&] { return cost(*arguments, context, time); });
        };
    });
}

}  // namespace tandem
