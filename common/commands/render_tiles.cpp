#include "common/commands/render_tiles.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/commands/console.h"
#include "common/commands/render_report.h"
#include "common/deadline.h"
#include "common/distribution/ranks.h"
#include "common/error.h"
#include "common/image/image_io.h"
#include "common/render/film_regions.h"
#include "common/text.h"

namespace tandem {

namespace {

// Why this render cannot go tile by tile, and the mend; empty: it can.
std::string no_tiles(const RenderArguments& arguments, const RenderSettings& settings, const StoppingRule& rule,
    const Renderer& renderer) {
    if (!is_exr(arguments.output)) return "tiles are written to .exr files alone; end the name in .exr";
    for (const auto& [option, value] : {std::pair{"--aov", &arguments.aov}, {"--every", &arguments.every},
             {"--range", &arguments.range}, {"--resume", &arguments.resume}})
        if (!value->empty()) return fmt::format("{} wants the whole film at once; leave it out", option);
    if (has_ranks()) return "ranks of mpirun hold the whole film; render it by one process";
    if (rule.relative_error) return "--target-error is of the whole film; give --samples";
    if (!rule.samples) return "--time alone leaves open how many samples a tile gets; give --samples";
    if (std::string reason = why_no_pixel_lists(settings); !reason.empty()) return reason;
    if (arguments.kernel == "fragment") return "fragments cover no lists of pixels; use another --kernel";
    if (dynamic_cast<const ForecastingRenderer*>(&renderer) == nullptr)
        return "this choice of --backend and --device renders whole films alone; use one cpu or vulkan device";
    return {};
}

std::string text_of_size(const RenderSettings& settings) {
    return fmt::format("{}x{}", settings.width, settings.height);
}

// As many tiles at once as the limit leaves room for.
std::vector<PixelRectangle> regions_within(std::uint64_t limit, const RenderSettings& settings,
    const StoppingRule& rule, const Scene& scene, const Renderer& renderer) {
    constexpr std::uint64_t tile_pixels = std::uint64_t{image_tile_edge} * image_tile_edge;
    const auto need_of = [&](std::uint64_t tiles) {
        return memory_need(
            renderer, scene, settings, {.pixels = tiles * tile_pixels, .samples = *rule.samples, .whole = false});
    };
    const MemoryNeed least = need_of(1);
    if (least.total() > limit)
        throw InputError(
            fmt::format("--memory: a film of {} in tiles takes at least {}, and the limit is {}; give "
                        "more --memory or a simpler scene",
                text_of_size(settings), least.text(), shown_bytes(limit)));
    std::uint64_t fits = 1, too_many = std::uint64_t{1} << 32 >> 13;  // more tiles than a film has
    while (fits + 1 < too_many) {
        const std::uint64_t middle = fits + (too_many - fits) / 2;
        (need_of(middle).total() <= limit ? fits : too_many) = middle;
    }
    return film_regions(settings.width, settings.height, image_tile_edge, fits);
}

// As describe() of the whole film, which is nowhere.
nlohmann::json describe_film(const RenderArguments& arguments, const RenderSettings& settings, const RendererInfo& info,
    const Scene& scene, StoppedRender result, std::uint64_t samples, double paths) {
    result.film.counts = {samples};
    nlohmann::json report = describe(arguments, settings, info, scene, result);
    report["paths"] = paths;
    report["paths_per_second"] = result.seconds > 0.0 ? paths / result.seconds : 0.0;
    return report;
}

// What is known before the render, and so can stand at the beginning of the file.
Image header_of(nlohmann::json known, const RenderSettings& settings) {
    for (const char* later :
        {"seconds", "paths", "paths_per_second", "invalid_samples", "device_seconds", "relative_error", "complete"})
        known.erase(later);
    FilmMoments pixel;
    pixel.moments.resize(channel_count);
    pixel.counts.resize(1);
    Image header = image_of(pixel, metadata_of(known));
    header.pixels.clear();
    header.width = header.full_width = settings.width;
    header.height = header.full_height = settings.height;
    return header;
}

// Why the film is not whole, and what is in its file.
std::string stopped_text(const RegionsRender& result, const RenderArguments& arguments, const CommandContext& context) {
    std::string text = context.stop.stop_requested() || !arguments.seconds
                           ? "stopped"
                           : fmt::format("--time: {:g} s do not suffice", *arguments.seconds);
    text += fmt::format(": {:.2g} % of the samples were done; ", 100.0 * result.done);
    if (result.samples_done == 0.0) return text + "nothing is written";
    return text + fmt::format("pixels without samples are black in {}", escaped(arguments.output));
}

}  // namespace

std::string MemoryPlan::text() const {
    std::string text = fmt::format("memory: {} forecast, limit {}", need.text(), shown_bytes(limit));
    if (!regions.empty())
        text += fmt::format("; the film in {} regions of up to {} pixels", regions.size(), region_pixels());
    return text;
}

nlohmann::json MemoryPlan::json() const {
    nlohmann::json told = need.json();
    told["limit"] = static_cast<double>(limit) / 0x1p20;
    told["peak"] = static_cast<double>(peak_resident_bytes()) / 0x1p20;
    if (!regions.empty()) told["regions"] = regions.size();
    return told;
}

MemoryPlan plan_memory(const RenderArguments& arguments, const RenderSettings& settings, const StoppingRule& rule,
    const Scene& scene, const Renderer& renderer) {
    MemoryPlan plan{.limit = memory_limit(arguments.memory),
        .need = memory_need(renderer, scene, settings, film_use(settings, rule)),
        .regions = {}};
    if (plan.need.total() <= plan.limit) return plan;
    if (const std::uint64_t scene_bytes = plan.need.scene() + plan.need.building; scene_bytes > plan.limit)
        throw InputError(fmt::format(
            "{}: its {} primitives, as placed, take {} of memory before there is a film. Program and scene take {}, "
            "tables {}, trees {}, and making them {} more. But the limit is {}; simplify models, repeat fewer groups, "
            "or give more --memory",
            arguments.scene, placed_counts(scene).all(), shown_bytes(scene_bytes), shown_bytes(plan.need.program),
            shown_bytes(plan.need.tables), shown_bytes(plan.need.trees), shown_bytes(plan.need.building),
            shown_bytes(plan.limit)));
    const std::string obstacle = no_tiles(arguments, settings, rule, renderer);
    if (!obstacle.empty())
        throw InputError(
            fmt::format("a film of {} takes {} of memory, and the limit is {}; {}, give more --memory, or "
                        "choose a smaller --size",
                text_of_size(settings), shown_bytes(plan.need.total()), shown_bytes(plan.limit), obstacle));
    plan.regions = regions_within(plan.limit, settings, rule, scene, renderer);
    plan.need = memory_need(
        renderer, scene, settings, {.pixels = plan.region_pixels(), .samples = *rule.samples, .whole = false});
    return plan;
}

ExitStatus render_tiles(const RenderArguments& arguments, const RenderSettings& settings, const StoppingRule& rule,
    const Scene& scene, Renderer& renderer, const MemoryPlan& memory, const Stopwatch& watch, NothingToKeep& starting,
    const CommandContext& context) {
    const std::unique_ptr<RenderJob> job =
        prepare_pixel_lists(renderer, scene, settings, static_cast<std::uint32_t>(memory.region_pixels()));
    starting.end();
    const RendererInfo info = renderer.info();
    StoppedRender told;
    TiledImageWriter file(arguments.output,
        header_of(describe_film(arguments, settings, info, scene, told, *rule.samples, 0.0), settings));
    const Deadline limit(
        context.stop, rule.seconds ? std::optional(std::max(1e-3, *rule.seconds - watch.seconds())) : std::nullopt);
    RegionsRender result;
    {
        ProgressLine line;
        const RenderControl control{.stop = limit.token(),
            .progress = [&](double done) { line.update(done, fmt::format("{:.1f} % of the film", 100.0 * done)); }};
        result = render_regions(*job, settings.width, memory.regions, *rule.samples, control,
            [&](const PixelRectangle& region, FilmMoments film) { file.write(region, image_of(film, {}).pixels); });
    }
    if (result.samples_done == 0.0) throw StoppedError(stopped_text(result, arguments, context));
    file.commit(context.read);

    told.seconds = result.seconds;
    told.device_seconds = result.device_seconds;
    told.relative_error = result.relative_error;
    told.film.invalid = result.invalid;
    told.complete = result.complete;
    nlohmann::json report = describe_film(arguments, settings, info, scene, told, *rule.samples, result.samples_done);
    report["memory"] = memory.json();
    write_json(context, report);
    fmt::print("{}: {} samples a pixel in {:.2f} s, {:.3g} Mpaths/s{}, in {} regions within {}{}\n",
        escaped(arguments.output), *rule.samples, result.seconds, report.at("paths_per_second").get<double>() / 1e6,
        error_text(told), memory.regions.size(), shown_bytes(memory.limit), result.complete ? "" : " (stopped early)");
    if (!result.complete) fmt::print(stderr, "tandem: {}\n", stopped_text(result, arguments, context));
    if (result.invalid == 0) return result.complete ? ExitStatus::fine : ExitStatus::undecided;
    fmt::print(stderr, "tandem: {} samples were negative or not finite (MODEL.md section 12)\n", result.invalid);
    return ExitStatus::disagree;
}

}  // namespace tandem
