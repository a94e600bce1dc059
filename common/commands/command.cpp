#include "common/commands/command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>

#include "common/commands/arguments.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/memory.h"
#include "common/commands/old_names.h"
#include "common/commands/rank_items.h"
#include "common/deadline.h"
#include "common/distribution/ranks.h"
#include "common/error.h"
#include "common/files/write_file.h"
#include "common/scene/loader/scene_loader.h"
#include "common/text.h"

namespace tandem {

namespace {

constexpr const char* standard_output = "-";  // as a value of --json
constexpr std::array<std::string_view, 4> names_of_standard_output{
    standard_output, "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"};

// What is wrong with the arguments, and where to read on.
std::string parse_failure(const CLI::App& app, int argc, char** argv, const CLI::ParseError& error) {
    const std::vector<CLI::App*> chosen = app.get_subcommands();
    if (!chosen.empty()) return fmt::format("{}; see tandem {} --help", error.what(), chosen.front()->get_name());
    if (argc > 1 && argv[1][0] == '-') return fmt::format("{}; see tandem --help", error.what());
    std::string names;
    for (const CLI::App* command : app.get_subcommands({})) names += (names.empty() ? "" : ", ") + command->get_name();
    if (argc < 2) return "no command is named; there are " + names;
    const std::string meant = command_meant(app, argv[1]);
    return fmt::format(
        "'{}' is no command; there are {}{}", argv[1], names, meant.empty() ? "" : "; did you mean " + meant + "?");
}

void complain(const std::string& line) { fmt::print(stderr, "tandem: {}\n", escaped(line)); }

ExitStatus guarded(const std::function<ExitStatus()>& action) {
    try {
        return action();
    } catch (const DeviceError& error) {
        complain(error.what());
        return ExitStatus::no_device;
    } catch (const StoppedError& error) {
        complain(error.what());
        return ExitStatus::undecided;
    } catch (const std::bad_alloc&) {
        complain("out of memory; choose a smaller image");
        return ExitStatus::unusable_input;
    } catch (const std::exception& error) {
        complain(error.what());
        return ExitStatus::unusable_input;
    }
}

}  // namespace

void add_common_options(CLI::App& command, CommandContext& context, const std::string& examples) {
    command.add_option("--json", context.json_file, "Write the result to FILE, as JSON; - is standard output")
        ->type_name("FILE");
    command.add_flag("-v,--verbose", context.verbose, "Say more on stderr");
    command.footer("Examples:\n" + examples);
}

Scene scene_from(const std::string& file, std::vector<std::string>& inputs) {
    Scene scene = load_scene(file, &inputs);
    if (const std::string reason = beyond_memory(scene, default_settings(scene)); !reason.empty())
        throw input_error(file, "", reason, "simplify the models, or repeat fewer groups");
    for (const std::string& remark : scene.remarks) fmt::print(stderr, "tandem: {}\n", escaped(remark));
    return scene;
}

std::optional<Precision> precision_from(const std::string& name) {
    if (name.empty()) return std::nullopt;
    const auto found = std::ranges::find(precision_names, name);
    if (found == precision_names.end())
        throw InputError("--precision: '" + name + "' is unknown; " +
                         did_you_mean(name, {precision_names.begin(), precision_names.end()}) +
                         fmt::format("choose one of {}", fmt::join(precision_names, ", ")));
    return static_cast<Precision>(found - precision_names.begin());
}

double fraction_from(const std::string& text, const std::string& option) {
    std::size_t used = 0;
    double value = NAN;
    try {
        value = std::stod(text, &used);
    } catch (const std::exception&) {
        used = 0;
    }
    std::string rest = text.substr(used);
    std::erase(rest, ' ');
    if (rest == "%") value /= 100.0;
    if (used == 0 || !(rest.empty() || rest == "%") || !std::isfinite(value) || value <= 0.0)
        throw InputError(option + ": '" + text + "' is no fraction above 0; write 0.5% or 0.005");
    if (rest.empty() && value >= 1.0)
        throw InputError(fmt::format("{0}: '{1}' is {2:g} %; write {1}% or {2:g}%", option, text, 100.0 * value));
    return value;
}

CLI::Validator above_zero(double most) {
    const auto check = [most](std::string& text) -> std::string {
        double value = 0.0;
        if (CLI::detail::lexical_cast(text, value) && value > 0.0 && value <= most) return {};
        return fmt::format("'{}' is no number above 0 and at most {:g}", text, most);
    };
    return {check, ""};
}

CLI::Validator whole_between(std::uint64_t least, std::uint64_t most) {
    const auto check = [least, most](std::string& text) -> std::string {
        const auto value = whole_number<std::uint64_t>(text);
        if (value && *value >= least && *value <= most) return {};
        return fmt::format("'{}' is no whole number from {} to {}", text, least, most);
    };
    return {check, ""};
}

void check_outputs(const CommandContext& context, std::vector<Output> outputs, const std::vector<std::string>& inputs) {
    if (context.json_file != standard_output) outputs.push_back({"--json", context.json_file});
    std::vector<Output> all{{"standard output", "/proc/self/fd/1", OutputKind::open},
        {"standard error", "/proc/self/fd/2", OutputKind::open}};
    if (context.json_descriptor >= 0)
        all.push_back({"--json -", fmt::format("/proc/self/fd/{}", context.json_descriptor), OutputKind::open});
    all.insert(all.end(), outputs.begin(), outputs.end());
    check_outputs(all, inputs);
    for (const std::string& input : inputs) context.read.add(input);
}

void check_memory(const RenderSettings& settings) {
    // A pass in hand, the copy that a stop falls back on, the runs so far, their totals, and the image made of them.
    // Adaptive sampling adds the sums of its passes.
    const std::uint64_t planes = settings.sampling == Sampling::adaptive ? 6 : 5;
    check_memory(settings, planes * channel_count * sizeof(Moments), "choose a smaller --size");
}

void check_memory(const RenderSettings& settings, std::uint64_t bytes_per_pixel, const std::string& mend) {
    const std::uint64_t needed = std::uint64_t{settings.width} * settings.height * bytes_per_pixel;
    if (const std::uint64_t free = free_bytes(); needed > free)
        throw InputError(fmt::format("an image of {} x {} pixels takes at least {} of memory, and {} are free; {}",
            settings.width, settings.height, shown_bytes(needed), shown_bytes(free), mend));
}

void write_json(const CommandContext& context, const nlohmann::json& report) {
    if (context.json_file.empty()) return;
    const std::string text = report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    if (context.json_descriptor < 0) return write_text_file(context.json_file, text, context.read);
    if (!write_all(context.json_descriptor, text) && !nobody_reads(errno))
        throw Error(
            std::string("--json -: standard output cannot be written to its end (") + std::strerror(errno) + ")");
}

namespace {

// An argument for the record, which is stored and passed on: an absolute path is cut to its last part.
std::string without_folder(const std::string& argument) {
    const std::size_t path = argument.starts_with('/') ? 0 : argument.find("=/");
    if (path == std::string::npos) return argument;
    const std::string before = path == 0 ? "" : argument.substr(0, path + 1);
    return before + argument.substr(argument.rfind('/') + 1);
}

// What `tandem --help` says, and the options of the program itself.
void describe_program(CLI::App& app) {
    app.require_subcommand(1);
    app.set_version_flag("--version", "tandem 0.1.0");
    app.formatter(std::make_shared<HelpPage>());
    app.set_help_all_flag("--help-all", "Show this page with the options that few need, and exit");
    app.get_help_ptr()->description("Show this page and exit");
    app.footer(
        "Type first:\n"
        "  tandem render scenes/cornell-classic.json -o box.png    an image, in seconds\n"
        "  tandem verify scenes/cornell-thesis.json                do CPU and Vulkan agree?\n"
        "  tandem COMMAND --help                                   options and examples of a command\n\n"
        "Exit status: 0 fine or agree, 1 disagree or failed, 2 unusable input, 3 undecided or not done in the "
        "--time, 4 no usable device. A reader that goes away (| head -1) changes neither the status nor files. "
        "No output overwrites a file that was read.");
}

void add_commands(CLI::App& app, CommandContext& context) {
    add_render_command(app, context);
    add_view_command(app, context);
    add_verify_command(app, context);
    add_compare_command(app, context);
    add_denoise_command(app, context);
    add_effects_command(app, context);
    add_bench_command(app, context);
    add_cost_command(app, context);
    add_trace_command(app, context);
    add_stability_command(app, context);
    add_export_command(app, context);
    add_import_command(app, context);
    add_merge_command(app, context);
    add_plan_command(app, context);
    add_work_command(app, context);
    add_merge_results_command(app, context);
    add_judges_command(app, context);
    add_devices_command(app, context);
    add_exercise_command(app, context);
}

void parse(CLI::App& app, int argc, char** argv) {
    RenamedArguments renamed = with_new_names(argc, argv);
    for (const std::string& note : renamed.notes) complain(note);
    check_arguments(app, renamed.arguments);
    std::ranges::reverse(renamed.arguments);  // as CLI11 takes them
    app.parse(std::move(renamed.arguments));
}

// The chosen command, or its items under mpirun.
ExitStatus act(const CLI::App& app, CommandContext& context, StandardStreams& streams) {
    if (std::ranges::find(names_of_standard_output, context.json_file) != names_of_standard_output.end()) {
        context.json_file = standard_output;
        context.json_descriptor = streams.take_standard_output();
    }
    const CLI::App& command = *app.get_subcommands().front();
    const bool by_items = has_ranks() && has_items_for_ranks(command.get_name());
    if (has_ranks() && !by_items && command.get_name() != "render")
        throw UnsupportedError(
            "mpirun shares out render, verify and stability; tandem plan splits cost and bench, whose times are "
            "of one machine each");
    check_outputs(context, {}, {});
    const ExitStatus status = by_items ? items_by_ranks(command, context) : context.action();
    if (const int error = streams.failure(); error != 0)
        throw Error(std::string("standard output cannot be written (") + std::strerror(error) + ")");
    return status;
}

}  // namespace

int run_program(int argc, char** argv, const Program& program) {
    StandardStreams streams;
    InterruptWatch interrupts;
    CLI::App app{
        "Tandem renders a scene with two independent path tracers, one on the CPU and one on a Vulkan device. A "
        "statistical test decides whether their images agree.",
        "tandem"};
    describe_program(app);
    std::string command_line = "tandem";
    for (int i = 1; i < argc; ++i) command_line += " " + without_folder(argv[i]);
    FilesRead read;
    CommandContext context{.program = program,
        .command_line = command_line,
        .stop = interrupts.token(),
        .json_file = {},
        .action = {},
        .interrupts = interrupts,
        .read = read};
    add_commands(app, context);
    // A file that meets its size limit then fails to be written, which is told; else the program would be ended.
    std::signal(SIGXFSZ, SIG_IGN);
    return static_cast<int>(guarded([&] {
        try {
            parse(app, argc, argv);
        } catch (const CLI::Success& request) {  // --help, --version
            app.exit(request);
            return ExitStatus::fine;
        } catch (const CLI::ParseError& error) {
            throw InputError(parse_failure(app, argc, argv, error));
        }
        return act(app, context, streams);
    }));
}

}  // namespace tandem
