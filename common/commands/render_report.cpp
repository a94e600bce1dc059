#include "common/commands/render_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/commands/command.h"

namespace tandem {

nlohmann::json describe(const RenderArguments& arguments, const RenderSettings& settings, const RendererInfo& info,
    const Scene& scene, const StoppedRender& result) {
    const auto paths = static_cast<double>(result.film.paths());
    nlohmann::json report{{"git", git_version()}, {"scene", scene.name}, {"backend", info.backend},
        {"device", info.device}, {"driver", info.driver}, {"api", info.api}, {"width", settings.width},
        {"height", settings.height}, {"samples", std::llround(result.film.count())}, {"seed", settings.seed},
        {"integrator", integrator_name(settings.integrator)}, {"mis", settings.mis},
        {"light_sampling", light_sampling_names[static_cast<std::size_t>(settings.light_sampling)]},
        {"filter", pixel_filter_names[static_cast<std::size_t>(settings.filter)]}, {"bounces", settings.bounces},
        {"sampling", sampling_names[static_cast<std::size_t>(settings.sampling)]},
        {"precision", arguments.precision.empty() ? "default" : arguments.precision},
        {"kernel", arguments.kernel.empty() ? "default" : arguments.kernel}, {"effects", arguments.options.effects},
        {"triangle_kernel", arguments.options.triangle_test}, {"convex_kernel", arguments.options.convex_test},
        {"guard", arguments.options.guard}, {"hierarchy_quality", arguments.options.hierarchy_quality},
        {"generator", generator_names[static_cast<std::size_t>(settings.generator)]}, {"seconds", result.seconds},
        {"paths", paths}, {"paths_per_second", result.seconds > 0.0 ? paths / result.seconds : 0.0},
        {"invalid_samples", result.film.invalid}, {"complete", result.complete}};
    report["accumulation"] =
        accumulation_names[static_cast<std::size_t>(settings.accumulation.value_or(info.accumulation))];
    if (settings.intersection.guard == SelfIntersectionGuard::fixed_epsilon)
        report["epsilon"] = settings.intersection.epsilon;  // scene units
    if (arguments.options.clamp) report["clamp"] = *arguments.options.clamp;
    if (!arguments.options.fresnel.empty()) report["fresnel"] = arguments.options.fresnel;
    if (settings.roulette_start != no_roulette) report["roulette"] = settings.roulette_start;
    if (result.relative_error) report["relative_error"] = *result.relative_error;
    if (result.relative_error_interval) {
        report["relative_error_low"] = result.relative_error_interval->low;
        report["relative_error_high"] = result.relative_error_interval->high;
    }
    if (result.device_seconds) report["device_seconds"] = *result.device_seconds;
    if (settings.sampling == Sampling::adaptive) {
        report["samples_least"] = std::ranges::min(result.film.counts);
        report["samples_most"] = std::ranges::max(result.film.counts);
    }
    return report;
}

std::map<std::string, std::string> metadata_of(const nlohmann::json& report) {
    std::map<std::string, std::string> metadata;
    for (const auto& [key, value] : report.items())
        metadata["tandem:" + key] = value.is_string() ? value.get<std::string>() : value.dump();
    return metadata;
}

std::string error_text(const StoppedRender& result) {
    if (!result.relative_error) return "";
    std::string text = fmt::format(", error {:.2g} % of the mean", 100.0 * *result.relative_error);
    if (result.relative_error_interval)
        text += fmt::format(" ({:.2g} to {:.2g} %)", 100.0 * result.relative_error_interval->low,
            100.0 * result.relative_error_interval->high);
    return text;
}

}  // namespace tandem
