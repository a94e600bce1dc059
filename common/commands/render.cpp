// tandem render: one image by one backend.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/device_list.h"
#include "common/commands/memory.h"
#include "common/commands/render_arguments.h"
#include "common/commands/render_report.h"
#include "common/commands/render_tiles.h"
#include "common/commands/shipped_files.h"
#include "common/cost/choose_settings.h"
#include "common/deadline.h"
#include "common/distribution/part.h"
#include "common/distribution/range_render.h"
#include "common/distribution/ranks.h"
#include "common/error.h"
#include "common/image/feature_layers.h"
#include "common/image/image_io.h"
#include "common/render/sample_film.h"
#include "common/render/scrambled_film.h"
#include "common/render/stopping.h"
#include "common/scene/loader/scene_loader.h"
#include "common/stopwatch.h"
#include "common/text.h"

namespace tandem {

namespace {

std::string progress_text(const RenderProgress& progress) {
    std::string text = fmt::format("{:.0f} samples a pixel", progress.samples);
    if (progress.relative_error) text += fmt::format(", error {:.2g} %", 100.0 * *progress.relative_error);
    return text;
}

void write_output(const std::string& file, const RenderArguments& arguments, const nlohmann::json& report,
    const FilmMoments& film, bool independent, const FilesRead& read, const FeatureImages& features = {}) {
    Image image = image_of(film, metadata_of(report), independent);
    if (!is_png(file)) {
        add_layers(image, features);
        write_image(file, image, read);
        return;
    }
    write_png(file, image, arguments.exposure, read);
    for (const Feature feature : features.chosen)
        write_png(name_beside(file, feature_names.at(static_cast<std::size_t>(feature))),
            feature_picture(features, feature, film.width, film.height), 1.0, read);
}

// What was tried for a target error: no settings where none was open.
struct Tried {
    std::vector<SettingsTrial> trials;
    std::size_t chosen = 0;
    double seconds = 0.0;
};

// For a target error also chooses what the user has left open of `settings`.
std::unique_ptr<RenderJob> prepare(const RenderArguments& arguments, const Scene& scene, Renderer& renderer,
    StoppingRule& rule, RenderSettings& settings, Tried& tried, const CommandContext& context) {
    // --mis off and --light-sampling are of next events, so they choose the integrator.
    const bool of_next_events = !settings.mis || settings.light_sampling != LightSampling::power;
    // --clamp cuts whole samples, so with another integrator or roulette it makes another image (MODEL.md
    // section 11.1).
    const bool clamps = std::isfinite(settings.clamp);
    const OpenSettings open{.integrator = arguments.options.integrator.empty() && !of_next_events && !clamps,
        .roulette = !arguments.options.roulette.has_value() && !clamps,
        .sampling = arguments.options.sampling.empty(),
        .generator = !arguments.has_generator};
    if (!rule.relative_error) return renderer.prepare(scene, settings);
    ChoiceGoal goal{.relative_error = *rule.relative_error, .most_samples = rule.samples};
    constexpr double share = 0.1;  // of the time
    if (rule.seconds) goal.stop_seconds = goal.most_seconds = std::min(goal.most_seconds, share * *rule.seconds);
    SettingsChoice choice = choose_settings(scene, settings, open, renderer, goal, context.stop);
    settings = choice.settings;
    rule.expected_samples = choice.expected_samples;
    rule.whole_blocks = settings.accumulation == Accumulation::plain;
    tried.seconds = choice.seconds;
    if (!open.integrator && !open.roulette && !open.sampling && !open.generator) return std::move(choice.job);
    if (context.verbose)
        for (const SettingsTrial& trial : choice.trials)
            fmt::print(stderr, "tried {}: {}{}\n", trial.options.empty() ? "the scene's own settings" : trial.options,
                trial.seconds_to_error > 0.0 ? fmt::format("forecast {:.3g} s", trial.seconds_to_error) : "no noise",
                &trial == &choice.trials[choice.chosen] ? ", chosen" : "");
    const std::string& options = choice.options;
    if (!options.empty())
        fmt::print(
            "settings chosen for the target error: {} (--integrator, --roulette, --generator and --sampling fix "
            "them)\n",
            options);
    if (!options.empty() && !arguments.has_generator && !independent(settings) && is_exr(arguments.output))
        fmt::print("{}: will hold no variances, which Sobol points do not tell; --generator philox keeps them\n",
            escaped(arguments.output));
    tried = {std::move(choice.trials), choice.chosen, choice.seconds};
    return std::move(choice.job);
}

void tell(const Tried& tried, nlohmann::json& report) {
    if (tried.seconds > 0.0) report["trial_seconds"] = tried.seconds;
    if (tried.trials.empty()) return;
    report["trials"] = nlohmann::json::array();
    for (const SettingsTrial& trial : tried.trials)
        report["trials"].push_back({{"options", trial.options}, {"forecast_seconds", trial.seconds_to_error},
            {"chosen", &trial == &tried.trials[tried.chosen]}});
}

std::string samples_text(const FilmMoments& film) {
    const auto [least, most] = std::ranges::minmax(film.counts);
    if (least == most) return fmt::format("{}", least);
    return fmt::format("{:.0f} ({} to {})", film.count(), least, most);
}

// What is left of the time after the start: loading, trees and kernels count.
void take_start_off(StoppingRule& rule, double seconds) {
    if (!rule.seconds) return;
    constexpr double least = 1e-3;
    rule.first_sample_seconds = std::max(least, with_overrun(*rule.seconds) - seconds);
    rule.seconds = std::max(least, *rule.seconds - seconds);
}

// Why there is no image.
StoppedError without_sample(
    const StoppedRender& result, const RenderArguments& arguments, const CommandContext& context) {
    if (context.stop.stop_requested() || !arguments.seconds)
        return StoppedError("stopped before every pixel had a sample; nothing is written");
    const std::string done =
        result.begun > 0.0 ? fmt::format(": {:.2g} % of the first was done", 100.0 * result.begun) : std::string();
    return StoppedError(fmt::format(
        "--time: {:g} s do not suffice for a sample of every pixel{}; nothing is written; give more --time, a smaller "
        "--size or fewer --bounces",
        *arguments.seconds, done));
}

// The image as a part, with what is there of it; nothing of a render that keeps no sums.
std::optional<Part> begun_part(
    const RenderArguments& arguments, const RenderSettings& settings, const std::vector<std::string>& inputs) {
    if (arguments.range.empty() && arguments.resume.empty()) return std::nullopt;
    const char* option = arguments.range.empty() ? "--resume" : "--range";
    if (arguments.seconds || !arguments.target_error.empty())
        throw InputError(fmt::format("{}: takes so many samples, not so much {}; leave that out", option,
            arguments.seconds ? "--time" : "error (--target-error)"));
    check_splittable(settings);
    Part part;
    part.of = provenance_of(inputs, settings, arguments.precision, git_version());
    part.whole = arguments.samples.value_or(0);
    if (arguments.resume.empty() || !std::filesystem::exists(arguments.resume)) return part;
    Part earlier = read_part(arguments.resume);
    earlier.whole = part.whole;  // more samples may be asked for now
    part.estimate = Estimate(earlier.estimate.width(), earlier.estimate.height());
    take_in(part, std::move(earlier), arguments.resume);
    return part;
}

// Renders what the part lacks of the range, and keeps it in --resume's file.
StoppedRender render_part(RenderJob& job, Part& part, SampleRange range, const RenderArguments& arguments,
    const RendererInfo& info, const Stopwatch& since_start, const CommandContext& context) {
    RangeWork work;
    work.ranges = missing(part.estimate, range, arguments.resume);
    work.stop = context.stop;
    work.keep_seconds = arguments.keep_seconds;
    const double before = static_cast<double>(part.estimate.count());
    double all = before;
    for (const SampleRange& one : work.ranges) all += static_cast<double>(one.count());
    if (!work.ranges.empty()) part.devices.insert(fmt::format("{}: {}", info.backend, info.device));
    if (!arguments.resume.empty() && !work.ranges.empty())
        work.keep = [&](double seconds) {
            part.seconds += seconds;
            if (part.estimate.count() > 0) write_part(arguments.resume, part, context.read);
        };
    if (context.verbose)  // so that what a kill loses can be counted
        work.begun = [&](SampleRange step) {
            fmt::print(stderr, "samples {} begun, {:.3f} s after the start\n", to_string(step), since_start.seconds());
        };
    ProgressLine line;
    work.progress = [&](double samples) {
        line.update((before + samples) / all, fmt::format("{:.0f} samples a pixel", before + samples));
    };
    const RangeResult rendered = render_ranges(job, part.estimate, work);
    if (!work.keep) part.seconds += rendered.seconds;
    StoppedRender result;
    result.seconds = rendered.seconds;
    result.device_seconds = rendered.device_seconds;
    result.complete = rendered.complete;
    result.film = film_of(part.estimate);
    if (part.independent()) result.relative_error = relative_error_of(result.film);
    return result;
}

// One scrambling has so many Sobol points as --samples says, and its ranges can be merged. So it is with --every, whose
// points go on from image to image. Else several tell the error (MODEL.md section 11.4).
unsigned scramblings_of(const RenderSettings& settings, const StoppingRule& rule, const RenderArguments& arguments) {
    if (independent(settings) || (rule.samples && !rule.relative_error) || !arguments.every.empty()) return 1;
    const unsigned scramblings = scramblings_for(std::uint64_t{settings.width} * settings.height);
    return rule.samples && *rule.samples < scramblings ? 1 : scramblings;
}

StoppedRender render_whole(RenderJob& job, const StoppingRule& rule, const RenderSettings& settings,
    const RenderArguments& arguments, const std::function<void(std::uint64_t, const FilmMoments&)>& keep,
    const CommandContext& context) {
    ProgressLine line;
    const unsigned scramblings = scramblings_of(settings, rule, arguments);
    const bool tells = independent(settings) || scramblings > 1;
    const auto tell = [&](RenderProgress progress) {
        if (!tells) progress.relative_error.reset();
        line.update(progress.fraction, progress_text(progress));
    };
    StoppedRender result = arguments.every.empty()
                               ? render_until(job, rule, context.stop, tell, settings.sampling, scramblings)
                               : render_film(job, rule, factor_from(arguments.every), context.stop, tell, keep);
    if (!tells) {
        result.relative_error.reset();
        result.relative_error_interval.reset();
    }
    return result;
}

std::unique_ptr<Renderer> renderer_from(const RenderArguments& arguments, const CommandContext& context) {
    std::vector<std::string> words;
    for (const auto& [option, value] : given_options(arguments.options))
        if (option != "--sampling") words.insert(words.end(), {option, value});
    return renderer_on(arguments.backend,
        {.device = arguments.device,
            .precision = precision_from(arguments.precision),
            .kernel = arguments.kernel,
            .threads = arguments.threads,
            .validation = arguments.validation},
        arguments.scene, words, context);
}

// Before the image, whose time it counts to. Throws StoppedError where that does not suffice.
FeatureImages features_for(const RenderArguments& arguments, const Scene& scene, Renderer& renderer,
    const RenderSettings& settings, const StoppingRule& rule, const Stopwatch& watch) {
    FeatureImages features;
    if (arguments.aov.empty()) return features;
    features.chosen = features_from(arguments.aov);
    features.samples = std::min(most_feature_samples, rule.samples.value_or(most_feature_samples));
    const std::unique_ptr<RenderJob> job = renderer.prepare(scene, feature_settings(settings, scene));
    const Deadline limit(
        {}, rule.seconds ? std::optional(std::max(1e-3, *rule.seconds - watch.seconds())) : std::nullopt);
    ProgressLine line;
    auto pixels = render_features(*job, scene, settings, {0, features.samples}, limit.token(),
        [&](double share) { line.update(share, "features"); });
    if (!pixels)
        throw StoppedError(fmt::format(
            "--time: {:g} s do not suffice for --aov; nothing is written; give more --time or a smaller --size",
            *rule.seconds));
    features.pixels = std::move(*pixels);
    return features;
}

// What all ranks of mpirun are to have alike.
std::string task_of(
    const std::vector<std::string>& inputs, const RenderSettings& settings, const RenderArguments& arguments) {
    const Provenance of = provenance_of(inputs, settings, arguments.precision, git_version());
    return of.scene + of.settings + of.version;
}

// What a rank of mpirun does that is not the first: it renders what that asks for, and writes nothing.
ExitStatus serve(const RenderArguments& arguments, const CommandContext& context, Ranks& ranks) {
    try {
        NothingToKeep starting(context.interrupts);
        std::vector<std::string> inputs;
        const Scene scene = load_scene(arguments.scene, &inputs);
        const RenderSettings settings = settings_from(arguments.options, scene);
        check_memory(settings);
        const std::unique_ptr<Renderer> renderer = renderer_from(arguments, context);
        const std::unique_ptr<RenderJob> job = renderer->prepare(scene, settings);
        starting.end();
        ranks.serve(*job, renderer->info(), task_of(inputs, settings, arguments), context.stop);
    } catch (const std::exception& error) {
        ranks.fail(error.what());
    }
    return ExitStatus::fine;
}

// Whether the target error is met, where it is not, or is not known to be.
std::string text_on_target(const StoppedRender& result, const RenderArguments& arguments, bool stopped) {
    const bool by_both = arguments.samples && arguments.seconds;
    const std::string more = stopped             ? ""
                             : by_both           ? "; give more --samples or --time"
                             : arguments.samples ? "; give more --samples"
                                                 : "; give more --time";
    const std::string target = escaped(arguments.target_error);
    if (result.relative_error)
        return *result.relative_error <= fraction_from(arguments.target_error, "--target-error")
                   ? ""
                   : fmt::format("The target error of {} is not met{}\n", target, more);
    if (std::ranges::all_of(result.film.moments, [](const Moments& moments) { return moments.sum == 0.0; }))
        return result.complete || stopped ? "The image is black so far, so it has no relative error\n" : "";
    return fmt::format("Whether the target error of {} is met is not known: the samples are too few{}\n", target, more);
}

// Prints the result, and says how the command ends.
ExitStatus conclude(const StoppedRender& result, const nlohmann::json& report, const RenderArguments& arguments,
    bool is_part, const CommandContext& context) {
    fmt::print("{}: {} samples a pixel in {:.2f} s, {:.3g} Mpaths/s{}{}\n", escaped(arguments.output),
        samples_text(result.film), result.seconds, report.at("paths_per_second").get<double>() / 1e6,
        error_text(result), result.complete ? "" : " (stopped early)");
    if (!arguments.target_error.empty())
        fmt::print("{}", text_on_target(result, arguments, context.stop.stop_requested()));
    if (result.film.invalid > 0) {
        fmt::print(
            stderr, "tandem: {} samples were negative or not finite (MODEL.md section 12)\n", result.film.invalid);
        return ExitStatus::disagree;
    }
    if (!result.complete && is_part) return ExitStatus::undecided;  // for whoever waits for all of it
    if (!result.complete && !context.stop.stop_requested()) {
        fmt::print(stderr, "tandem: the image is black, so it has no relative error; --target-error cannot be met\n");
        return ExitStatus::undecided;
    }
    return ExitStatus::fine;
}

// Refuses images and files that the command cannot write, before any work.
void check_files(const RenderArguments& arguments, const StoppingRule& rule, const std::vector<std::string>& inputs,
    const CommandContext& context) {
    check_extra_images(arguments);
    std::vector<Output> outputs = extra_outputs(arguments, rule);
    outputs.insert(outputs.begin(),
        {{"-o", arguments.output, OutputKind::image}, {"--resume", arguments.resume, OutputKind::image}});
    check_outputs(context, outputs, inputs);
    if (!arguments.resume.empty()) check_part_ending("--resume", arguments.resume);
}

void check_for_ranks(const RenderSettings& settings, const StoppingRule& rule) {
    check_splittable(settings);
    if (rule.relative_error)
        throw UnsupportedError("--target-error: tries settings, which ranks cannot; give --samples");
}

ExitStatus render(const RenderArguments& arguments, const CommandContext& context) {
    const Stopwatch watch;
    const std::unique_ptr<Ranks> ranks = has_ranks() ? std::make_unique<Ranks>() : nullptr;
    if (ranks && ranks->rank() > 0) return serve(arguments, context, *ranks);
    NothingToKeep starting(context.interrupts);
    check_image_ending(arguments.output);
    if (!arguments.range.empty()) check_part_ending("-o", arguments.output);
    std::vector<std::string> inputs;
    const Scene scene = scene_from(arguments.scene, inputs);
    RenderSettings settings = settings_from(arguments.options, scene);
    StoppingRule rule = stopping_rule(arguments);
    check_files(arguments, rule, inputs, context);
    if (ranks) check_for_ranks(settings, rule);
    std::optional<Part> part = begun_part(arguments, settings, inputs);
    const SampleRange range = range_of(arguments);

    std::unique_ptr<Renderer> renderer = renderer_from(arguments, context);
    const MemoryPlan memory = plan_memory(arguments, settings, rule, scene, *renderer);
    if (context.verbose) fmt::print(stderr, "{}\n", memory.text());
    if (!memory.regions.empty())
        return render_tiles(arguments, settings, rule, scene, *renderer, memory, watch, starting, context);
    if (ranks)
        renderer = ranks->all(std::move(renderer), task_of(inputs, settings, arguments),
            [](const std::string& told) { fmt::print(stderr, "tandem: {}; others do its blocks\n", escaped(told)); });
    Tried tried;
    const std::unique_ptr<RenderJob> job = prepare(arguments, scene, *renderer, rule, settings, tried, context);
    if (context.verbose)
        fmt::print(stderr, "{} on {} ({}), {}x{}\n", escaped(scene.name), renderer->info().device,
            renderer->info().driver, settings.width, settings.height);

    if (part) part->metadata = metadata_of(describe(arguments, settings, renderer->info(), scene, {}));
    const FeatureImages features = features_for(arguments, scene, *renderer, settings, rule, watch);
    starting.end();
    take_start_off(rule, watch.seconds());
    const auto keep = [&](std::uint64_t samples, const FilmMoments& film) {
        StoppedRender state;
        state.film = film;
        write_output(name_in_film(arguments.output, samples), arguments,
            describe(arguments, settings, renderer->info(), scene, state), film, independent(settings), context.read);
    };
    StoppedRender result = part ? render_part(*job, *part, range, arguments, renderer->info(), watch, context)
                                : render_whole(*job, rule, settings, arguments, keep, context);
    if (result.film.count() == 0.0) throw without_sample(result, arguments, context);

    nlohmann::json report = describe(arguments, settings, renderer->info(), scene, result);
    if (arguments.range.empty()) {
        write_output(arguments.output, arguments, report, result.film, independent(settings), context.read, features);
    } else {
        part->metadata = metadata_of(report);
        write_part(arguments.output, *part, context.read);
    }
    if (const unsigned scramblings = scramblings_of(settings, rule, arguments); scramblings > 1 && !part)
        report["scramblings"] = scramblings;
    tell(tried, report);
    report["memory"] = memory.json();
    write_json(context, report);
    return conclude(result, report, arguments, part.has_value(), context);
}

}  // namespace

void add_render_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("render", "Render one image by one backend");
    const auto arguments = std::make_shared<RenderArguments>();
    add_render_arguments(*command, *arguments);
    add_common_options(*command, context,
        "  tandem render scenes/cornell-classic.json -o box.png --samples 256\n"
        "  tandem render scenes/one-weekend.json -o out.exr --backend vulkan --size 600 --time 30\n"
        "  tandem render scenes/cornell-thesis.json -o out.exr --size 256 --target-error 5%\n"
        "  tandem render scenes/glass.json -o glass.exr --aov albedo,normal,depth\n"
        "Ctrl-C stops the render and writes what is done.");
    command->callback([&context, arguments, command] {
        arguments->has_generator = command->count("--generator") > 0;
        context.action = [&context, arguments] { return render(*arguments, context); };
    });
}

}  // namespace tandem
