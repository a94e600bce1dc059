#include "common/commands/render_arguments.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "common/commands/help.h"
#include "common/commands/memory.h"
#include "common/commands/shipped_files.h"
#include "common/distribution/part.h"
#include "common/distribution/ranks.h"
#include "common/error.h"
#include "common/image/feature_layers.h"
#include "common/image/image_io.h"
#include "common/render/adaptive_sampling.h"
#include "common/render/sample_film.h"

namespace tandem {

std::uint64_t factor_from(const std::string& every) {
    for (std::uint64_t factor = 2; factor <= samples_per_block; factor *= 2)
        if (every == fmt::format("{}x", factor)) return factor;
    throw InputError(
        fmt::format("--every: '{}' is none of 2x, 4x, 8x, 16x, 32x, 64x; 2x writes 1, 2, 4, ... samples", every));
}

StoppingRule stopping_rule(const RenderArguments& arguments) {
    StoppingRule rule;
    rule.seconds = arguments.seconds;
    if (!arguments.target_error.empty()) rule.relative_error = fraction_from(arguments.target_error, "--target-error");
    rule.samples = arguments.samples;
    if (!rule.samples && !rule.seconds && !rule.relative_error) rule.samples = default_samples;
    return rule;
}

SampleRange range_of(const RenderArguments& arguments) {
    if (arguments.range.empty()) return {0, arguments.samples.value_or(default_samples)};
    const SampleRange range = range_from(arguments.range);
    if (arguments.samples && range.end > *arguments.samples)
        throw InputError(fmt::format(
            "--range: ends at sample {}, beyond the --samples {} of the image", range.end, *arguments.samples));
    return range;
}

void check_part_ending(const std::string& option, const std::string& file) {
    check_image_ending(file);
    if (!is_exr(file))
        throw InputError(
            fmt::format("{} {}: is to hold sums, which only an .exr file does; end the name in .exr", option, file));
}

void check_extra_images(const RenderArguments& arguments) {
    for (const auto& [option, value] : {std::pair{"--aov", arguments.aov}, {"--every", arguments.every}}) {
        if (value.empty()) continue;
        if (!arguments.range.empty() || !arguments.resume.empty())
            throw InputError(
                fmt::format("{}: parts of an image (--range, --resume) hold sums alone; leave one out", option));
        if (has_ranks()) throw InputError(fmt::format("{}: not under mpirun; render it by one process", option));
    }
    if (!arguments.aov.empty() && !is_png(arguments.output) && !is_exr(arguments.output))
        throw InputError(
            fmt::format("--aov: {} has no place for features; end the name in .exr (layers) or .png "
                        "(pictures beside it)",
                arguments.output));
    if (!arguments.aov.empty()) static_cast<void>(features_from(arguments.aov));
    if (!arguments.every.empty() && !arguments.target_error.empty())
        throw InputError("--every: goes by samples, not by an error (--target-error); leave one out");
    if (!arguments.every.empty() && arguments.options.sampling == sampling_names[1])
        throw InputError("--every: adaptive sampling shares out all samples at once; leave --sampling or --every out");
}

std::string name_beside(const std::string& output, std::string_view word) {
    const std::filesystem::path path(output);
    return (path.parent_path() / fmt::format("{}.{}{}", path.stem().string(), word, path.extension().string()))
        .string();
}

std::string name_in_film(const std::string& output, std::uint64_t samples) {
    const std::filesystem::path path(output);
    return (path.parent_path() / fmt::format("{}-{:06}{}", path.stem().string(), samples, path.extension().string()))
        .string();
}

std::vector<Output> extra_outputs(const RenderArguments& arguments, const StoppingRule& rule) {
    std::vector<Output> outputs;
    if (!arguments.aov.empty() && is_png(arguments.output))
        for (const Feature feature : features_from(arguments.aov))
            outputs.push_back({"--aov",
                name_beside(arguments.output, feature_names.at(static_cast<std::size_t>(feature))), OutputKind::image});
    if (arguments.every.empty()) return outputs;
    constexpr std::uint64_t likely = 1 << 16;
    const std::uint64_t last = rule.samples.value_or(likely);
    for (std::uint64_t samples = 1; samples < last; samples *= factor_from(arguments.every))
        outputs.push_back({"--every", name_in_film(arguments.output, samples), OutputKind::image});
    outputs.push_back({"--every", name_in_film(arguments.output, last), OutputKind::image});
    return outputs;
}

namespace {

void add_what(CLI::App& command, RenderArguments& arguments) {
    command.add_option("scene", arguments.scene, scene_help)->required()->transform(scene_name())->type_name("SCENE");
    command
        .add_option("-o,--output", arguments.output,
            "Image to write. EXR holds mean, variance and samples of a pixel; .pfm holds the mean; .png is sRGB")
        ->required()
        ->type_name("FILE");
}

void add_how(CLI::App& command, RenderArguments& arguments) {
    command.add_option("--backend", arguments.backend, "cpu, vulkan, oracle or first (a path tracer to read)")
        ->capture_default_str();
    command.add_option("--device", arguments.device, devices_help);
    command.add_option("--precision", arguments.precision, precision_help);
    command.add_option("--threads", arguments.threads, "CPU threads (default: all)")
        ->check(whole_between(1, 1024))
        ->group(rare_options);
    command.add_option("--exposure", arguments.exposure, "Factor of a PNG's radiance")
        ->check(above_zero(1e9))
        ->capture_default_str()
        ->group(rare_options);
    command.add_option("--kernel", arguments.kernel, kernel_help)->group(rare_options);
    add_memory_option(command, arguments.memory,
        "Memory that the render may take, 2GiB for example (default: three quarters of what is free). A larger film is "
        "rendered and written tile by tile, as .exr");
    command.add_flag("--validation", arguments.validation, "Use Vulkan's validation layers; any message is an error")
        ->group(rare_options);
}

void add_how_long(CLI::App& command, RenderArguments& arguments) {
    command
        .add_option(
            "--samples", arguments.samples, "Samples a pixel (default: 64, or no limit with --time or --target-error)")
        ->check(whole_between(1, numbers_alike));
    command
        .add_option("--time", arguments.seconds,
            "Seconds, at most, with loading and preparing the scene. The first sample of every pixel may take a "
            "twentieth and half a second longer")
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS");
    command
        .add_option("--target-error", arguments.target_error,
            "Stop at this error of the image, 5% for example. Short trials choose "
            "integrator, roulette, generator and sampling, where they are not given")
        ->type_name("FRACTION");
    command
        .add_option("--range", arguments.range,
            "A:B: render samples A to before B alone, and write their sums for tandem merge. --samples says how many "
            "the whole image gets")
        ->type_name("RANGE")
        ->group(rare_options);
    command
        .add_option(
            "--resume", arguments.resume, "Store the sums in FILE at intervals, and go on from FILE if it exists")
        ->type_name("FILE");
    command
        .add_option("--keep-every", arguments.keep_seconds,
            "Most seconds between two times that --resume stores the sums; at first it stores them more often")
        ->check(above_zero(most_seconds))
        ->type_name("SECONDS")
        ->capture_default_str()
        ->group(rare_options);
}

void add_what_else(CLI::App& command, RenderArguments& arguments) {
    command
        .add_option("--aov", arguments.aov,
            "Also write what the camera's rays meet first: albedo, normal, depth, distance, position, coverage, "
            "primitive, material (separated by commas), or all. In .exr as layers, for .png as pictures beside it")
        ->type_name("LIST");
    command
        .add_option("--every", arguments.every,
            "2x: also write the images of 1, 2, 4, 8, ... samples, as numbered files (4x: 1, 4, 16, ...)")
        ->type_name("FACTOR");
}

}  // namespace

void add_render_arguments(CLI::App& command, RenderArguments& arguments) {
    add_what(command, arguments);
    add_how_long(command, arguments);
    add_what_else(command, arguments);
    add_render_options(command, arguments.options);
    add_how(command, arguments);
}

}  // namespace tandem
