#include "tests/mutants/trial.h"

#include <algorithm>

#include "common/scene/loader/scene_loader.h"
#include "cpu_ref/backend.h"
#include "tests/mutants/plant_data.h"
#include "vulkan/backend.h"

namespace tandem::test {

namespace {

bool is_closed_form(const LevelResult& level) { return level.name.starts_with("closed form"); }

// The most significant of the closed form's levels, or of the others; empty: none is significant.
std::string most_significant_level(const Judgement& judgement, bool closed_form) {
    const LevelResult* most = nullptr;
    for (const LevelResult& level : judgement.levels)
        if (level.significant && is_closed_form(level) == closed_form && (most == nullptr || level.p < most->p))
            most = &level;
    return most == nullptr ? "" : most->name;
}

}  // namespace

std::filesystem::path scene_file(const std::string& name) {
    return std::filesystem::path(TANDEM_SOURCE_DIR) / "scenes" / (name + ".json");
}

std::vector<std::string> shipped_scenes() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(scene_file("x").parent_path()))
        if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
    std::ranges::sort(names);
    return names;
}

SceneVerdict verdict_of(const PlantedFault& fault, Planting planting, const std::string& name, const Effort& effort) {
    const Scene scene = load_scene(scene_file(name));
    const PlantedFault in_cpu = planting == Planting::vulkan ? PlantedFault() : fault;
    const PlantedFault in_vulkan = planting == Planting::cpu ? PlantedFault() : fault;
    BackendOptions single;
    single.precision = Precision::single_precision;
    const auto cpu = renderer_with(cpu_backend(), in_cpu, single);
    const auto vulkan = renderer_with(vulkan_backend(), in_vulkan, single);
    VerifyOptions options;
    options.settings = verification_settings(scene, effort.longer_side);
    make_visible(fault.bug, *options.settings);
    const std::uint64_t pixels = std::uint64_t{options.settings->width} * options.settings->height;
    constexpr std::uint64_t usual_pixels = 64 * 32;
    options.max_samples = effort.samples * std::max<std::uint64_t>(1, usual_pixels / pixels);
    options.max_looks = effort.looks;
    options.budget_seconds = effort.seconds;
    options.scenes = shipped_scenes().size();
    options.explain = effort.explained;
    // The CPU's bug is in both of its precisions.
    BackendOptions precise;
    precise.precision = Precision::double_precision;
    const auto other_precision = effort.long_paths ? renderer_with(cpu_backend(), in_cpu, precise) : nullptr;
    options.other_precision = other_precision.get();
    options.kernels = {"stages", "image-stages", "megakernel"};
    options.with_kernel = [&](const std::string& kernel) {
        BackendOptions other = single;
        other.kernel = kernel;
        return renderer_with(vulkan_backend(), in_vulkan, other);
    };
    return verify_scene(scene, *cpu, *vulkan, options);
}

Needs needs_of(const PlantedFault& fault, Planting planting, const std::string& name) {
    const Scene scene = load_scene(scene_file(name));
    const PlantedFault in_cpu = planting == Planting::vulkan ? PlantedFault() : fault;
    const PlantedFault in_vulkan = planting == Planting::cpu ? PlantedFault() : fault;
    BackendOptions single, precise;
    single.precision = Precision::single_precision;
    precise.precision = Precision::double_precision;
    const auto cpu = renderer_with(cpu_backend(), in_cpu, single),
               other = renderer_with(cpu_backend(), in_cpu, precise);
    const auto vulkan = renderer_with(vulkan_backend(), in_vulkan, single);
    RenderSettings settings = verification_settings(scene, signature_effort.longer_side);
    make_visible(fault.bug, settings);
    Needs needs;
    needs.partings = partings_of_paths(
        {.scene = scene,
            .settings = settings,
            .reference = *cpu,
            .candidate = *vulkan,
            .region = std::nullopt,
            .stop = {}}).value_or(PathPartings{});
    Criteria criteria;
    criteria.fixed_tolerance = float_transport_tolerance(settings.bounces);
    constexpr double seconds = 5.0;  // about what verify has for it
    needs.elimination = eliminate({.scene = scene,
        .settings = settings,
        .reference = *cpu,
        .candidate = *vulkan,
        .other_precision = other.get(),
        .criteria = criteria,
        .suspicion = {},
        .budget_seconds = seconds,
        .expected_seconds = 0.0,
        .stop = {},
        .progress = {}});
    return needs;
}

Trial trial_of(const SceneVerdict& verdict, Planting planting, const std::string& scene, std::string_view bug) {
    Trial trial;
    trial.scene = scene;
    const Judgement& judgement = verdict.judgement;
    for (const LevelResult& level : judgement.levels)
        if (level.significant) trial.levels.push_back(level.name);
    if (verdict.verdict == Verdict::disagree) {
        const std::string by_form = most_significant_level(judgement, true);
        std::string by_backends = most_significant_level(judgement, false);
        if (by_backends.empty() && judgement.fixed.mismatches > 0) by_backends = "fixed pixels";
        if (by_backends.empty() && verdict.reference.invalid + verdict.candidate.invalid > 0)
            by_backends = "invalid samples";
        const bool form = planting == Planting::both || by_backends.empty();
        trial.level = form ? by_form : by_backends;
        trial.caught = !trial.level.empty();
        if (trial.caught) trial.witness = form ? "closed form" : "backends";
    }
    // What the record knows of this very bug is left out.
    std::vector<PlantedSignature> rows;
    std::ranges::copy_if(
        planted_signatures(), std::back_inserter(rows), [&](const PlantedSignature& row) { return row.bug != bug; });
    std::vector<PlantedNeeds> needs;
    std::ranges::copy_if(
        planted_needs(), std::back_inserter(needs), [&](const PlantedNeeds& row) { return row.bug != bug; });
    std::vector<Suspect> blamed = verdict.suspects;
    if (verdict.signature && verdict.partings)
        blamed = suspects_of_difference({judgement, *verdict.signature, *verdict.partings, verdict.fault_place,
                                            verdict.elimination ? &*verdict.elimination : nullptr,
                                            verdict.precision_trial ? &*verdict.precision_trial : nullptr,
                                            verdict.data_trial ? &*verdict.data_trial : nullptr},
            {rows, needs})
                     .suspects;
    for (const Suspect& suspect : blamed) trial.blamed.emplace_back(name_of(suspect.part));
    trial.coarse_arithmetic = judgement.coarse_arithmetic;
    trial.samples = std::min(verdict.reference.samples, verdict.candidate.samples);
    trial.width = verdict.settings.width;
    trial.height = verdict.settings.height;
    trial.seconds = verdict.seconds;
    trial.sentence = verdict.sentence;
    return trial;
}

}  // namespace tandem::test
