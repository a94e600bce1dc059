// tandem verify: two renderers, one verdict a scene.
#include "common/validation/verify/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/commands/arguments.h"
#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/layer_pass.h"
#include "common/commands/memory.h"
#include "common/commands/shipped_files.h"
#include "common/commands/verdict_options.h"
#include "common/commands/verify_films.h"
#include "common/commands/verify_presets.h"
#include "common/commands/verify_sides.h"
#include "common/deadline.h"
#include "common/error.h"
#include "common/stopwatch.h"
#include "common/text.h"
#include "common/validation/verify/total_budget.h"
#include "common/validation/verify/verify_in_bins.h"

namespace tandem {

namespace {

RenderSettings verification_settings_from(const RenderOptions& options, const Scene& scene) {
    refuse_adaptive_sampling(options);
    RenderSettings settings = settings_from(options, scene);
    if (options.size.empty()) {
        const RenderSettings small = verification_settings(scene);
        settings.width = small.width;
        settings.height = small.height;
    }
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
    options.budget_seconds = arguments.seconds.value_or(default_seconds);
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
            arguments.seconds.value_or(default_seconds));
}

// The command that follows a sample of the worst pixel on both backends, and on the oracle.
std::string trace_command(
    const VerifyArguments& arguments, const std::string& scene, FilmSize film, const WorstPixel& worst) {
    const std::string file = scene.find(' ') == std::string::npos ? scene : "'" + scene + "'";
    std::string command = fmt::format("tandem trace {} --pixel {},{} --sample {} --seed {} --size {}x{}", file, worst.x,
        worst.y, worst.sample, worst.seed, film.width, film.height);
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

// The arguments, with the preset's where they say nothing.
VerifyArguments completed(VerifyArguments arguments) {
    if (!arguments.preset.empty()) {
        const VerifyPreset preset = verify_preset(arguments.preset);
        if (arguments.scenes.empty()) arguments.scenes = preset.scenes;
        if (arguments.render.size.empty()) arguments.render.size = preset.size;
        if (arguments.total_time.empty()) arguments.total_time = fmt::format("{}", preset.total_seconds);
    }
    if (arguments.scenes.empty())
        throw InputError("verify: no scene is named; name scene files, or a --preset: smoke, driver or full");
    if (!arguments.total_time.empty() && arguments.convergence)
        throw InputError("--convergence: goes with --time, not with a time in total; leave one of them out");
    return arguments;
}

// The words of `tandem render` that make the candidate.
std::vector<std::string> candidate_words(const VerifyArguments& arguments) {
    std::vector<std::string> words;
    const auto add = [&](const std::string& option, const std::string& value) {
        if (!value.empty()) words.insert(words.end(), {option, value});
    };
    for (const auto& [option, value] : given_options(arguments.render)) add(option, value);
    add("--device", arguments.device);
    add("--kernel", arguments.kernel);
    add("--precision", arguments.precision);
    return words;
}

// One look a scene under Vulkan's validation layer. Its messages fail the run, whatever the images say.
struct LayerLooks {
    bool wanted = false;
    std::size_t clean = 0, left_out = 0;
    std::string not_run;  // why: no layer, or a scene that the process cannot render
    std::vector<std::pair<std::string, std::string>> messages;  // of a scene

    void add(const Scene& scene, const LayerPass& pass) {
        if (pass.outcome == LayerPass::Outcome::clean) ++clean;
        if (pass.outcome == LayerPass::Outcome::too_slow) ++left_out;
        if (pass.outcome == LayerPass::Outcome::not_run) not_run = pass.text;
        if (pass.outcome != LayerPass::Outcome::messages) return;
        messages.emplace_back(scene.name, pass.text);
        fmt::print("{}: the Vulkan validation layer reports:\n    {}\n", escaped(scene.name), pass.text);
        std::fflush(stdout);
    }
    void print() const {
        if (!wanted) return;
        std::string text = fmt::format("{} {} without a message", clean, clean == 1 ? "scene" : "scenes");
        if (!messages.empty()) text += fmt::format(", {} with messages", messages.size());
        if (left_out > 0) text += fmt::format(", {} left out as their time is short", left_out);
        if (!not_run.empty()) text += "; not used: " + not_run;
        fmt::print("Validation layer: {}\n", text);
    }
};

// What both ways to share the time need.
struct Work {
    const VerifyArguments& arguments;
    const CommandContext& context;
    const std::vector<Scene>& scenes;
    const std::vector<VerifiedFilm>& films;
    Renderer &reference, &candidate;
    const Programs& programs;
    VerifyOptions options;
    LayerLooks layer;

    // Returns the seconds that are left.
    [[nodiscard]] double look_under_the_layer(std::size_t i, double seconds) {
        constexpr double least_seconds = 10.0;  // it takes about one
        if (!layer.wanted || !layer.not_run.empty()) return seconds;
        if (seconds < least_seconds) {
            ++layer.left_out;
            return seconds;
        }
        const Stopwatch watch;
        constexpr double share = 0.2;
        layer.add(scenes[i],
            look_under_layer(arguments.scenes[i], candidate_words(arguments), share * seconds, context.stop));
        return seconds - watch.seconds();
    }

    [[nodiscard]] SceneVerdict verdict_on(std::size_t i, double seconds, const std::string& text) {
        const Deadline deadline(context.stop, with_overrun(seconds));
        options.stop = deadline.token();
        options.settings = films[i].settings;
        options.budget_seconds = seconds;
        options.misreading = misreading_of(scenes[i], arguments.scenes[i]);
        ProgressLine line;
        options.progress = [&](double fraction, const std::string& what) {
            line.update(fraction, text + scenes[i].name + ": " + what);
        };
        for (ProgramRenderer* const program : programs) program->set_scene_file(arguments.scenes[i]);
        SceneVerdict verdict;
        try {
            verdict = films[i].film ? verify_in_bins(scenes[i], reference, candidate, options, *films[i].film)
                                    : verify_scene(scenes[i], reference, candidate, options);
        } catch (const ProgramFailure& error) {
            return failed_verdict(scenes[i], options, reference.info(), candidate.info(), error);
        }
        verdict.forecast_seconds = forecast_seconds(verdict);
        if (verdict.worst && programs.empty())
            verdict.worst->command = trace_command(
                arguments, arguments.scenes[i], films[i].film.value_or(size_of(films[i].settings)), *verdict.worst);
        return verdict;
    }
};

struct Verified {
    std::vector<SceneVerdict> verdicts;
    std::vector<std::string> not_run;
    std::exception_ptr failure;  // a device that is lost takes no earlier scene's verdict with it
};

Verified verify_each(Work& work) {
    Verified outcome;
    const std::size_t scenes = work.scenes.size();
    const double seconds = work.arguments.seconds.value_or(default_seconds);
    for (std::size_t i = 0; i < scenes && !work.context.stop.stop_requested() && !outcome.failure; ++i) {
        try {
            outcome.verdicts.push_back(work.verdict_on(i, work.look_under_the_layer(i, seconds), ""));
            print_verdict(outcome.verdicts.back(), work.context.verbose);
            if (work.arguments.convergence && outcome.verdicts.back().failure.empty())
                add_convergence(work.scenes[i], work.reference, work.candidate, work.arguments, work.context,
                    outcome.verdicts.back());
        } catch (const std::exception&) {
            if (outcome.verdicts.empty()) throw;
            outcome.failure = std::current_exception();
        }
    }
    for (std::size_t i = outcome.verdicts.size(); i < scenes; ++i) outcome.not_run.push_back(work.scenes[i].name);
    return outcome;
}

// A scene whose turn comes again is told in a line.
void print_so_far(const SceneVerdict& verdict, bool verbose) {
    if (verdict.verdict != Verdict::undecided || !verdict.failure.empty()) return print_verdict(verdict, verbose);
    fmt::print("{}: undecided after {}{}\n", escaped(verdict.scene), duration(verdict.seconds),
        verdict.forecast_seconds ? fmt::format(", needs about {}", duration(*verdict.forecast_seconds))
                                 : ", too early to forecast what it needs");
    std::fflush(stdout);
}

Verified verify_within(Work& work, double seconds) {
    const Stopwatch watch;
    const Deadline end(work.context.stop, with_overrun(seconds));
    const std::uint64_t seed = work.options.seed;
    work.options.scenes *= most_rounds;
    TotalBudget budget;
    budget.scenes = work.scenes.size();
    budget.seconds = seconds;
    budget.most_seconds = work.arguments.seconds.value_or(most_seconds);
    budget.stop = end.token();
    budget.elapsed = [&] { return watch.seconds(); };
    budget.verify = [&](std::size_t i, double share, std::size_t round) {
        work.options.seed = seed + 2 * round;
        if (round == 0) share = std::max(0.1 * share, work.look_under_the_layer(i, share));
        SceneVerdict verdict = work.verdict_on(i, share, round > 0 ? fmt::format("again, {}, ", duration(share)) : "");
        print_so_far(verdict, work.context.verbose);
        return verdict;
    };
    std::vector<std::optional<SceneVerdict>> last;
    Verified outcome;
    try {
        verify_within(budget, last);
    } catch (const std::exception&) {
        outcome.failure = std::current_exception();
    }
    for (std::size_t i = 0; i < last.size(); ++i) {
        if (last[i])
            outcome.verdicts.push_back(std::move(*last[i]));
        else
            outcome.not_run.push_back(work.scenes[i].name);
    }
    if (outcome.failure && outcome.verdicts.empty()) std::rethrow_exception(outcome.failure);
    return outcome;
}

// What the scenes that meet their closed forms say of those that do not.
void print_common_suspects(const std::vector<SceneVerdict>& verdicts) {
    fmt::print("After comparison with the scenes that meet their closed forms:\n");
    for (const SceneVerdict& verdict : verdicts)
        if (misses_on_both_sides(verdict)) fmt::print("    {}: {}\n", escaped(verdict.scene), told(verdict.suspects));
}

// Why a time in total did not do, and what would.
void print_what_is_needed(const std::vector<SceneVerdict>& verdicts, double seconds) {
    const auto undecided = std::ranges::count(verdicts, Verdict::undecided, &SceneVerdict::verdict);
    if (undecided == 0) return;
    const std::optional<double> needed = seconds_needed(verdicts);
    fmt::print("{} of {} scenes are undecided after {}", undecided, verdicts.size(), duration(seconds));
    if (needed)
        fmt::print("; they need about {} more: --total-time {:.0f}min\n", duration(*needed),
            std::ceil((seconds + *needed) / 60.0));
    else
        fmt::print("; some need a time that cannot be forecast, or are black\n");
}

// What all scenes have in common. `arguments` and `backends` must outlive it: other kernels are made on request.
VerifyOptions options_from(const VerifyArguments& arguments, const Renderer& reference, const Renderer& candidate,
    const Programs& programs, const BackendList& backends) {
    VerifyOptions options;
    options.criteria = criteria_from(arguments.criteria, criteria_for({&reference, &candidate}, programs));
    options.criteria.strict = arguments.strict;
    options.max_samples = arguments.samples.value_or(0);
    options.seed = arguments.render.seed;
    options.paired = !arguments.no_paired && all_follow_numbers(programs);
    options.scenes = std::max<std::size_t>(arguments.scenes.size(), arguments.among);
    if (arguments.candidate == "vulkan") {
        options.kernels = {"stages", "image-stages", "megakernel"};
        options.with_kernel = [&arguments, &backends](const std::string& kernel) {
            return find_backend(backends, "vulkan")
                .create(
                    {.device = arguments.device, .precision = precision_from(arguments.precision), .kernel = kernel});
        };
    }
    options.in_precision = [&arguments, &backends](VerifiedSide side, Precision precision) {
        return in_precision(arguments, side, precision, backends);
    };
    return options;
}

// What --total-time leaves undecided, whose lines so far were short.
void print_undecided(const std::vector<SceneVerdict>& verdicts, double seconds, bool verbose) {
    for (const SceneVerdict& verdict : verdicts)
        if (verdict.verdict == Verdict::undecided && verdict.failure.empty()) print_verdict(verdict, verbose);
    print_what_is_needed(verdicts, seconds);
}

ExitStatus verify(const VerifyArguments& given, const CommandContext& context) {
    NothingToKeep starting(context.interrupts);
    VerifyArguments arguments = completed(given);
    const std::vector<std::string> devices = devices_of(arguments, context);
    if (!devices.empty()) arguments.device = devices.front();  // for the layer, other kernels and traces
    std::optional<double> total_seconds;
    if (!arguments.total_time.empty()) total_seconds = duration_from(arguments.total_time, "--total-time");
    // Every scene is read before the first is rendered: bad input costs no time.
    std::vector<Scene> scenes;
    std::vector<std::string> names, inputs;
    for (const std::string& file : arguments.scenes) {
        scenes.push_back(scene_from(file, inputs));
        names.push_back(scenes.back().name);
    }
    const std::uint64_t limit = memory_limit(arguments.memory);
    std::vector<VerifiedFilm> films;
    for (const Scene& scene : scenes)
        films.push_back(
            film_within(limit, verification_settings_from(arguments.render, scene), arguments, !devices.empty()));
    static_cast<void>(criteria_from(arguments.criteria, {}));  // bad margins are told before a program starts
    check_outputs(arguments.criteria, context, names, inputs);
    const BackendList& backends = context.program.backends;
    std::vector<std::string> lost;  // devices of several that failed
    const auto [reference, candidate, programs, tested] = sides_of(arguments, devices, lost, context);
    const auto oracle =
        arguments.oracle == "none" ? nullptr : find_backend(backends, arguments.oracle).create(BackendOptions{});
    const auto other_precision = in_other_precision(arguments, backends);
    std::vector<const Renderer*> renderers{reference.get(), candidate.get()};
    if (other_precision) renderers.push_back(other_precision.get());
    for (std::size_t i = 0; i < scenes.size(); ++i)
        check_bins(films[i], scenes[i], arguments.scenes[i], renderers, limit, context.verbose);
    fmt::print("Reference: {}, {}\nCandidate: {}, {}\n", reference->info().backend, reference->info().device,
        candidate->info().backend, candidate->info().device);
    const std::vector<DeviceSelfTest> self_tests = self_tests_of(tested);
    std::fflush(stdout);
    starting.end();

    VerifyOptions options = options_from(arguments, *reference, *candidate, programs, backends);
    options.oracle = oracle.get();
    options.other_precision = other_precision.get();
    Work work{arguments, context, scenes, films, *reference, *candidate, programs, options, {}};
    work.layer.wanted = arguments.candidate == "vulkan" && !arguments.validation && !arguments.no_layer;
    const Stopwatch watch;
    Verified outcome = total_seconds ? verify_within(work, *total_seconds) : verify_each(work);
    if (total_seconds) print_undecided(outcome.verdicts, watch.seconds(), context.verbose);
    if (compare_misses(outcome.verdicts)) print_common_suspects(outcome.verdicts);
    work.layer.print();
    ExitStatus status = conclude(
        "verify", outcome.verdicts, arguments.criteria, context, outcome.not_run, self_tests, work.layer.messages);
    if (outcome.failure) std::rethrow_exception(outcome.failure);
    if (!lost.empty()) throw DeviceError(fmt::format("not verified to the end: {}", fmt::join(lost, "; ")));
    if (outcome.not_run.empty()) return status;
    fmt::print(stderr, "tandem: stopped; {} of {} scenes were not verified\n", outcome.not_run.size(), scenes.size());
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
    command
        .add_option("--among", arguments.among,
            "Scenes of the whole run, if tandem plan has split it. They share its false alarms")
        ->check(whole_between(1, 1'000'000))
        ->group(rare_options);
    command
        .add_flag("--follows-model", arguments.follows_model,
            "The programs of exec: draw the random numbers of MODEL.md section 3, so paired seeds are compared too")
        ->group(rare_options);
    command
        .add_flag("--negative-colours", arguments.negative_colours,
            "The programs of exec: render spectra, whose noise may make colours negative. Else these are a fault")
        ->group(rare_options);
    command.add_flag("--no-paired", arguments.no_paired, "Leave out the paired seeds. They find small faults sooner")
        ->group(rare_options);
    command
        .add_flag("--no-layer", arguments.no_layer,
            "Leave out the look at each scene under Vulkan's validation layer, where that is installed")
        ->group(rare_options);
    add_memory_option(command, arguments.memory,
        "Memory that the command may take, 2GiB for example (default: three quarters of what is free). Of a film "
        "beyond "
        "that, bins are judged, whose samples are of pixels chosen at random");
    command.add_flag("--validation", arguments.validation, "Use Vulkan's validation layers; any message is an error")
        ->group(rare_options);
}

}  // namespace

void add_verify_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("verify", "Decide whether two renderers agree on scenes");
    const auto arguments = std::make_shared<VerifyArguments>();
    arguments->render.seed = 1;
    command->add_option("scenes", arguments->scenes, "Scene files, or names of shipped scenes")
        ->transform(scene_name())
        ->type_name("SCENE");
    command
        ->add_option("--preset", arguments->preset,
            "smoke: six small scenes, 1 minute. driver: all of scenes/ at 64 pixels, 10 minutes. full: closed forms "
            "too, 2 hours")
        ->check(one_of({"smoke", "driver", "full"}));
    command
        ->add_option(
            "--total-time", arguments->total_time, "Time for all scenes together, as 90s, 10min or 2h, shared by need")
        ->type_name("TIME");
    command->add_option("--reference", arguments->reference, "Backend that is trusted: cpu, vulkan, oracle or first")
        ->capture_default_str();
    command->add_option("--candidate", arguments->candidate, "Backend that is judged, or 'exec:COMMAND'")
        ->capture_default_str();
    command->add_option("--device", arguments->device,
        "Vulkan device of the candidate: index, UUID, PCI address or name. Several between commas share the work");
    command->add_option(
        "--precision", arguments->precision, fmt::format("Precision of the candidate: {}", precision_help));
    command
        ->add_option("--time", arguments->seconds,
            fmt::format("Seconds of a scene, at most (default: {:.0f}, or what --total-time allows)", default_seconds))
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS");
    command
        ->add_option("--samples", arguments->samples,
            "Samples a pixel and side, at most (default: 1048576; more below 128x128 pixels)")
        ->check(whole_between(64, std::uint64_t{1} << 40))
        ->group(rare_options);
    command
        ->add_option("--oracle", arguments->oracle,
            "Reference oracle that says which side is wrong where they disagree: oracle or none")
        ->check(one_of({"oracle", "none"}))
        ->capture_default_str()
        ->group(rare_options);
    command
        ->add_flag("--convergence", arguments->convergence,
            "Also measure how the errors of both fall with samples. This takes as much --time again")
        ->group(rare_options);
    add_render_options(*command, arguments->render);
    command->get_option("--size")->description(
        "Image size in pixels, WxH or the longer side (default: the scene's, at most 128)");
    command->add_flag(
        "--strict", arguments->strict, "Disagree where the candidate's arithmetic is coarser than single precision");
    add_rare_options(*command, *arguments);
    add_criteria(*command, arguments->criteria, {});
    add_common_options(*command, context,
        "  tandem verify scenes/cornell-thesis.json\n"
        "  tandem verify scenes/furnace.json scenes/glass.json --json verdict.json --report report\n"
        "  tandem verify --preset driver --junit driver.xml\n"
        "  tandem verify scenes/furnace.json --reference oracle --candidate cpu --precision double\n"
        "  tandem verify scenes/furnace.json --candidate 'exec:./mine {scene} {samples} {seed} {out}'\n"
        "Exit status: 0 agree, 1 disagree or a message of the validation layer, 3 undecided within the time.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return verify(*arguments, context); }; });
}

}  // namespace tandem
