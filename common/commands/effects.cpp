// tandem effects: what a scene calls for, what was left out, and what that saved.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "common/commands/arguments.h"
#include "common/commands/command.h"
#include "common/commands/command_time.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/shipped_files.h"
#include "common/error.h"
#include "common/text.h"
#include "common/validation/verify/specialisation.h"

namespace tandem {

namespace {

struct EffectsArguments {
    std::string scene, backend = "vulkan", device, kernel, precision;
    RenderOptions options;
    double seconds = 40.0;
};

// What a side has no code for, no memory for, and does not do, for one sentence a part.
struct LeftOut {
    std::vector<std::string> compiled, allocated, dispatched;
};

// The parts of `general` that `specialised` has not, or has less of.
void add_left_out(std::vector<std::string>& lines, const std::vector<JobFacts::Part>& general,
    const std::vector<JobFacts::Part>& specialised, const char* unit) {
    for (const JobFacts::Part& part : general) {
        const auto same = [&](const JobFacts::Part& other) { return other.name == part.name; };
        const auto kept = std::ranges::find_if(specialised, same);
        if (kept == specialised.end() || (kept->amount == 0 && part.amount > 0))
            lines.push_back(fmt::format("{}: none of {} {}", part.name, part.amount, unit));
        else if (kept->amount < part.amount)
            lines.push_back(fmt::format("{}: {} of {} {}", part.name, kept->amount, part.amount, unit));
    }
}

LeftOut left_out(const JobFacts& general, const JobFacts& specialised) {
    LeftOut out;
    add_left_out(out.compiled, general.kernels, specialised.kernels, "instructions");
    add_left_out(out.allocated, general.buffers, specialised.buffers, "bytes");
    add_left_out(out.dispatched, general.dispatches, specialised.dispatches, "dispatches for a sample of every pixel");
    add_left_out(out.dispatched, general.bindings, specialised.bindings, "bindings to buffers");
    return out;
}

nlohmann::json parts_json(const std::vector<JobFacts::Part>& parts, const char* amount) {
    nlohmann::json list = nlohmann::json::array();
    for (const JobFacts::Part& part : parts) list.push_back({{"name", part.name}, {amount, part.amount}});
    return list;
}

nlohmann::json names_json(EffectSet effects) {
    nlohmann::json list = nlohmann::json::array();
    for (std::uint32_t i = 0; i < effect_count; ++i)
        if (const auto effect = static_cast<Effect>(i); effects.has(effect)) list.push_back(effect_name(effect));
    return list;
}

nlohmann::json side_json(const SpecialisationSide& side) {
    return {{"make_seconds", side.make_seconds}, {"kernel_seconds", side.kernel_seconds},
        {"kernel_seconds_each", side.kernel_replicates}, {"compiled_ahead", !side.facts.variant.empty()},
        {"variant", side.facts.variant.empty() ? nlohmann::json() : nlohmann::json(side.facts.variant)},
        {"effects_without_code", names_json(EffectSet::all().without(side.facts.compiled))},
        {"kernels", parts_json(side.facts.kernels, "instructions")},
        {"buffers", parts_json(side.facts.buffers, "bytes")}, {"bindings", parts_json(side.facts.bindings, "bindings")},
        {"dispatches", parts_json(side.facts.dispatches, "dispatches")}};
}

nlohmann::json to_json(const std::string& scene, const RendererInfo& info, const SpecialisationReport& report) {
    nlohmann::json needed = nlohmann::json::array(), absent = nlohmann::json::array();
    for (const EffectFinding& finding : report.findings)
        (finding.needed ? needed : absent)
            .push_back({{"effect", effect_name(finding.effect)}, {"reason", finding.reason}});
    nlohmann::json json{{"scene", scene}, {"backend", info.backend}, {"device", info.device}, {"driver", info.driver},
        {"needed", needed}, {"absent", absent}, {"rounds", report.rounds}};
    if (!report.made) return json;
    const LeftOut out = left_out(report.general.facts, report.specialised.facts);
    json.update(
        {{"identical", report.identical}, {"bytes_per_path_specialised", report.specialised.facts.bytes_per_path},
            {"bytes_per_path_general", report.general.facts.bytes_per_path}, {"not_compiled", out.compiled},
            {"not_allocated", out.allocated}, {"not_dispatched", out.dispatched},
            {"specialised", side_json(report.specialised)}, {"general", side_json(report.general)}});
    if (report.rounds < fewest_timed_rounds) return json;
    json.update({{"clock", report.device_clock ? "device" : "wall"},
        {"milliseconds_specialised", report.specialised.milliseconds},
        {"milliseconds_general", report.general.milliseconds}, {"speedup", report.speedup},
        {"speedup_low", report.interval.low}, {"speedup_high", report.interval.high},
        {"samples_to_pay", report.samples_to_pay ? nlohmann::json(*report.samples_to_pay) : nlohmann::json()}});
    return json;
}

void print_lines(const char* title, const std::vector<std::string>& lines) {
    if (!lines.empty()) fmt::print("{}\n", title);
    for (const std::string& line : lines) fmt::print("  {}\n", line);
}

void print_left_out(const JobFacts& specialised, const JobFacts& general) {
    const EffectSet no_code = EffectSet::all().without(specialised.compiled);
    if (!specialised.variant.empty())
        fmt::print("Code: the variant \"{}\", compiled with the program, in place of \"{}\"\n  no code for: {}\n",
            specialised.variant, general.variant,
            no_code.size() > 0 ? effect_names(no_code) : "none; what is absent is skipped at run time");
    const LeftOut out = left_out(general, specialised);
    print_lines("Not compiled, therefore:", out.compiled);
    print_lines("Not allocated:", out.allocated);
    print_lines("Not dispatched or bound:", out.dispatched);
    fmt::print("State a path: {} bytes specialised, {} general\n", specialised.bytes_per_path, general.bytes_per_path);
}

void print_kernel_seconds(const SpecialisationReport& report) {
    const bool ahead = !report.specialised.facts.variant.empty();
    if (ahead)
        fmt::print("Kernels made in 0 s: all variants were compiled with the program; ");
    else
        fmt::print("Kernels made in {:.2f} s specialised, {:.2f} s general (the longer of {} replicates); ",
            report.specialised.kernel_seconds, report.general.kernel_seconds,
            report.specialised.kernel_replicates.size());
    if (!report.samples_to_pay)
        fmt::print("no saving was seen that could pay for it\n");
    else if (ahead)
        fmt::print("specialising pays from the first sample\n");
    else
        fmt::print(
            "specialising pays for itself after {:.0f} samples of every pixel\n", std::ceil(*report.samples_to_pay));
    if (!ahead) fmt::print("  This is a lower bound where the driver keeps kernels from an earlier run\n");
}

void print_report(const std::string& scene, const RendererInfo& info, const SpecialisationReport& report) {
    fmt::print("{} on {} ({})\nNeeded:\n", scene, info.backend, info.device);
    for (const bool needed : {true, false}) {
        if (!needed) fmt::print("Absent:\n");
        for (const EffectFinding& finding : report.findings)
            if (finding.needed == needed)
                fmt::print("  {:22} {}\n", effect_name(finding.effect), escaped(finding.reason));
    }
    if (!report.made) return;
    print_left_out(report.specialised.facts, report.general.facts);
    fmt::print("Images: {}\n", report.identical ? "identical, bit for bit" : "NOT identical");
    if (report.rounds < fewest_timed_rounds) return;
    fmt::print(
        "A sample of every pixel: {:.4g} ms specialised, {:.4g} ms general, {:.3f} times as fast "
        "(95 %: {:.3f} to {:.3f}; {} rounds, {} clock)\n",
        report.specialised.milliseconds, report.general.milliseconds, report.speedup, report.interval.low,
        report.interval.high, report.rounds, report.device_clock ? "device" : "wall");
    print_kernel_seconds(report);
}

ExitStatus conclude(const std::string& scene, const RendererInfo& info, const SpecialisationReport& report,
    const CommandContext& context, const CommandTime& time) {
    print_report(escaped(scene), info, report);
    write_json(context, to_json(scene, info, report));
    ExitStatus status = ExitStatus::fine;
    if (report.rounds < fewest_timed_rounds)
        status = time.too_short(report.made ? "nothing was timed; a smaller --size has shorter rounds"
                                            : "the kernels were not made; nothing was timed");
    return report.made && !report.identical ? ExitStatus::disagree : status;
}

ExitStatus effects(const EffectsArguments& arguments, const CommandContext& context, const CommandTime& time) {
    if (arguments.options.effects != "needed")
        throw InputError("--effects: this command compares the needed effects with all of them; leave the option out");
    refuse_adaptive_sampling(arguments.options);
    NothingToKeep until_first_round(context.interrupts);
    std::vector<std::string> inputs;
    const Scene scene = scene_from(arguments.scene, inputs);
    const RenderSettings settings = settings_from(arguments.options, scene);
    check_memory(settings);
    check_outputs(context, {}, inputs);
    const auto make_renderer = [&] {
        return find_backend(context.program.backends, arguments.backend)
            .create({.device = arguments.device,
                .precision = precision_from(arguments.precision),
                .kernel = arguments.kernel});
    };
    const RendererInfo info = make_renderer()->info();
    SpecialisationOptions options;
    options.seconds = time.left();
    options.stop = time.token();
    SpecialisationReport report;
    report.findings = find_effects(scene, settings);
    std::mutex mutex;
    SpecialisationReport so_far = report;
    options.keep = [&](const SpecialisationReport& known) {
        const std::lock_guard lock(mutex);
        so_far = known;
    };
    const auto last_resort = time.at_any_rate([&] {
        const std::lock_guard lock(mutex);
        return conclude(scene.name, info, so_far, context, time);
    });
    {
        ProgressLine line;
        options.progress = [&](double fraction) {
            until_first_round.end();
            line.update(fraction, "timing");
        };
        report = measure_specialisation(scene, settings, make_renderer, options);
    }
    last_resort->done();
    return conclude(scene.name, info, report, context, time);
}

}  // namespace

void add_effects_command(CLI::App& app, CommandContext& context) {
    CLI::App* command =
        app.add_subcommand("effects", "Tell which effects a scene calls for, and what leaving out the others saves");
    const auto arguments = std::make_shared<EffectsArguments>();
    command->add_option("scene", arguments->scene, scene_help)->required()->transform(scene_name())->type_name("SCENE");
    command->add_option("--backend", arguments->backend, "cpu or vulkan")
        ->check(one_of({"cpu", "vulkan"}))
        ->capture_default_str();
    command->add_option("--device", arguments->device, device_help);
    command->add_option("--kernel", arguments->kernel, kernel_help)->group(rare_options);
    command->add_option("--precision", arguments->precision, precision_help);
    command
        ->add_option(
            "--time", arguments->seconds, "Seconds for everything, making kernels included; timing gets a quarter")
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS")
        ->capture_default_str();
    add_render_options(*command, arguments->options);
    add_common_options(*command, context,
        "  tandem effects scenes/cornell-thesis.json\n"
        "  tandem effects scenes/glass.json --backend cpu --size 256 --json effects.json\n"
        "  __GL_SHADER_DISK_CACHE=0 MESA_SHADER_CACHE_DISABLE=true tandem effects scenes/glass.json\n"
        "The last example compiles the kernels anew; drivers keep them from one run to the next. "
        "Ctrl-C concludes from the rounds that are done.\n"
        "Exit status: 0; 1 where the two images differ in any bit; 3 where the time was too short for two rounds.");
    command->callback([&context, arguments] {
        context.action = [&context, arguments] {
            const CommandTime time(context, arguments->seconds);
            return time.work([&] { return effects(*arguments, context, time); });
        };
    });
}

}  // namespace tandem
