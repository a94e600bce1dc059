// tandem merge: the image of parts that were rendered apart.
#include "common/commands/merge.h"

#include <fmt/format.h>

#include "common/commands/render_arguments.h"
#include "common/deadline.h"
#include "common/distribution/part.h"
#include "common/error.h"
#include "common/image/image_io.h"
#include "common/render/stopping.h"
#include "common/text.h"

namespace tandem {

namespace {

Part all_of(const std::vector<std::string>& files, const std::stop_token& stop) {
    Part all = read_part(files.front());
    for (std::size_t i = 1; i < files.size(); ++i) {
        if (stop.stop_requested()) throw StoppedError("stopped; nothing is written");
        take_in(all, read_part(files[i]), files[i]);
    }
    return all;
}

// What no part holds, up to the end of the image as far as that is known.
std::vector<SampleRange> gaps_of(const Part& all) {
    const std::vector<SampleRange> there = all.estimate.ranges();
    std::vector<SampleRange> gaps;
    std::uint64_t at = 0;
    for (const SampleRange& range : there) {
        if (range.begin > at) gaps.push_back({at, range.begin});
        at = range.end;
    }
    if (all.whole > at) gaps.push_back({at, all.whole});
    return gaps;
}

// The figures that the parts' own metadata tell of a part alone.
void describe(Part& all, const std::vector<SampleRange>& gaps, const FilmMoments& film) {
    const auto paths = static_cast<double>(film.paths());
    std::map<std::string, std::string>& metadata = all.metadata;
    const auto put = [&](const std::string& key, const nlohmann::json& value) {
        metadata["tandem:" + key] = value.is_string() ? value.get<std::string>() : value.dump();
    };
    put("samples", all.estimate.count());
    put("seconds", all.seconds);
    put("paths", paths);
    put("paths_per_second", all.seconds > 0.0 ? paths / all.seconds : 0.0);
    put("invalid_samples", film.invalid);
    put("complete", gaps.empty());
    put("device", fmt::format("{}", fmt::join(all.devices, "; ")));
    metadata.erase("tandem:device_seconds");
    metadata.erase("tandem:relative_error");
    if (const auto error = relative_error_of(film); error && all.independent()) put("relative_error", *error);
}

nlohmann::json report_of(const Part& all, std::size_t parts, const std::vector<SampleRange>& gaps) {
    nlohmann::json report{{"parts", parts}, {"samples", all.estimate.count()}, {"devices", all.devices},
        {"seconds", all.seconds}, {"invalid_samples", all.estimate.invalid()}, {"complete", gaps.empty()},
        {"gaps", nlohmann::json::array()}};
    for (const SampleRange& gap : gaps) report["gaps"].push_back({{"begin", gap.begin}, {"end", gap.end}});
    return report;
}

}  // namespace

ExitStatus merge_parts(const MergeArguments& arguments, const CommandContext& context) {
    check_image_ending(arguments.output);
    if (arguments.sums) check_part_ending("-o", arguments.output);
    check_outputs(context, {{"-o", arguments.output, OutputKind::image}}, arguments.parts);
    Part all = all_of(arguments.parts, context.stop);
    const std::vector<SampleRange> gaps = gaps_of(all);
    if (!gaps.empty() && !arguments.allow_gaps)
        throw InputError(fmt::format(
            "no part holds samples {}; name the parts that do, or --allow-gaps for an image of what there is",
            to_string(gaps)));
    const FilmMoments film = film_of(all.estimate);
    describe(all, gaps, film);
    if (arguments.sums)
        write_part(arguments.output, all, context.read);
    else if (is_png(arguments.output))
        write_png(arguments.output, image_of(film, all.metadata, all.independent()), arguments.exposure, context.read);
    else
        write_image(arguments.output, image_of(film, all.metadata, all.independent()), context.read);
    write_json(context, report_of(all, arguments.parts.size(), gaps));
    fmt::print("{}: {} part{}, {} samples a pixel{}\n", escaped(arguments.output), arguments.parts.size(),
        arguments.parts.size() == 1 ? "" : "s", all.estimate.count(),
        gaps.empty() ? "" : "; missing are samples " + to_string(gaps));
    if (all.devices.size() > 1)
        fmt::print("    by {} devices, each with bits of its own: {}\n", all.devices.size(),
            escaped(fmt::format("{}", fmt::join(all.devices, "; "))));
    if (film.invalid == 0) return ExitStatus::fine;
    fmt::print(stderr, "tandem: {} samples were negative or not finite (MODEL.md section 12)\n", film.invalid);
    return ExitStatus::disagree;
}

void add_merge_command(CLI::App& app, CommandContext& context) {
    CLI::App* command = app.add_subcommand("merge", "Make one image from parts that were rendered separately");
    const auto arguments = std::make_shared<MergeArguments>();
    command->add_option("parts", arguments->parts, "Files that render --range or --resume wrote")
        ->required()
        ->type_name("PART");
    command->add_option("-o,--output", arguments->output, "Image to write, as render does")
        ->required()
        ->type_name("FILE");
    command->add_flag("--allow-gaps", arguments->allow_gaps, "Make an image even if samples are missing");
    command->add_flag("--sums", arguments->sums, "Write a part again, to be merged with others");
    command->add_option("--exposure", arguments->exposure, "Factor of a PNG's radiance")
        ->check(above_zero(1e9))
        ->capture_default_str();
    add_common_options(*command, context,
        "  tandem render scenes/glass.json -o a.exr --range 0:512 --samples 1024\n"
        "  tandem render scenes/glass.json -o b.exr --range 512:1024 --samples 1024\n"
        "  tandem merge a.exr b.exr -o glass.exr\n"
        "The image has the bits of render --samples 1024.");
    command->callback(
        [&context, arguments] { context.action = [&context, arguments] { return merge_parts(*arguments, context); }; });
}

}  // namespace tandem
