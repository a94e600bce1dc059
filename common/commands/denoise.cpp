// tandem denoise: makes a smooth but biased image from a noisy one with variances and features.
#include "common/image/denoise.h"

#include <fmt/format.h>

#include <memory>

#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/memory.h"
#include "common/deadline.h"
#include "common/error.h"
#include "common/stopwatch.h"
#include "common/text.h"

namespace tandem {

namespace {

struct DenoiseArguments {
    std::string image, output;
    double exposure = 1.0;
    unsigned threads = 0;
};

// The file's values, those that are worked with, their guides and the result.
constexpr std::uint64_t bytes_per_pixel = 400;

ExitStatus denoise(const DenoiseArguments& arguments, const CommandContext& context) {
    NothingToKeep reading(context.interrupts);
    check_image_ending(arguments.output);
    check_outputs(context, {{"-o", arguments.output, OutputKind::image}}, {arguments.image});
    const Image image = read_image(arguments.image);
    RenderSettings size;
    size.width = image.width;
    size.height = image.height;
    check_memory(size, bytes_per_pixel, "cut it");
    const NoisyImage noisy = noisy_image_of(image, arguments.image);
    reading.end();
    const Stopwatch watch;
    ProgressLine line;
    const auto values =
        denoise(noisy, {.threads = arguments.threads, .stop = context.stop, .progress = [&](double fraction) {
                            line.update(fraction, "denoising");
                        }});
    if (!values) throw StoppedError("stopped before the image was denoised; nothing is written");
    const double seconds = watch.seconds();
    const Image result = denoised_image(image, *values);
    if (is_png(arguments.output))
        write_png(arguments.output, result, arguments.exposure, context.read);
    else
        write_image(arguments.output, result, context.read);
    write_json(
        context, {{"image", arguments.image}, {"output", arguments.output}, {"width", image.width},
                     {"height", image.height}, {"seconds", seconds}, {"denoised", denoised_text}, {"biased", true}});
    fmt::print("{}: denoised in {:.2f} s. It is biased, and its variance is not known: compare refuses it\n",
        escaped(arguments.output), seconds);
    return ExitStatus::fine;
}

}  // namespace

void add_denoise_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("denoise", "Filter the noise of an image, at the price of a bias");
    const auto arguments = std::make_shared<DenoiseArguments>();
    command
        ->add_option("image", arguments->image,
            "An .exr file with variances, count and the layers albedo, normal and depth, as render --aov writes it")
        ->required()
        ->type_name("IMAGE");
    command->add_option("-o,--output", arguments->output, "Image to write: .exr, .png or .pfm")
        ->required()
        ->type_name("FILE");
    command->add_option("--exposure", arguments->exposure, "Factor of a .png file's values")
        ->check(above_zero(1e30))
        ->capture_default_str();
    command->add_option("--threads", arguments->threads, "CPU threads (default: all)")->check(whole_between(1, 1024));
    add_common_options(*command, context,
        "  tandem render scenes/cornell-classic.json -o noisy.exr --samples 64 --aov albedo,normal,depth\n"
        "  tandem denoise noisy.exr -o smooth.png\n"
        "The filter averages pixels that are alike within their noise (joint non-local means, MODEL.md section 11.6). "
        "The result is biased: it loses detail that the noise hides. It is for looking at, and no evidence.\n"
        "tandem cost SCENE --knob denoise measures what the filter buys on a scene.\n"
        "Ctrl-C ends it; nothing is written then.\n"
        "Exit status: 0; 2 for an image that lacks a layer; 3 where it was stopped.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return denoise(*arguments, context); }; });
}

}  // namespace tandem
