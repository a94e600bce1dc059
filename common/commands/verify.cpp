// tandem verify: two backends, one verdict a scene.
#include "common/validation/verify/verify.h"

#include <fmt/format.h>

#include <cmath>

#include "common/commands/arguments.h"
#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/verdict_options.h"
#include "common/deadline.h"
#include "common/error.h"
#include "common/self_test/self_test.h"
#include "common/text.h"

namespace tandem {

namespace {

struct VerifyArguments {
    std::vector<std::string> scenes;
    std::string reference = "cpu", candidate = "vulkan", device, reference_device, kernel, reference_kernel, precision,
                reference_precision;
    RenderOptions render;
    CriteriaArguments criteria;
    double seconds = 120.0;
    std::optional<std::uint64_t> samples;
    std::string oracle = "oracle";
    bool no_paired = false, validation = false, convergence = false;
};

// Says in a line how exactly each side's device computes, where it has an arithmetic of its own.
std::vector<DeviceSelfTest> self_tests_of(std::initializer_list<Renderer*> sides) {
    std::vector<DeviceSelfTest> tests;
    for (Renderer* const side : sides) {
        const std::optional<DeviceSelfTest> test = self_test_of(*side);
        if (!test) continue;
        fmt::print("Self-test of {}: {}\n", test->device, in_short(test->result));
        tests.push_back(*test);
    }
    return tests;
}

RenderSettings verification_settings_from(const RenderOptions& options, const Scene& scene) {
    refuse_adaptive_sampling(options);
    RenderSettings settings = settings_from(options, scene);
    if (options.size.empty()) {
        const RenderSettings small = verification_settings(scene);
        settings.width = small.width;
        settings.height = small.height;
    }
    check_memory(settings);
    return settings;
}

std::string text_of(const Estimated& figure, const char* format) {
    return fmt::format(fmt::runtime(format), figure.value, figure.low, figure.high);
}

void print_convergence(const SceneVerdict& verdict) {
    const ConvergenceReport& report = *verdict.convergence;
    for (const auto& [name, side] : {std::pair{&verdict.reference_name, &report.reference},
             std::pair{&verdict.candidate_name, &report.candidate}}) {
        if (std::isnan(side->slope.value)) {
            fmt::print("    {}: every sample is the same, so no error falls; off by {} of the mean\n", *name,
                percent(std::sqrt(std::max(0.0, side->squared_bias.value))));
            continue;
        }
        fmt::print(
            "    {}: error falls as samples^{}, bias floor {} ({} to {}) of the mean, variance {} of what the "
            "samples show\n",
            *name, text_of(side->slope, "{:.3f} ({:.3f} to {:.3f})"),
            percent(std::sqrt(std::max(0.0, side->squared_bias.value))),
            percent(std::sqrt(std::max(0.0, side->squared_bias.low))),
            percent(std::sqrt(std::max(0.0, side->squared_bias.high))),
            text_of(side->variance_ratio, "{:.3f} ({:.3f} to {:.3f})"));
    }
    fmt::print("    between them: squared difference {} of what their noise explains, at {} samples\n",
        text_of(report.between.back(), "{:.3f} ({:.3f} to {:.3f})"), report.samples.back());
    std::fflush(stdout);
}

// How the two sides' errors fall, in as many seconds again as the verdict may take.
void add_convergence(const Scene& scene, Renderer& reference, Renderer& candidate, const VerifyArguments& arguments,
    const CommandContext& context, SceneVerdict& verdict) {
    ConvergenceOptions options;
    options.budget_seconds = arguments.seconds;
    options.seed = arguments.render.seed + 2;
    options.stop = context.stop;
    {
        ProgressLine line;
        options.progress = [&](double fraction) { line.update(fraction, scene.name + ": convergence"); };
        verdict.convergence = measure_convergence(scene, verdict.settings, reference, candidate, options);
    }
    if (verdict.convergence)
        print_convergence(verdict);
    else
        fmt::print("    convergence: cannot be measured in {} s, or the image is black; give more --time\n",
            arguments.seconds);
}

// The command that follows a sample of the worst pixel on both backends, and on the oracle.
std::string trace_command(const VerifyArguments& arguments, const std::string& scene, const RenderSettings& settings,
    const WorstPixel& worst) {
    const std::string file = scene.find(' ') == std::string::npos ? scene : "'" + scene + "'";
    std::string command = fmt::format("tandem trace {} --pixel {},{} --sample {} --seed {} --size {}x{}", file, worst.x,
        worst.y, worst.sample, worst.seed, settings.width, settings.height);
    const auto add = [&](const std::string& option, const std::string& value, bool given) {
        if (given) command += fmt::format(" {} {}", option, value);
    };
    const auto chosen = [&](const char* backend, const std::string& of_candidate, const std::string& of_reference) {
        return arguments.candidate == backend ? of_candidate : arguments.reference == backend ? of_reference : "";
    };
    const std::string device = chosen("vulkan", arguments.device, arguments.reference_device);
    const std::string precision = chosen("cpu", arguments.precision, arguments.reference_precision);
    const std::string of_gpu = chosen("vulkan", arguments.precision, arguments.reference_precision);
    for (const auto& [option, value] : given_options(arguments.render))
        add(option, value, option != "--accumulation" && option != "--sampling");  // of a path there is but one sample
    add("--device", "'" + device + "'", !device.empty());
    add("--precision", precision, !precision.empty());
    add("--vulkan-precision", of_gpu, !of_gpu.empty());
    return command;
}

ExitStatus verify(const VerifyArguments& arguments, const CommandContext& context) {
    NothingToKeep starting(context.interrupts);
    // Every scene is read before the first is rendered: bad input costs no time.
    std::vector<Scene> scenes;
    std::vector<std::string> names, inputs;
    for (const std::string& file : arguments.scenes) {
        scenes.push_back(scene_from(file, inputs));
        names.push_back(scenes.back().name);
    }
    std::vector<RenderSettings> settings;
    for (const Scene& scene : scenes) settings.push_back(verification_settings_from(arguments.render, scene));
    const Criteria criteria = criteria_from(arguments.criteria, {});
    check_outputs(arguments.criteria, context, names, inputs);
    const BackendList& backends = context.program.backends;
    const auto reference = find_backend(backends, arguments.reference)
                               .create({.device = arguments.reference_device,
                                   .precision = precision_from(arguments.reference_precision),
                                   .kernel = arguments.reference_kernel});
    const auto candidate = find_backend(backends, arguments.candidate)
                               .create({.device = arguments.device,
                                   .precision = precision_from(arguments.precision),
                                   .kernel = arguments.kernel,
                                   .validation = arguments.validation});
    const auto oracle =
        arguments.oracle == "none" ? nullptr : find_backend(backends, arguments.oracle).create(BackendOptions{});
    fmt::print("Reference: {}, {}\nCandidate: {}, {}\n", reference->info().backend, reference->info().device,
        candidate->info().backend, candidate->info().device);
    const std::vector<DeviceSelfTest> self_tests = self_tests_of({reference.get(), candidate.get()});
    std::fflush(stdout);
    starting.end();

    VerifyOptions options;
    options.criteria = criteria;
    options.budget_seconds = arguments.seconds;
    options.max_samples = arguments.samples.value_or(0);
    options.seed = arguments.render.seed;
    options.paired = !arguments.no_paired;
    options.oracle = oracle.get();
    options.scenes = scenes.size();
    std::vector<SceneVerdict> verdicts;
    const auto run = [&](std::size_t i) {
        const Deadline deadline(context.stop, with_overrun(arguments.seconds));
        options.stop = deadline.token();
        options.settings = settings[i];
        {
            ProgressLine line;
            options.progress = [&](double fraction, const std::string& text) {
                line.update(fraction, scenes[i].name + ": " + text);
            };
            verdicts.push_back(verify_scene(scenes[i], *reference, *candidate, options));
        }
        if (verdicts.back().worst)
            verdicts.back().worst->command =
                trace_command(arguments, arguments.scenes[i], settings[i], *verdicts.back().worst);
        print_verdict(verdicts.back(), context.verbose);
        if (arguments.convergence)
            add_convergence(scenes[i], *reference, *candidate, arguments, context, verdicts.back());
    };
    std::exception_ptr failure;  // a device that is lost takes no earlier scene's verdict with it
    for (std::size_t i = 0; i < scenes.size() && !context.stop.stop_requested() && !failure; ++i) {
        try {
            run(i);
        } catch (const std::exception&) {
            if (verdicts.empty()) throw;
            failure = std::current_exception();
        }
    }
    std::vector<std::string> not_run;
    for (std::size_t i = verdicts.size(); i < scenes.size(); ++i) not_run.push_back(scenes[i].name);
    const ExitStatus status = conclude("verify", verdicts, arguments.criteria, context, not_run, self_tests);
    if (failure) std::rethrow_exception(failure);
    if (not_run.empty()) return status;
    fmt::print(stderr, "tandem: stopped; {} of {} scenes were not verified\n", not_run.size(), scenes.size());
    return status;
}

void add_rare_options(CLI::App& command, VerifyArguments& arguments) {
    const auto add = [&](const char* name, std::string& value, const std::string& text) {
        command.add_option(name, value, text)->group(rare_options);
    };
    add("--kernel", arguments.kernel, fmt::format("Candidate's {}", kernel_help));
    add("--reference-kernel", arguments.reference_kernel, "Vulkan kernels of the reference");
    add("--reference-device", arguments.reference_device, "Vulkan device of the reference");
    add("--reference-precision", arguments.reference_precision,
        fmt::format("Precision of the reference: {}", precision_help));
    command.add_flag("--no-paired", arguments.no_paired, "Leave out the paired seeds. They find small faults sooner")
        ->group(rare_options);
    command.add_flag("--validation", arguments.validation, "Use Vulkan's validation layers; any message is an error")
        ->group(rare_options);
}

}  // namespace

void add_verify_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("verify", "Decide whether two backends agree on scenes");
    const auto arguments = std::make_shared<VerifyArguments>();
    arguments->render.seed = 1;
    command->add_option("scenes", arguments->scenes, "Scene files")->required()->type_name("SCENE");
    command->add_option("--reference", arguments->reference, "Backend that is trusted")->capture_default_str();
    command->add_option("--candidate", arguments->candidate, "Backend that is judged")->capture_default_str();
    command->add_option(
        "--device", arguments->device, "Vulkan device of the candidate: its index, or part of its name");
    command->add_option(
        "--precision", arguments->precision, fmt::format("Precision of the candidate: {}", precision_help));
    command->add_option("--time", arguments->seconds, "Seconds of a scene, at most")
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS")
        ->capture_default_str();
    command
        ->add_option("--samples", arguments->samples,
            "Samples a pixel and side, at most (default: 1048576; more below 128x128 pixels)")
        ->check(whole_between(64, std::uint64_t{1} << 40));
    command
        ->add_option("--oracle", arguments->oracle,
            "Reference oracle that says which side is wrong where they disagree: oracle or none")
        ->check(one_of({"oracle", "none"}))
        ->capture_default_str();
    command->add_flag("--convergence", arguments->convergence,
        "Also measure how the errors of both fall with samples. This takes as much --time again");
    add_render_options(*command, arguments->render);
    command->get_option("--size")->description(
        "Image size in pixels, WxH or the longer side (default: the scene's, at most 128)");
    add_rare_options(*command, *arguments);
    add_criteria(*command, arguments->criteria, {});
    add_common_options(*command, context,
        "  tandem verify scenes/cornell-thesis.json\n"
        "  tandem verify scenes/furnace.json scenes/glass.json --json verdict.json --report report\n"
        "  tandem verify scenes/furnace.json --reference oracle --candidate cpu --precision double\n"
        "Exit status: 0 agree, 1 disagree, 3 undecided within the time.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return verify(*arguments, context); }; });
}

}  // namespace tandem
