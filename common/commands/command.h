// The command line: what the subcommands share. A command parses its options with CLI11, calls the libraries and
// returns an exit status. Only commands print. Errors are exceptions, which `run_program` catches.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>

#include "common/exercise/marker.h"
#include "common/experiment/bench.h"
#include "common/files/outputs.h"
#include "common/files/write_file.h"
#include "common/render/renderer.h"
#include "common/view/window.h"

namespace tandem {

class InterruptWatch;  // common/commands/console.h

// What the program returns (README.md).
enum class ExitStatus : int { fine = 0, disagree = 1, unusable_input = 2, undecided = 3, no_device = 4 };

// What main hands to the commands.
struct Program {
    BackendList backends;
    // The Vulkan devices as JSON: {"devices": [{"index", "name", "type", "driver", "api", "suitable", "reason", …}]}.
    std::function<nlohmann::json()> devices;
    MakeBench bench;
    ShowWindow show;                             // empty: built without a window
    std::function<std::vector<Claim>()> claims;  // of bench's own arms, whatever the device
    std::span<const Exercise> exercises;
    RunListShader run_list_shader;
};

// A backend that is there to be read. Commands that take all backends take it only where it is named.
inline constexpr std::string_view backend_to_read = "first";

// Options and duties of every command.
struct CommandContext {
    const Program& program;
    std::string command_line;            // as it was typed, absolute paths by their last part
    std::stop_token stop;                // Ctrl-C, once: finish what is in hand
    std::string json_file;               // --json; "-": standard output
    int json_descriptor = -1;            // of standard output, where --json has it
    bool verbose = false;                // -v
    std::function<ExitStatus()> action;  // set by the chosen subcommand
    InterruptWatch& interrupts;          // whose wish `stop` is
    FilesRead& read;                     // since check_outputs; no writer replaces them
};

void add_render_command(CLI::App& app, CommandContext& context);
void add_merge_command(CLI::App& app, CommandContext& context);
void add_plan_command(CLI::App& app, CommandContext& context);
void add_work_command(CLI::App& app, CommandContext& context);
void add_merge_results_command(CLI::App& app, CommandContext& context);
void add_verify_command(CLI::App& app, CommandContext& context);
void add_compare_command(CLI::App& app, CommandContext& context);
void add_denoise_command(CLI::App& app, CommandContext& context);
void add_effects_command(CLI::App& app, CommandContext& context);
void add_bench_command(CLI::App& app, CommandContext& context);
void add_cost_command(CLI::App& app, CommandContext& context);
void add_trace_command(CLI::App& app, CommandContext& context);
void add_view_command(CLI::App& app, CommandContext& context);
void add_stability_command(CLI::App& app, CommandContext& context);
void add_export_command(CLI::App& app, CommandContext& context);
void add_import_command(CLI::App& app, CommandContext& context);
void add_judges_command(CLI::App& app, CommandContext& context);
void add_exercise_command(CLI::App& app, CommandContext& context);
void add_devices_command(CLI::App& app, CommandContext& context);

// Adds --json and -v to a subcommand, and `examples` to its help.
void add_common_options(CLI::App& command, CommandContext& context, const std::string& examples);

// Parses and runs; every error becomes one line on stderr and an exit status.
[[nodiscard]] int run_program(int argc, char** argv, const Program& program);

// What --kernel, --device and --precision are to a command.
inline constexpr const char* kernel_help =
    "Vulkan kernels: stages, image-stages, megakernel, fragment, thesis, ray-tracing or ray-query, the last two also "
    "with -triangles (default: the fastest for the scene)";
inline constexpr const char* device_help = "Vulkan device: index, UUID, PCI address or name (see tandem devices)";
inline constexpr const char* devices_help =
    "Vulkan device: its index, UUID, PCI address or part of its name (see tandem devices). Several between commas, or "
    "all, share the work; cpu may be one of them";
inline constexpr const char* precision_help =
    "single, double, contracted, mixed or half-storage (default: the backend's)";

// The scene of `file`; on stderr, what of its models is not taken over. `inputs` gets the files read. Throws
// InputError.
[[nodiscard]] Scene scene_from(const std::string& file, std::vector<std::string>& inputs);

// Options that say what and how to render, shared by render and verify.
struct RenderOptions {
    std::string size;        // "WxH" or "N" (longer side); empty: the scene's film
    std::string integrator;  // empty: the scene's
    std::string mis = "on";
    std::string light_sampling{light_sampling_names[0]};
    std::string filter{pixel_filter_names[0]};
    std::string effects = "needed";
    std::optional<std::uint32_t> bounces, roulette;
    std::uint64_t seed = 0;
    std::string triangle_test{triangle_kernel_names[0]}, convex_test{convex_kernel_names[0]};
    std::string guard{guard_names[0]};
    std::string hierarchy_quality{hierarchy_quality_names[0]};
    double epsilon = IntersectionSettings{}.epsilon;
    std::string generator{generator_names[0]}, fresnel;  // fresnel: empty, the materials' own
    std::string accumulation;                            // empty: the backend's own
    std::string sampling;                                // empty: uniform, or as a target error chooses
    std::optional<double> clamp;
};
void add_render_options(CLI::App& command, RenderOptions& options);

// The scene's own settings, changed by the options. Throws InputError.
[[nodiscard]] RenderSettings settings_from(const RenderOptions& options, const Scene& scene);

// Those that differ from their defaults, but size and seed: name and value, as a command line has them.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> given_options(const RenderOptions& options);

// Throws InputError for adaptive sampling, which is render's and cost's alone.
void refuse_adaptive_sampling(const RenderOptions& options);

// A name of precision_names; empty to nothing. Throws InputError.
[[nodiscard]] std::optional<Precision> precision_from(const std::string& name);

// "1%", "0.5 %" or "0.01" to a fraction > 0; `option` names it in the error. Throws InputError.
[[nodiscard]] double fraction_from(const std::string& text, const std::string& option);

// A number above 0, at most `most`; as CLI11's own check, but NaN and infinity are refused too.
[[nodiscard]] CLI::Validator above_zero(double most);
// Digits alone, from `least` to `most`.
[[nodiscard]] CLI::Validator whole_between(std::uint64_t least, std::uint64_t most);
// Seconds that an option may ask for: 31 years still fit a clock of 64-bit nanoseconds.
inline constexpr double most_seconds = 1e9;

// check_outputs of these, of --json and of files that the standard streams go to. Before any work.
void check_outputs(const CommandContext& context, std::vector<Output> outputs, const std::vector<std::string>& inputs);

// Throws InputError when an image of that size cannot fit into this machine's memory.
void check_memory(const RenderSettings& settings);

// The commit that this program was built from, "-dirty" where files had changed; "unknown" without git.
[[nodiscard]] std::string git_version();

// Writes `report` to the --json file or to standard output, where it is asked for.
void write_json(const CommandContext& context, const nlohmann::json& report);

}  // namespace tandem
