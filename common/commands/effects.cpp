// tandem effects: what a scene calls for, what was left out, and what that saved.
#include <fmt/format.h>

#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/error.h"
#include "common/scene_loader.h"
#include "common/validation/specialisation.h"

namespace tandem {

namespace {

struct EffectsArguments {
    std::string scene, backend = "vulkan", device, kernel, precision;
    RenderOptions options;
    double seconds = 10.0;
};

// The parts of `general` that `specialised` has not, or has less of.
std::vector<std::string> left_out(
    const std::vector<JobFacts::Part>& general, const std::vector<JobFacts::Part>& specialised, const char* unit) {
    std::vector<std::string> lines;
    for (const JobFacts::Part& part : general) {
        const auto same = [&](const JobFacts::Part& other) { return other.name == part.name; };
        const auto kept = std::ranges::find_if(specialised, same);
        if (kept == specialised.end())
            lines.push_back(fmt::format("{}: none of {} {}", part.name, part.amount, unit));
        else if (kept->amount < part.amount)
            lines.push_back(fmt::format("{}: {} of {} {}", part.name, kept->amount, part.amount, unit));
    }
    return lines;
}

nlohmann::json parts_json(const std::vector<JobFacts::Part>& parts, const char* amount) {
    nlohmann::json list = nlohmann::json::array();
    for (const JobFacts::Part& part : parts) list.push_back({{"name", part.name}, {amount, part.amount}});
    return list;
}

nlohmann::json to_json(const std::string& scene, const RendererInfo& info, const SpecialisationReport& report) {
    nlohmann::json needed = nlohmann::json::array(), absent = nlohmann::json::array();
    for (const EffectFinding& finding : report.findings)
        (finding.needed ? needed : absent)
            .push_back({{"effect", effect_name(finding.effect)}, {"reason", finding.reason}});
    const auto side = [](const SpecialisationSide& s) {
        return nlohmann::json{{"make_seconds", s.make_seconds}, {"kernel_seconds", s.facts.kernel_seconds},
            {"kernels", parts_json(s.facts.kernels, "instructions")},
            {"buffers", parts_json(s.facts.buffers, "bytes")}};
    };
    nlohmann::json json{{"scene", scene}, {"backend", info.backend}, {"device", info.device}, {"driver", info.driver},
        {"needed", needed}, {"absent", absent}, {"identical", report.identical}, {"rounds", report.rounds},
        {"clock", report.device_clock ? "device" : "wall"},
        {"milliseconds_specialised", report.specialised.milliseconds},
        {"milliseconds_general", report.general.milliseconds}, {"speedup", report.speedup},
        {"speedup_low", report.interval.low}, {"speedup_high", report.interval.high},
        {"bytes_per_path_specialised", report.specialised.facts.bytes_per_path},
        {"bytes_per_path_general", report.general.facts.bytes_per_path}, {"specialised", side(report.specialised)},
        {"general", side(report.general)}};
    json["samples_to_pay"] = report.samples_to_pay ? nlohmann::json(*report.samples_to_pay) : nlohmann::json();
    return json;
}

void print_report(const std::string& scene, const RendererInfo& info, const SpecialisationReport& report) {
    fmt::print("{} on {} ({})\nNeeded:\n", scene, info.backend, info.device);
    for (const bool needed : {true, false}) {
        if (!needed) fmt::print("Absent:\n");
        for (const EffectFinding& finding : report.findings)
            if (finding.needed == needed) fmt::print("  {:22} {}\n", effect_name(finding.effect), finding.reason);
    }
    const JobFacts &specialised = report.specialised.facts, &general = report.general.facts;
    std::vector<std::string> lines = left_out(general.kernels, specialised.kernels, "instructions");
    for (const std::string& line : left_out(general.buffers, specialised.buffers, "bytes")) lines.push_back(line);
    if (!lines.empty()) fmt::print("Left out, therefore:\n");
    for (const std::string& line : lines) fmt::print("  {}\n", line);
    fmt::print("State a path: {} bytes specialised, {} general\n", specialised.bytes_per_path, general.bytes_per_path);
    fmt::print(
        "A sample of every pixel: {:.4g} ms specialised, {:.4g} ms general, {:.3f} times as fast "
        "(95 %: {:.3f} to {:.3f}; {} rounds, {} clock)\n",
        report.specialised.milliseconds, report.general.milliseconds, report.speedup, report.interval.low,
        report.interval.high, report.rounds, report.device_clock ? "device" : "wall");
    fmt::print("Made in {:.2f} s specialised, {:.2f} s general; ", report.specialised.make_seconds,
        report.general.make_seconds);
    if (report.samples_to_pay)
        fmt::print("specialising pays for itself after {:.0f} samples of every pixel\n", *report.samples_to_pay);
    else
        fmt::print("no saving that could pay for it was seen\n");
    fmt::print("Images: {}\n", report.identical ? "identical, bit for bit" : "NOT identical");
}

ExitStatus effects(const EffectsArguments& arguments, const CommandContext& context) {
    if (arguments.options.effects != "needed")
        throw InputError("--effects: this command holds the needed effects against all; leave the option out");
    const Scene scene = load_scene(arguments.scene);
    const RenderSettings settings = settings_from(arguments.options, scene);
    check_memory(settings);
    check_outputs({context.json_file}, {arguments.scene});
    const std::unique_ptr<Renderer> renderer = find_backend(context.program.backends, arguments.backend)
                                                   .create({.device = arguments.device,
                                                       .precision = precision_from(arguments.precision),
                                                       .kernel = arguments.kernel});
    SpecialisationOptions options;
    options.seconds = arguments.seconds;
    options.stop = context.stop;
    SpecialisationReport report;
    {
        ProgressLine line;
        options.progress = [&](double fraction) { line.update(fraction, "timing"); };
        report = measure_specialisation(scene, settings, *renderer, options);
    }
    write_json(context, to_json(scene.name, renderer->info(), report));
    print_report(scene.name, renderer->info(), report);
    return report.identical ? ExitStatus::fine : ExitStatus::disagree;
}

}  // namespace

void add_effects_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("effects",
        "Say which effects a scene calls for and what leaving out the "
        "others saves");
    const auto arguments = std::make_shared<EffectsArguments>();
    command->add_option("scene", arguments->scene, "Scene file")->required()->type_name("SCENE");
    command->add_option("--backend", arguments->backend, "cpu or vulkan")
        ->check(CLI::IsMember({"cpu", "vulkan"}))
        ->capture_default_str();
    command->add_option("--device", arguments->device, "Vulkan device: index or part of its name (see tandem devices)");
    command->add_option("--kernel", arguments->kernel, kernel_help);
    command->add_option(
        "--precision", arguments->precision, "single, double, contracted or mixed (default: the backend's)");
    command->add_option("--time", arguments->seconds, "Seconds of timing")
        ->check(above_zero(most_seconds))
        ->capture_default_str();
    add_render_options(*command, arguments->options);
    add_common_options(*command, context,
        "  tandem effects scenes/cornell-thesis.json\n"
        "  tandem effects scenes/glass.json --backend cpu --size 256 --json effects.json\n"
        "Exit status: 0, or 1 where the specialised image is not the general one bit for bit.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return effects(*arguments, context); }; });
}

}  // namespace tandem
