#include "common/commands/command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <filesystem>

#include "common/commands/console.h"
#include "common/error.h"
#include "common/image_io.h"

namespace tandem {

namespace {

std::optional<std::uint32_t> whole_number(std::string_view text) {
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

// "WxH", or "N": the film scaled so that its longer side is N.
void apply_size(const std::string& size, RenderSettings& settings) {
    const std::size_t cross = size.find('x');
    const auto first = whole_number(std::string_view(size).substr(0, cross));
    const auto second = cross == std::string::npos ? first : whole_number(std::string_view(size).substr(cross + 1));
    constexpr std::uint32_t limit = 65536;
    if (!first || !second || *first == 0 || *second == 0 || *first > limit || *second > limit)
        throw InputError("--size: '" + size + "' is no image size; give WxH or the longer side, 1 to 65536 pixels");
    if (cross != std::string::npos) {
        settings.width = *first;
        settings.height = *second;
        return;
    }
    const double scale = static_cast<double>(*first) / std::max(settings.width, settings.height);
    settings.width = static_cast<std::uint32_t>(std::max(1.0, std::round(settings.width * scale)));
    settings.height = static_cast<std::uint32_t>(std::max(1.0, std::round(settings.height * scale)));
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

void add_render_options(CLI::App& command, RenderOptions& options) {
    command.add_option("--size", options.size, "Image size: WxH, or the longer side, in pixels")->type_name("SIZE");
    command
        .add_option("--integrator", options.integrator,
            "path (scattering alone finds the light) or next-event (light sampling with MIS); default: the scene's")
        ->check(CLI::IsMember({"path", "next-event"}));
    command.add_option("--bounces", options.bounces, "Scattering events at most (default: the scene's)")
        ->check(CLI::Range(0, 1'000'000));
    command
        .add_option("--roulette", options.roulette,
            "Russian roulette may end paths from this scattering event on, 0: never (default: the scene's)")
        ->check(CLI::Range(0, 1'000'000));
    command.add_option("--seed", options.seed, "Seed of the random numbers")->capture_default_str();
}

RenderSettings settings_from(const RenderOptions& options, const Scene& scene) {
    RenderSettings settings = default_settings(scene);
    if (!options.size.empty()) apply_size(options.size, settings);
    if (!options.integrator.empty())
        settings.integrator = options.integrator == "path" ? Integrator::path : Integrator::next_event;
    if (options.bounces) settings.bounces = *options.bounces;
    if (options.roulette) settings.roulette_start = *options.roulette == 0 ? no_roulette : *options.roulette;
    settings.seed = options.seed;
    return settings;
}

std::optional<Precision> precision_from(const std::string& name) {
    if (name.empty()) return std::nullopt;
    if (name == "single") return Precision::single_precision;
    if (name == "double") return Precision::double_precision;
    throw InputError("--precision: '" + name + "' is unknown; choose single or double");
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

void check_writable(const std::string& path) {
    if (path.empty()) return;
    const std::filesystem::path file(path);
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    std::error_code error;
    if (std::filesystem::is_directory(file, error)) throw input_error(path, "", "is a folder", "name a file in it");
    if (!std::filesystem::is_directory(folder, error))
        throw input_error(path, "", "its folder does not exist", "make " + folder.string() + " first");
    if (access(folder.c_str(), W_OK) != 0)
        throw input_error(path, "", "its folder is not writable", "choose another folder");
}

void write_json(const CommandContext& context, const nlohmann::json& report) {
    if (!context.json_file.empty()) write_text_file(context.json_file, report.dump(2) + "\n");
}

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
    CommandContext context{.program = program, .stop = interrupts.token(), .json_file = {}, .action = {}};
    add_render_command(app, context);
    add_verify_command(app, context);
    add_compare_command(app, context);
    add_devices_command(app, context);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& request) {  // --help, --version
        return app.exit(request);
    } catch (const CLI::ParseError& error) {
        fmt::print(stderr, "tandem: {}; see tandem --help\n", error.what());
        return static_cast<int>(ExitStatus::unusable_input);
    }
    return static_cast<int>(guarded([&] {
        check_writable(context.json_file);
        return context.action();
    }));
}

}  // namespace tandem
