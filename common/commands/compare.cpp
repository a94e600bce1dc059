// tandem compare: the verdict on images of any two renderers.
#include "common/validation/compare/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "common/commands/arguments.h"
#include "common/commands/command.h"
#include "common/commands/console.h"
#include "common/commands/help.h"
#include "common/commands/memory.h"
#include "common/commands/verdict_options.h"
#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

struct CompareArguments {
    std::vector<std::string> images, reference, candidate;
    CriteriaArguments criteria;
    std::string negligible, tile_negligible;
    std::string variance_of, variance_of_a, variance_of_b;
    std::string layer, layer_a, layer_b;
    bool same_estimator = false;
    std::uint32_t bin = 1;
    std::string memory;
};

// The two sides: by --reference and --candidate, by the word "vs", or the first and second half.
void split_sides(CompareArguments& arguments) {
    if (!arguments.images.empty() && (!arguments.reference.empty() || !arguments.candidate.empty()))
        throw InputError("compare: name the images either in a row or by --reference and --candidate");
    const auto word = std::ranges::find(arguments.images, "vs");
    const std::size_t images = arguments.images.size();
    if (word != arguments.images.end()) {
        arguments.reference.assign(arguments.images.begin(), word);
        arguments.candidate.assign(word + 1, arguments.images.end());
    } else if (images % 2 == 0 && images > 0) {
        const auto middle = arguments.images.begin() + static_cast<std::ptrdiff_t>(images / 2);
        arguments.reference.assign(arguments.images.begin(), middle);
        arguments.candidate.assign(middle, arguments.images.end());
    } else if (images > 0) {
        throw InputError("compare: an odd number of images; put the word vs between the two sides");
    }
    if (arguments.reference.empty() || arguments.candidate.empty())
        throw InputError("compare: needs images on both sides: A... vs B...");
}

// --variance-of is from before there was one a side.
void set_variances(const CompareArguments& arguments, CompareOptions& options) {
    const auto meant = [&](const std::string& own) {
        return (own.empty() ? arguments.variance_of : own) == "mean" ? VarianceOf::mean : VarianceOf::sample;
    };
    options.variance_of_reference = meant(arguments.variance_of_a);
    options.variance_of_candidate = meant(arguments.variance_of_b);
    if (!arguments.variance_of.empty() && (arguments.variance_of_a.empty() || arguments.variance_of_b.empty()))
        fmt::print(stderr,
            "tandem: --variance-of {} holds for both sides; --variance-of-a and --variance-of-b say it of one\n",
            arguments.variance_of);
}

ExitStatus compare(CompareArguments arguments, const CommandContext& context) {
    split_sides(arguments);
    std::vector<std::string> inputs = arguments.reference;
    inputs.insert(inputs.end(), arguments.candidate.begin(), arguments.candidate.end());
    for (const std::string& input : inputs)
        if (!std::filesystem::exists(input)) throw input_error(input, "", "no such file", "check the path");
    check_outputs(arguments.criteria, context, {arguments.reference.front()}, inputs);
    CompareOptions options;
    options.criteria = criteria_from(arguments.criteria, CompareOptions::comparison_criteria());
    options.criteria.same_estimator = arguments.same_estimator;
    Negligible& negligible = options.criteria.negligible;
    if (!arguments.negligible.empty()) negligible.image = fraction_from(arguments.negligible, "--negligible");
    if (!arguments.tile_negligible.empty())
        negligible.tile = fraction_from(arguments.tile_negligible, "--tile-negligible");
    set_variances(arguments, options);
    options.reference_layer = arguments.layer_a.empty() ? arguments.layer : arguments.layer_a;
    options.candidate_layer = arguments.layer_b.empty() ? arguments.layer : arguments.layer_b;
    options.bin = arguments.bin;
    options.memory = memory_limit(arguments.memory);
    const std::vector<std::filesystem::path> reference(arguments.reference.begin(), arguments.reference.end());
    const std::vector<std::filesystem::path> candidate(arguments.candidate.begin(), arguments.candidate.end());
    NothingToKeep comparing(context.interrupts);
    const std::vector<SceneVerdict> verdicts{compare_files(reference, candidate, options)};
    comparing.end();
    print_verdict(verdicts.front(), context.verbose);
    return conclude("compare", verdicts, arguments.criteria, context);
}

}  // namespace

void add_compare_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("compare", "Decide whether images of any two renderers agree");
    const auto arguments = std::make_shared<CompareArguments>();
    command
        ->add_option(
            "images", arguments->images, "Images: A... vs B.... Without vs, the first half is compared with the second")
        ->type_name("IMAGE");
    command->add_option("--reference", arguments->reference, "Images of side A")->type_name("IMAGE");
    command->add_option("--candidate", arguments->candidate, "Images of side B")->type_name("IMAGE");
    const auto variance = [&](const char* name, std::string& value, const char* whose) {
        return command->add_option(name, value, whose)->check(one_of({"sample", "mean"}));
    };
    variance("--variance-of-a", arguments->variance_of_a,
        "Side A's variance channels hold the variance of one sample, or of the pixel's mean (default: sample)");
    variance("--variance-of-b", arguments->variance_of_b, "The same for side B (default: sample)");
    variance("--variance-of", arguments->variance_of, "Both sides at once, where they are alike")->group(rare_options);
    command
        ->add_option("--layer", arguments->layer,
            "Layer of both sides to compare: albedo for albedo.R, .G and .B, for example (default: see below)")
        ->type_name("NAME");
    command->add_option("--layer-a", arguments->layer_a, "Layer of side A")->type_name("NAME")->group(rare_options);
    command->add_option("--layer-b", arguments->layer_b, "Layer of side B")->type_name("NAME")->group(rare_options);
    command->add_flag("--same-estimator", arguments->same_estimator,
        "Both sides use one estimator, so a different variance is a fault too");
    const Criteria defaults = CompareOptions::comparison_criteria();
    command
        ->add_option("--negligible", arguments->negligible,
            fmt::format("Disagreement needs the image mean off by more than this (default: {}, the rounding of half "
                        "precision)",
                percent(defaults.negligible.image)))
        ->type_name("FRACTION");
    command
        ->add_option("--tile-negligible", arguments->tile_negligible,
            fmt::format(
                "Disagreement needs a tile off by more than this (default: {})", percent(defaults.negligible.tile)))
        ->type_name("FRACTION");
    command
        ->add_option("--bin", arguments->bin,
            "Compare means of N x N pixels instead of pixels. Files of any size are then read in bands")
        ->check(whole_between(1, 4096))
        ->type_name("N")
        ->group(rare_options);
    add_memory_option(*command, arguments->memory, memory_help);
    add_criteria(*command, arguments->criteria, defaults);
    add_common_options(*command, context,
        "  tandem render scenes/cornell-classic.json -o a.exr --size 64 --samples 4096\n"
        "  tandem render scenes/cornell-classic.json -o b.exr --size 64 --samples 4096 --seed 1\n"
        "  tandem compare a.exr b.exr\n\n"
        "A side is one image with variance channels and a sample count, or several images of independent seeds.\n"
        "Files: EXR (parts and layers too), HDR, TIFF, PNG, PFM, NumPy. Channels: R, G, B, else those of the layer "
        "Combined, "
        "Beauty or rgba, else of the only layer; variance.R, .G, .B; count. Metadata: samples, samplesPerPixel, "
        "tandem:samples, cycles.LAYER.samples, tandem:seed, windows, colour space. Integers without a colour space are "
        "decoded from sRGB. More: common/validation/compare/README.md");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return compare(*arguments, context); }; });
}

}  // namespace tandem
