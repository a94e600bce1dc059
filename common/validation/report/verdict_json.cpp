#include "common/validation/report/verdict_json.h"

#include <cmath>

#include "common/validation/verdict/error_metrics.h"

namespace tandem {

namespace {

using nlohmann::json;

constexpr std::array<const char*, channel_count> channel_names{"R", "G", "B"};

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json region_json(const RegionComparison& region) {
    const Rectangle& r = region.region;
    return {{"x0", r.x0}, {"y0", r.y0}, {"x1", r.x1}, {"y1", r.y1}, {"channel", channel_names.at(region.channel)},
        {"reference", number(region.reference)}, {"candidate", number(region.candidate)},
        {"relative_difference", number(region.relative)}, {"relative_difference_low", number(region.relative_low)},
        {"relative_difference_high", number(region.relative_high)}, {"statistic", number(region.statistic)},
        {"degrees_of_freedom", number(region.dof)}, {"p", number(region.p)}};
}

json level_json(const LevelResult& level) {
    json result{{"name", level.name}, {"test", level.test}, {"tests", level.tests}, {"p", number(level.p)},
        {"threshold", level.threshold}, {"gates", level.threshold > 0.0}, {"significant", level.significant},
        {"minimum_detectable_relative",
            level.minimum_detectable_relative > 0.0 ? json(level.minimum_detectable_relative) : json(nullptr)},
        {"worst", region_json(level.worst)}};
    if (!level.regions.empty()) result["bound_relative"] = number(widest(level).bound());
    return result;
}

json info_json(const std::string& name, const RendererInfo& info, std::uint64_t seed) {
    return {{"name", name}, {"backend", info.backend}, {"device", info.device}, {"driver", info.driver},
        {"api", info.api}, {"seed", seed}};
}

json settings_json(const RenderSettings& settings) {
    return {{"width", settings.width}, {"height", settings.height},
        {"integrator", integrator_name(settings.integrator)}, {"mis", settings.mis},
        {"light_sampling", light_sampling_names[static_cast<std::size_t>(settings.light_sampling)]},
        {"hierarchy_quality", hierarchy_quality_names[static_cast<std::size_t>(settings.hierarchy)]},
        {"filter", pixel_filter_names[static_cast<std::size_t>(settings.filter)]}, {"bounces", settings.bounces},
        {"roulette_start", settings.roulette_start == no_roulette ? json(nullptr) : json(settings.roulette_start)},
        {"accumulation", settings.accumulation
                             ? json(accumulation_names[static_cast<std::size_t>(*settings.accumulation)])
                             : json(nullptr)},
        {"ray_min", number(settings.ray_min)}, {"ray_max", number(settings.ray_max)}};
}

json criteria_json(const Criteria& criteria) {
    const Margins& m = criteria.margins;
    const Negligible& n = criteria.negligible;
    return {{"margin_image_relative", m.image}, {"margin_tile_relative", m.tile}, {"tile_floor_relative", m.tile_floor},
        {"channel_floor_relative", m.channel_floor}, {"negligible_image_relative", n.image},
        {"negligible_tile_relative", n.tile}, {"negligible_pixel_relative", n.pixel},
        {"negligible_paired_image_relative", n.paired_image}, {"negligible_paired_tile_relative", n.paired_tile},
        {"resolution_paired_image_relative", criteria.paired_resolution.image},
        {"resolution_paired_tile_relative", criteria.paired_resolution.tile}, {"strict", criteria.strict},
        {"negligible_paired_pixel_relative", n.paired_pixel}, {"negligible_variance_ratio", n.variance_ratio},
        {"false_alarm", criteria.false_alarm}, {"doubt", criteria.doubt}, {"discovery_rate", criteria.discovery_rate},
        {"power", criteria.power}, {"fixed_tolerance_relative", criteria.fixed_tolerance},
        {"same_estimator", criteria.same_estimator}};
}

json looks_json(const std::vector<Look>& looks) {
    json rows = json::array();
    for (const Look& look : looks)
        rows.push_back({{"samples", look.samples}, {"paired_samples", look.paired_samples},
            {"false_alarm", look.share.false_alarm}, {"doubt", look.share.doubt}, {"verdict", name_of(look.verdict)},
            {"least_p", number(look.least_p)}, {"image_bound_relative", number(look.image_bound)},
            {"tile_bound_relative", number(look.tile_bound)}, {"seconds", look.seconds}});
    return rows;
}

json arithmetic_json(const SceneVerdict& v) {
    if (!v.paired.arithmetic) return nullptr;
    const Arithmetic& a = *v.paired.arithmetic;
    return {{"coarser_than_single", v.judgement.coarse_arithmetic}, {"samples", a.level.worst.reference},
        {"parted_fraction", a.level.worst.relative}, {"expected_fraction", a.expected.share()},
        {"expected_samples", a.expected.lit}, {"allowed_fraction", a.allowed}, {"p", number(a.level.p)}};
}

json paired_json(const SceneVerdict& v) {
    const PairedResult& paired = v.paired;
    if (!paired.done) return nullptr;
    const auto resolution = [&](const char* name) {
        return v.looks.empty() ? json(nullptr) : number(v.judgement.level(name).resolution_relative);
    };
    const RegionComparison& image = widest(paired.image);
    return {{"samples", paired.samples}, {"blocks", paired.blocks}, {"relative_difference", number(image.relative)},
        {"relative_difference_low", number(image.relative_low)},
        {"relative_difference_high", number(image.relative_high)},
        {"worst_tile_relative", number(widest(paired.tiles).bound())},
        {"identical_fraction", paired.identical_fraction}, {"diverged_fraction", paired.diverged_fraction},
        {"resolution_image_relative", resolution("paired image")},
        {"resolution_tile_relative", resolution("paired tiles 16x16")}, {"arithmetic", arithmetic_json(v)}};
}

json explanations_json(const std::vector<Explanation>& explanations) {
    json rows = json::array();
    for (const Explanation& one : explanations) {
        rows.push_back({{"text", one.text}, {"explained_relative", nullptr}, {"explained_at_least_relative", nullptr}});
        if (!one.share) continue;
        rows.back()["explained_relative"] = number(one.share->value);
        rows.back()["explained_at_least_relative"] = number(one.share->at_least);
    }
    return rows;
}

json likeness_json(const std::optional<Likeness>& likeness) {
    if (!likeness) return nullptr;
    json subsystems = json::array();
    for (const Subsystem subsystem : likeness->subsystems)
        subsystems.push_back(subsystem_names.at(static_cast<std::size_t>(subsystem)));
    return {{"text", told(*likeness)}, {"planted_bugs", likeness->bugs}, {"subsystems", subsystems},
        {"score_fraction", likeness->sureness}, {"right", likeness->right}, {"of", likeness->of}};
}

json paired_look_json(const PairedLook& look) {
    return {{"pairs", look.pairs}, {"invalid_samples", look.invalid}, {"parted_fraction", look.sums.share()},
        {"relative_difference", number(look.relative)}, {"relative_error", number(look.error)}, {"p", number(look.p)}};
}

json elimination_json(const std::optional<Elimination>& elimination) {
    if (!elimination) return nullptr;
    json trials = json::array();
    for (const FeatureTrial& trial : elimination->trials)
        trials.push_back({{"feature", trial.feature.words}, {"subsystem", name_of(trial.feature.part)},
            {"need", need_names.at(static_cast<std::size_t>(trial.need))},
            {"without", trial.without ? paired_look_json(*trial.without) : json(nullptr)}});
    return {{"text", told(*elimination)}, {"scenes", elimination->scenes}, {"seconds", elimination->seconds},
        {"whole", paired_look_json(elimination->whole)}, {"features", trials},
        {"bounces_off", elimination->bounces_off ? json(*elimination->bounces_off) : json(nullptr)},
        {"left_out", elimination->left_out}};
}

json data_json(const std::optional<DataTrial>& trial) {
    if (!trial) return nullptr;
    return {{"text", told(*trial)}, {"fault", trial->fault.words}, {"side", name_of(trial->faulty)},
        {"parted", trial->parted}, {"parted_with_fault", trial->left}};
}

json ranking_json(const std::optional<PartRanking>& ranking) {
    if (!ranking) return nullptr;
    const PartEvidence& evidence = ranking->evidence;
    json parts = json::array();
    for (std::size_t i = 0; i < subsystem_names.size(); ++i)
        parts.push_back({{"subsystem", subsystem_names.at(i)}, {"pattern_score", evidence.pattern.at(i)},
            {"need", evidence.needs ? json(part_need_names.at(static_cast<std::size_t>(evidence.needs->at(i))))
                                    : json(nullptr)},
            {"counted", ranking->counted.at(i)}, {"score", ranking->all.at(i)}});
    return {{"parts", parts}, {"independent_draws", evidence.independent_draws},
        {"numbers", number_use_names.at(static_cast<std::size_t>(evidence.numbers))}};
}

json precision_json(const std::optional<PrecisionTrial>& trial) {
    if (!trial) return nullptr;
    return {{"text", told(*trial)}, {"right_in_double", name_of(trial->side)},
        {"right_in_mixed", trial->right_in_mixed ? json(*trial->right_in_mixed) : json(nullptr)},
        {"parted", trial->parted}, {"parted_in_double", trial->in_double}};
}

json form_look_json(const FormLook& look) {
    return {{"samples", look.samples}, {"relative_difference", number(look.relative)},
        {"relative_error", number(look.error)}};
}

json missed_form_json(const std::optional<MissedForm>& missed) {
    if (!missed) return nullptr;
    json changes = json::array();
    for (const FormTrial& trial : missed->trials)
        changes.push_back({{"change", trial.change}, {"subsystem", name_of(trial.part)},
            {"outcome", form_outcome_names.at(static_cast<std::size_t>(trial.outcome))},
            {"with", form_look_json(trial.look)}});
    const auto text = [](const std::string& s) { return s.empty() ? json(nullptr) : json(s); };
    return {{"text", told(*missed)}, {"seconds", missed->seconds}, {"whole", form_look_json(missed->whole)},
        {"changes", changes}, {"film", text(missed->film)}, {"unsound_data", text(missed->data)},
        {"left_out", missed->left_out}};
}

// Figures that are not 0: with them a naming can be tried anew without rendering.
json signature_json(const std::optional<Signature>& signature) {
    if (!signature) return nullptr;
    json figures = json::object();
    for (std::size_t i = 0; i < figure_count; ++i)
        if (const float value = signature->figures[i]; value != 0.0F)
            figures[std::string(figure_name(static_cast<Figure>(i)))] =
                std::round(1e4 * static_cast<double>(value)) / 1e4;
    return figures;
}

json outvoted_json(Outvoted outvoted) { return outvoted == Outvoted::nobody ? json(nullptr) : json(name_of(outvoted)); }

json closed_form_json(const SceneVerdict& v) {
    const ClosedFormUse& use = v.closed_form;
    if (!use.form) return use.skipped.empty() ? json(nullptr) : json{{"applies", false}, {"skipped", use.skipped}};
    json result{{"applies", true}, {"skipped", nullptr}, {"formula", use.form->formula},
        {"radiance", use.form->radiance}, {"rounding_relative", use.form->rounding},
        {"greatest_sample", use.form->greatest}, {"outvoted", nullptr}};
    if (v.looks.empty()) return result;
    result["outvoted"] = outvoted_json(outvoted_by_closed_form(v.judgement));
    for (const auto& [key, name] :
        {std::pair{"reference", closed_form_reference_level}, {"candidate", closed_form_candidate_level}})
        result[key] = region_json(widest(v.judgement.level(name)));
    return result;
}

json oracle_side_json(const std::optional<Judgement>& judgement) {
    if (!judgement) return nullptr;
    const RegionComparison& image = widest(judgement->level("paired image"));
    return {{"contradicted", judgement->verdict == Verdict::disagree}, {"relative_difference", number(image.relative)},
        {"relative_difference_low", number(image.relative_low)},
        {"relative_difference_high", number(image.relative_high)},
        {"reasons", judgement->verdict == Verdict::disagree ? json(judgement->reasons) : json::array()}};
}

json oracle_json(const std::optional<OracleOpinion>& oracle) {
    if (!oracle) return nullptr;
    const OracleOpinion& r = *oracle;
    json result = info_json(r.name, r.info, r.settings.seed);
    result.update({{"text", r.text}, {"outvoted", outvoted_json(r.outvoted)}, {"width", r.settings.width},
        {"height", r.settings.height}, {"integrator", integrator_name(r.settings.integrator)}, {"samples", r.samples},
        {"seconds", r.seconds}, {"budget_seconds", r.budget_seconds}, {"reference", oracle_side_json(r.reference)},
        {"candidate", oracle_side_json(r.candidate)}});
    return result;
}

json estimated_json(const Estimated& figure) {
    return {{"value", number(figure.value)}, {"low", number(figure.low)}, {"high", number(figure.high)}};
}

json convergence_side_json(const ConvergenceSide& side) {
    json errors = json::array();
    for (const Estimated& error : side.squared_errors) errors.push_back(estimated_json(error));
    const auto root = [](double square) { return std::sqrt(std::max(square, 0.0)); };
    const Estimated& bias = side.squared_bias;
    return {{"squared_errors_relative", errors}, {"slope", estimated_json(side.slope)},
        {"bias_floor_relative", estimated_json({root(bias.value), root(bias.low), root(bias.high)})},
        {"squared_bias_relative", estimated_json(bias)}, {"variance_ratio", estimated_json(side.variance_ratio)}};
}

json convergence_json(const std::optional<ConvergenceReport>& report) {
    if (!report) return nullptr;
    json between = json::array();
    for (const Estimated& ratio : report->between) between.push_back(estimated_json(ratio));
    return {{"samples", report->samples}, {"reference_samples", report->reference_samples},
        {"reference_relative_error", number(report->reference_relative_error)},
        {"reference", convergence_side_json(report->reference)},
        {"candidate", convergence_side_json(report->candidate)}, {"between", between}, {"seconds", report->seconds}};
}

json worst_pixel_json(const std::optional<WorstPixel>& worst) {
    if (!worst) return nullptr;
    const auto text = [](const std::string& s) { return s.empty() ? json(nullptr) : json(s); };
    return {{"x", worst->x}, {"y", worst->y}, {"sample", worst->sample}, {"seed", worst->seed},
        {"reason", text(worst->reason)}, {"trace", text(worst->command)}};
}

json metrics_json(const SceneVerdict& v) {
    if (v.looks.empty()) return nullptr;
    const ErrorMetrics m = error_metrics(v.reference, v.candidate);
    return {{"mse", number(m.mse)}, {"rmse", number(m.rmse)}, {"noise_mse", number(m.noise_mse)},
        {"relative_mse", number(m.relative_mse)}, {"trimmed_relative_mse", number(m.trimmed_relative_mse)},
        {"epsilon", ErrorMetrics::epsilon}, {"trimmed_fraction", ErrorMetrics::trimmed}};
}

// The keys that the interface promises.
json promised(const SceneVerdict& v) {
    json result{{"scene", v.scene}, {"verdict", name_of(v.verdict)}, {"relative_difference", nullptr},
        {"relative_difference_low", nullptr}, {"relative_difference_high", nullptr},
        {"margin_relative", v.criteria.margins.image}, {"worst_tile_relative", nullptr},
        {"samples_reference", v.reference.samples}, {"samples_candidate", v.candidate.samples},
        {"seconds_reference", v.reference_seconds}, {"seconds_candidate", v.candidate_seconds},
        {"minimum_detectable_relative", nullptr}};
    if (v.looks.empty()) return result;
    const LevelResult &level = v.judgement.level("image"), &tiles = v.judgement.level("tiles 16x16");
    const RegionComparison& image = widest(level);
    result["relative_difference"] = number(image.relative);
    result["relative_difference_low"] = number(image.relative_low);
    result["relative_difference_high"] = number(image.relative_high);
    result["worst_tile_relative"] = number(widest(tiles).bound());
    result["minimum_detectable_relative"] = number(level.minimum_detectable_relative);
    result["channel"] = channel_names.at(image.channel);
    return result;
}

}  // namespace

json to_json(const SceneVerdict& v) {
    json result = promised(v);
    result["sentence"] = v.sentence;
    result["failure"] = v.failure.empty() ? json(nullptr) : json(v.failure);
    result["reasons"] = v.judgement.reasons;
    result["notes"] = v.notes;
    result["black"] = v.judgement.black;
    result["margin_tile_relative"] = v.criteria.margins.tile;
    result["reference"] = info_json(v.reference_name, v.reference_info, v.reference_seed);
    result["candidate"] = info_json(v.candidate_name, v.candidate_info, v.candidate_seed);
    result["settings"] = settings_json(v.settings);
    result["film"] = v.film ? json{{"width", v.film->width}, {"height", v.film->height}} : json(nullptr);
    result["criteria"] = criteria_json(v.criteria);
    result["levels"] = json::array();
    for (const LevelResult& level : v.judgement.levels) result["levels"].push_back(level_json(level));
    result["looks"] = looks_json(v.looks);
    result["paired"] = paired_json(v);
    result["explanations"] = explanations_json(v.explanations);
    result["likeness"] = likeness_json(v.likeness);
    result["misreading"] = v.misreading ? json(v.misreading->words) : json(nullptr);
    result["suspects"] = json::array();
    for (const Suspect& suspect : v.suspects)
        result["suspects"].push_back({{"subsystem", name_of(suspect.part)}, {"because", suspect.because}});
    result["ranking"] = ranking_json(v.ranking);
    result["elimination"] = elimination_json(v.elimination);
    result["data_trial"] = data_json(v.data_trial);
    result["precision_trial"] = precision_json(v.precision_trial);
    result["missed_form"] = missed_form_json(v.missed_form);
    result["signature"] = signature_json(v.signature);
    result["outvoted"] = outvoted_json(v.outvoted);
    result["closed_form"] = closed_form_json(v);
    result["referee"] = oracle_json(v.oracle);
    result["convergence"] = convergence_json(v.convergence);
    result["error_metrics"] = metrics_json(v);
    result["worst_pixel"] = worst_pixel_json(v.worst);
    result["permutation_p"] = v.permutation_p ? json(*v.permutation_p) : json(nullptr);
    result["pixel_discoveries"] = v.judgement.discoveries;
    result["fixed_pixels"] = {{"count", v.judgement.fixed.count}, {"mismatches", v.judgement.fixed.mismatches},
        {"greatest_relative", v.judgement.fixed.greatest_relative}};
    result["invalid_samples_reference"] = v.reference.invalid;
    result["invalid_samples_candidate"] = v.candidate.invalid;
    result["stopped"] = v.stopped;
    result["forecast_seconds"] = v.forecast_seconds ? nlohmann::json(*v.forecast_seconds) : nlohmann::json();
    result["seconds"] = v.seconds;
    return result;
}

json to_json(std::span<const SceneVerdict> verdicts, const std::vector<std::string>& not_run) {
    std::vector<Verdict> all;
    json scenes = json::array();
    for (const SceneVerdict& verdict : verdicts) {
        all.push_back(verdict.verdict);
        scenes.push_back(to_json(verdict));
    }
    const RendererInfo device = verdicts.empty() ? RendererInfo{} : verdicts.front().candidate_info;
    return {{"verdict", name_of(combined(all, not_run.empty()))}, {"scenes", scenes}, {"not_run", not_run},
        {"device", {{"name", device.device}, {"driver", device.driver}, {"api", device.api}}}};
}

}  // namespace tandem
