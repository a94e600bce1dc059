// The options of rendering that most commands share, and the settings that they give.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/commands/arguments.h"
#include "common/commands/command.h"
#include "common/commands/help.h"
#include "common/commands/memory.h"
#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

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

void add_intersection_options(CLI::App& command, RenderOptions& options) {
    command
        .add_option("--triangle-test", options.triangle_test,
            "Intersection test of triangles: watertight, moller-trumbore or baldwin-weber. The cpu backend also has "
            "embree and embree-robust")
        ->check(one_of_names(triangle_kernel_names))
        ->capture_default_str()
        ->group(rare_options);
    command
        .add_option("--convex-test", options.convex_test, "Intersection test of spheres and cuboids: stable or naive")
        ->check(one_of_names(convex_kernel_names))
        ->capture_default_str()
        ->group(rare_options);
    command
        .add_option("--guard", options.guard,
            "Self-intersection offset of spawned rays: error-bound, fixed-epsilon, ulp (Wächter and Binder) or "
            "exclusion (none; the primitive is skipped)")
        ->check(one_of_names(guard_names))
        ->capture_default_str()
        ->group(rare_options);
    command.add_option("--epsilon", options.epsilon, "Offset of --guard fixed-epsilon, in scene units")
        ->check(above_zero(1e30))
        ->capture_default_str()
        ->group(rare_options);
}

IntersectionSettings intersection_from(const RenderOptions& options) {
    const auto place = [](const auto& names, const std::string& name) {
        return std::ranges::find(names, name) - names.begin();
    };
    IntersectionSettings settings;
    settings.triangles = static_cast<TriangleKernel>(place(triangle_kernel_names, options.triangle_test));
    settings.convex = static_cast<ConvexKernel>(place(convex_kernel_names, options.convex_test));
    settings.guard = static_cast<SelfIntersectionGuard>(place(guard_names, options.guard));
    if (options.epsilon != settings.epsilon && settings.guard != SelfIntersectionGuard::fixed_epsilon)
        throw InputError("--epsilon: is used by --guard fixed-epsilon alone; add that, or leave --epsilon out");
    settings.epsilon = options.epsilon;
    return settings;
}

}  // namespace

void add_render_options(CLI::App& command, RenderOptions& options) {
    command.add_option("--size", options.size, "Image size in pixels, WxH or the longer side (default: the scene's)")
        ->type_name("SIZE");
    command
        .add_option("--integrator", options.integrator,
            "path, next-event (samples the lights, with MIS), whitted or bidirectional (default: the scene's)")
        ->check(one_of_names(integrator_names));
    command.add_option("--bounces", options.bounces, "Scattering events of a path, at most (default: the scene's)")
        ->check(whole_between(0, 1'000'000));
    command.add_option("--seed", options.seed, "Seed of the random numbers")
        ->check(seed_number())
        ->capture_default_str();
    command
        .add_option("--roulette", options.roulette,
            "Scattering event from which Russian roulette may end a path. 0 is never (default: the scene's)")
        ->check(whole_between(0, 1'000'000))
        ->group(rare_options);
    command
        .add_option("--mis", options.mis,
            "Multiple importance sampling of --integrator next-event, on or off. Off, a sampled light counts by "
            "next-event estimation alone. The mean image is the same")
        ->check(one_of({"on", "off"}))
        ->capture_default_str()
        ->group(rare_options);
    command
        .add_option("--light-sampling", options.light_sampling,
            "How light sampling chooses a light: power (in proportion to it), uniform (all alike) or tree (by place "
            "and direction of light and receiver, for many lights). The mean image is the same")
        ->check(one_of_names(light_sampling_names))
        ->capture_default_str()
        ->group(rare_options);
    command
        .add_option("--filter", options.filter,
            "Pixel filter: box (the pixel's square), tent (2 pixels wide) or gaussian (3 pixels wide). Wider filters "
            "smooth edges. They give another image, not another estimate of the same one")
        ->check(one_of_names(pixel_filter_names))
        ->capture_default_str()
        ->group(rare_options);
    command
        .add_option("--sampling", options.sampling,
            "uniform, or adaptive (noisy pixels get more samples, without bias). Adaptive takes --samples as the mean. "
            "render --target-error tries both (default: uniform)")
        ->check(one_of_names(sampling_names))
        ->group(rare_options);
    command
        .add_option("--generator", options.generator,
            "Random numbers: philox, hash (cheaper) or sobol (Owen-scrambled, whose error falls faster)")
        ->check(one_of_names(generator_names))
        ->capture_default_str()
        ->group(rare_options);
    command
        .add_option("--clamp", options.clamp,
            "Greatest radiance of a sample, by channel. Less noise, but a bias (default: no limit)")
        ->check(above_zero(1e30))
        ->group(rare_options);
    command
        .add_option(
            "--fresnel", options.fresnel, "Reflectance of every dielectric: exact or schlick (default: the material's)")
        ->check(one_of({"exact", "schlick"}))
        ->group(rare_options);
    command
        .add_option("--effects", options.effects,
            "needed (what the scene calls for), all (the general kernels), or names, separated by commas, to simulate "
            "in addition. The image is the same")
        ->check(known_effects())
        ->capture_default_str()
        ->group(rare_options);
    command
        .add_option("--accumulation", options.accumulation,
            "Sums of a pixel's samples: double, compensated (two singles) or plain (one single). Plain sums drift "
            "(default: double where the device has it, else compensated)")
        ->check(one_of_names(accumulation_names))
        ->group(rare_options);
    command
        .add_option("--hierarchy-quality", options.hierarchy_quality,
            "Quality of the hierarchy over primitives: high, medium or low. Low is built fastest, but "
            "slowest to trace. The image is the same")
        ->check(one_of_names(hierarchy_quality_names))
        ->capture_default_str()
        ->group(rare_options);
    add_intersection_options(command, options);
}

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
        throw InputError("--mis off: the integrator " + integrator_name(settings.integrator) +
                         " has no MIS; add --integrator next-event, or leave --mis out");
    settings.light_sampling = static_cast<LightSampling>(
        std::ranges::find(light_sampling_names, options.light_sampling) - light_sampling_names.begin());
    settings.filter =
        static_cast<PixelFilter>(std::ranges::find(pixel_filter_names, options.filter) - pixel_filter_names.begin());
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
    settings.hierarchy = static_cast<HierarchyQuality>(
        std::ranges::find(hierarchy_quality_names, options.hierarchy_quality) - hierarchy_quality_names.begin());
    if (const std::string reason = beyond_memory(scene, settings); !reason.empty())
        throw InputError(reason + " with these options; meshes are kept once without them (scenes/format/FORMAT.md)");
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
    add("--light-sampling", options.light_sampling, std::string(light_sampling_names[0]));
    add("--filter", options.filter, std::string(pixel_filter_names[0]));
    add("--bounces", text(options.bounces));
    add("--roulette", text(options.roulette));
    add("--effects", options.effects, "needed");
    add("--triangle-test", options.triangle_test, std::string(triangle_kernel_names[0]));
    add("--convex-test", options.convex_test, std::string(convex_kernel_names[0]));
    add("--guard", options.guard, std::string(guard_names[0]));
    if (options.epsilon != IntersectionSettings{}.epsilon) add("--epsilon", fmt::format("{}", options.epsilon));
    add("--hierarchy-quality", options.hierarchy_quality, std::string(hierarchy_quality_names[0]));
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
            "--sampling adaptive: this command gives every pixel as many samples; only render and cost can; leave it "
            "out");
}

}  // namespace tandem
