#include "common/commands/command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/commands/console.h"
#include "common/error.h"
#include "common/image/image_io.h"

namespace tandem {

namespace {

template <class Number>
std::optional<Number> whole_number(std::string_view text) {
    Number value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

// "WxH", or "N": the film scaled so that its longer side is N.
void apply_size(const std::string& size, RenderSettings& settings) {
    const std::size_t cross = size.find('x');
    const auto first = whole_number<std::uint32_t>(std::string_view(size).substr(0, cross));
    const auto second =
        cross == std::string::npos ? first : whole_number<std::uint32_t>(std::string_view(size).substr(cross + 1));
    constexpr std::uint32_t limit = 65536;
    if (!first || !second || *first == 0 || *second == 0 || *first > limit || *second > limit)
        throw InputError("--size: '" + size + "' is no image size; give WxH or the longer side, 1 to 65536 pixels");
    if (cross != std::string::npos) {
        settings.width = *first;
        settings.height = *second;
        return;
    }
    settings = with_longer_side(settings, *first);
}

// Memory of the machine, or of the container where that has less.
std::uint64_t memory_bytes() {
    const auto machine =
        static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    std::uint64_t container = machine;
    std::ifstream("/sys/fs/cgroup/memory.max") >> container;  // "max", or no file: no limit
    return container == 0 ? machine : std::min(machine, container);
}

// Digits only, below 2^64: CLI11 would wrap -1 and cut off what is larger.
CLI::Validator seed_number() {
    const auto check = [](std::string& text) -> std::string {
        return whole_number<std::uint64_t>(text) ? "" : "'" + text + "' is no whole number below 2^64";
    };
    return {check, ""};
}

// Whole words between commas.
std::vector<std::string> words_of(const std::string& list) {
    std::vector<std::string> words(1);
    for (const char c : list)
        if (c == ',')
            words.emplace_back();
        else
            words.back() += c;
    return words;
}

std::optional<Effect> effect_named(const std::string& name) {
    for (std::uint32_t i = 0; i < effect_count; ++i)
        if (effect_name(static_cast<Effect>(i)) == name) return static_cast<Effect>(i);
    return std::nullopt;
}

// Names that `known_effects` let pass.
EffectSet effects_named(const std::string& list) {
    EffectSet set;
    for (const std::string& name : words_of(list)) set = set.with(effect_named(name).value());
    return set;
}

CLI::Validator known_effects() {
    const auto check = [](std::string& text) -> std::string {
        if (text == "needed" || text == "all") return {};
        for (const std::string& name : words_of(text))
            if (!effect_named(name))
                return "'" + name + "' is no effect; there are needed, all, " + effect_names(EffectSet::all());
        return {};
    };
    return {check, ""};
}

// What is wrong with the arguments, and where to read on.
std::string parse_failure(const CLI::App& app, int argc, char** argv, const CLI::ParseError& error) {
    const std::vector<CLI::App*> chosen = app.get_subcommands();
    if (!chosen.empty()) return fmt::format("{}; see tandem {} --help", error.what(), chosen.front()->get_name());
    if (argc > 1 && argv[1][0] == '-') return fmt::format("{}; see tandem --help", error.what());
    std::string names;
    for (const CLI::App* command : app.get_subcommands({})) names += (names.empty() ? "" : ", ") + command->get_name();
    return (argc > 1 ? fmt::format("'{}' is no command", argv[1]) : "no command is named") + "; there are " + names;
}

ExitStatus guarded(const std::function<ExitStatus()>& action) {
    try {
        return action();
    } catch (const DeviceError& error) {
        fmt::print(stderr, "tandem: {}\n", error.what());
        return ExitStatus::no_device;
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "tandem: out of memory; choose a smaller image\n");
        return ExitStatus::unusable_input;
    } catch (const std::exception& error) {
        fmt::print(stderr, "tandem: {}\n", error.what());
        return ExitStatus::unusable_input;
    }
}

}  // namespace

void add_common_options(CLI::App& command, CommandContext& context, const std::string& examples) {
    command.add_option("--json", context.json_file, "Write the result as JSON to FILE")->type_name("FILE");
    command.add_flag("-v,--verbose", context.verbose, "Say more on stderr");
    command.footer("Examples:\n" + examples);
}

namespace {
void add_intersection_options(CLI::App& command, RenderOptions& options);
}

void add_render_options(CLI::App& command, RenderOptions& options) {
    command.add_option("--size", options.size, "Image size: WxH, or the longer side, in pixels")->type_name("SIZE");
    command
        .add_option("--integrator", options.integrator,
            "path (scattering alone finds the light), next-event (light sampling with MIS), whitted (direct light and "
            "mirrors) or bidirectional; default: the scene's")
        ->check(CLI::IsMember(std::vector<std::string>(integrator_names.begin(), integrator_names.end())));
    command
        .add_option("--mis", options.mis,
            "Of next-event: on (light found by sampling it and by scattering, weighted by the power heuristic) or off "
            "(the lights that are sampled count by next events alone); the mean image is the same")
        ->check(CLI::IsMember({"on", "off"}))
        ->capture_default_str();
    command.add_option("--bounces", options.bounces, "Scattering events at most (default: the scene's)")
        ->check(whole_between(0, 1'000'000));
    command
        .add_option("--roulette", options.roulette,
            "Russian roulette may end paths from this scattering event on, 0: never (default: the scene's)")
        ->check(whole_between(0, 1'000'000));
    command
        .add_option("--effects", options.effects,
            "needed (what the scene calls for), all (the general kernels), or names of effects to simulate besides, "
            "separated by commas; the image is the same")
        ->check(known_effects())
        ->capture_default_str();
    command.add_option("--seed", options.seed, "Seed of the random numbers")
        ->check(seed_number())
        ->capture_default_str();
    add_intersection_options(command, options);
    command
        .add_option("--generator", options.generator,
            "Random numbers: philox, hash (cheaper) or sobol (scrambled points, whose error falls faster)")
        ->check(CLI::IsMember(std::vector<std::string>(generator_names.begin(), generator_names.end())))
        ->capture_default_str();
    command
        .add_option("--clamp", options.clamp,
            "Cut every sample's channels off at this radiance: less noise, and a bias (default: nothing is cut)")
        ->check(above_zero(1e30));
    command
        .add_option("--accumulation", options.accumulation,
            "How a pixel's samples are added up: double, compensated (two singles) or plain (one single, which drifts "
            "with the samples); default: double, or compensated on a Vulkan device without doubles")
        ->check(CLI::IsMember(std::vector<std::string>(accumulation_names.begin(), accumulation_names.end())));
    command
        .add_option("--sampling", options.sampling,
            "uniform (as many samples for every pixel) or adaptive (the more the noisier its neighbours, without a "
            "bias; --samples is then the mean); default: uniform, but render --target-error tries both")
        ->check(CLI::IsMember(std::vector<std::string>(sampling_names.begin(), sampling_names.end())));
    command
        .add_option("--fresnel", options.fresnel,
            "Reflectance of all translucent materials: exact or schlick (default: each one's own)")
        ->check(CLI::IsMember({"exact", "schlick"}));
}

namespace {

void add_intersection_options(CLI::App& command, RenderOptions& options) {
    const auto one_of = [](const auto& names) {
        return CLI::IsMember(std::vector<std::string>(names.begin(), names.end()));
    };
    command
        .add_option("--triangle-kernel", options.triangle_kernel,
            "Test of rays against triangles: watertight, moller-trumbore, baldwin-weber, and of the cpu backend embree "
            "and embree-robust")
        ->check(one_of(triangle_kernel_names))
        ->capture_default_str();
    command
        .add_option(
            "--convex-kernel", options.convex_kernel, "Test of rays against spheres and cuboids: stable or naive")
        ->check(one_of(convex_kernel_names))
        ->capture_default_str();
    command
        .add_option("--guard", options.guard,
            "What keeps a ray from finding the surface that it leaves: error-bound (moved by a bound on the rounding "
            "error), fixed-epsilon, ulp (Wächter and Binder's integer offset) or exclusion (the primitive alone)")
        ->check(one_of(guard_names))
        ->capture_default_str();
    command.add_option("--epsilon", options.epsilon, "Scene units by which --guard fixed-epsilon moves a ray")
        ->check(above_zero(1e30))
        ->capture_default_str();
}

IntersectionSettings intersection_from(const RenderOptions& options) {
    const auto place = [](const auto& names, const std::string& name) {
        return std::ranges::find(names, name) - names.begin();
    };
    IntersectionSettings settings;
    settings.triangles = static_cast<TriangleKernel>(place(triangle_kernel_names, options.triangle_kernel));
    settings.convex = static_cast<ConvexKernel>(place(convex_kernel_names, options.convex_kernel));
    settings.guard = static_cast<SelfIntersectionGuard>(place(guard_names, options.guard));
    if (options.epsilon != settings.epsilon && settings.guard != SelfIntersectionGuard::fixed_epsilon)
        throw InputError("--epsilon: counts with --guard fixed-epsilon alone; add that or leave it out");
    settings.epsilon = options.epsilon;
    return settings;
}

}  // namespace

RenderSettings settings_from(const RenderOptions& options, const Scene& scene) {
    RenderSettings settings = default_settings(scene);
    if (!options.fresnel.empty()) settings.fresnel = options.fresnel == "exact" ? Fresnel::exact : Fresnel::schlick;
    if (options.clamp) settings.clamp = *options.clamp;
    if (!options.accumulation.empty())
        settings.accumulation = static_cast<Accumulation>(
            std::ranges::find(accumulation_names, options.accumulation) - accumulation_names.begin());
    settings.generator =
        static_cast<Generator>(std::ranges::find(generator_names, options.generator) - generator_names.begin());
    if (!options.size.empty()) apply_size(options.size, settings);
    if (!options.integrator.empty())
        settings.integrator =
            static_cast<Integrator>(std::ranges::find(integrator_names, options.integrator) - integrator_names.begin());
    settings.mis = options.mis == "on";
    if (!settings.mis && settings.integrator != Integrator::next_event)
        throw InputError("--mis off: is of the integrator next-event alone, this one is " +
                         integrator_name(settings.integrator) + "; add --integrator next-event or leave it out");
    if (options.bounces) settings.bounces = *options.bounces;
    if (options.roulette) settings.roulette_start = *options.roulette == 0 ? no_roulette : *options.roulette;
    // After all that effects depend on.
    if (options.effects == "all") settings.effects = EffectSet::all();
    if (options.effects != "all" && options.effects != "needed")
        settings.effects = needed_effects(scene, settings).united(effects_named(options.effects));
    if (!options.sampling.empty())
        settings.sampling =
            static_cast<Sampling>(std::ranges::find(sampling_names, options.sampling) - sampling_names.begin());
    settings.seed = options.seed;
    settings.intersection = intersection_from(options);
    return settings;
}

std::vector<std::pair<std::string, std::string>> given_options(const RenderOptions& options) {
    std::vector<std::pair<std::string, std::string>> given;
    const auto add = [&](const char* name, const std::string& value, const std::string& otherwise = "") {
        if (value != otherwise) given.emplace_back(name, value);
    };
    const auto text = [](const auto& value) { return value ? fmt::format("{}", *value) : std::string(); };
    add("--integrator", options.integrator);
    add("--mis", options.mis, "on");
    add("--bounces", text(options.bounces));
    add("--roulette", text(options.roulette));
    add("--effects", options.effects, "needed");
    add("--triangle-kernel", options.triangle_kernel, std::string(triangle_kernel_names[0]));
    add("--convex-kernel", options.convex_kernel, std::string(convex_kernel_names[0]));
    add("--guard", options.guard, std::string(guard_names[0]));
    if (options.epsilon != IntersectionSettings{}.epsilon) add("--epsilon", fmt::format("{}", options.epsilon));
    add("--generator", options.generator, std::string(generator_names[0]));
    add("--clamp", text(options.clamp));
    add("--fresnel", options.fresnel);
    add("--accumulation", options.accumulation);
    add("--sampling", options.sampling);
    return given;
}

void refuse_adaptive_sampling(const RenderOptions& options) {
    if (options.sampling == sampling_names[static_cast<std::size_t>(Sampling::adaptive)])
        throw InputError(
            "--sampling adaptive: is of render and cost alone; here every pixel has as many samples, so leave it out");
}

std::optional<Precision> precision_from(const std::string& name) {
    if (name.empty()) return std::nullopt;
    const auto found = std::ranges::find(precision_names, name);
    if (found == precision_names.end())
        throw InputError("--precision: '" + name + "' is unknown; choose single, double, contracted or mixed");
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

void check_outputs(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs) {
    const auto same = [](const std::string& a, const std::string& b) {
        std::error_code error;
        return !a.empty() && !b.empty() &&
               std::filesystem::weakly_canonical(a, error) == std::filesystem::weakly_canonical(b, error);
    };
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        for (const std::string& input : inputs)
            if (same(outputs[i], input))
                throw input_error(outputs[i], "", "would overwrite what is read", "name another output");
        for (std::size_t j = 0; j < i; ++j)
            if (same(outputs[i], outputs[j]))
                throw input_error(outputs[i], "", "is named for two outputs", "name another file for one of them");
    }
}

void check_memory(const RenderSettings& settings) {
    // A pass in hand, the copy that a stop falls back on, the runs so far, their totals, and the image made of them. Of
    // adaptive sampling the sums of its passes too.
    const std::uint64_t planes = settings.sampling == Sampling::adaptive ? 6 : 5;
    const std::uint64_t bytes_per_pixel = planes * channel_count * sizeof(Moments);
    const std::uint64_t needed = std::uint64_t{settings.width} * settings.height * bytes_per_pixel;
    const std::uint64_t there = memory_bytes();
    constexpr double gibibyte = 0x1p30;
    if (needed > there)
        throw InputError(
            fmt::format("an image of {} x {} pixels takes at least {:.0f} GiB of memory, of which there are {:.0f}; "
                        "choose a smaller --size",
                settings.width, settings.height, static_cast<double>(needed) / gibibyte,
                static_cast<double>(there) / gibibyte));
}

void write_json(const CommandContext& context, const nlohmann::json& report) {
    if (!context.json_file.empty()) write_text_file(context.json_file, report.dump(2) + "\n");
}

namespace {

// An argument for the record, which is stored and passed on: of an absolute path only the last part.
std::string without_folder(const std::string& argument) {
    const std::size_t path = argument.starts_with('/') ? 0 : argument.find("=/");
    if (path == std::string::npos) return argument;
    const std::string before = path == 0 ? "" : argument.substr(0, path + 1);
    return before + argument.substr(argument.rfind('/') + 1);
}

}  // namespace

int run_program(int argc, char** argv, const Program& program) {
    const InterruptWatch interrupts;
    CLI::App app{
        "Tandem renders one scene with two path tracers that share no shading code, one on the CPU and one on a Vulkan "
        "device, and decides by statistics whether they agree.",
        "tandem"};
    app.require_subcommand(1);
    app.set_version_flag("--version", "tandem 0.1.0");
    app.footer(
        "Exit status: 0 fine or agree, 1 disagree, 2 unusable input or arguments, 3 undecided within the budget, 4 no "
        "usable device.\nTry: tandem COMMAND --help");
    std::string command_line = "tandem";
    for (int i = 1; i < argc; ++i) command_line += " " + without_folder(argv[i]);
    CommandContext context{
        .program = program, .command_line = command_line, .stop = interrupts.token(), .json_file = {}, .action = {}};
    add_render_command(app, context);
    add_verify_command(app, context);
    add_compare_command(app, context);
    add_effects_command(app, context);
    add_bench_command(app, context);
    add_cost_command(app, context);
    add_trace_command(app, context);
    add_stability_command(app, context);
    add_devices_command(app, context);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& request) {  // --help, --version
        return app.exit(request);
    } catch (const CLI::ParseError& error) {
        fmt::print(stderr, "tandem: {}\n", parse_failure(app, argc, argv, error));
        return static_cast<int>(ExitStatus::unusable_input);
    }
    return static_cast<int>(guarded([&] {
        if (!context.json_file.empty()) check_writable_text(context.json_file);
        return context.action();
    }));
}

}  // namespace tandem
