#include "common/cost/run_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <sstream>
#include <utility>

#include "common/cost/reference.h"
#include "common/cost/schedule.h"
#include "common/deadline.h"
#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

// Shares of the time: the reference, and of what is left then the short stage of all arms and that of mixed knobs.
constexpr double reference_share = 0.3, short_share = 0.35, mix_share = 0.08;
constexpr double making_share = 0.3;      // of the time after the reference, for the kernels of the arms
constexpr double scheduled_share = 0.93;  // the rest is for replicates that take longer than foretold, and figures
constexpr double saving_share = 0.05;     // of the time, for saving

// What is said on the way, as a share of the whole.
CostControl within(const CostControl& control, double from, double to) {
    CostControl inner = control;
    if (control.progress)
        inner.progress = [from, to, tell = control.progress](
                             double fraction, const std::string& text) { tell(from + fraction * (to - from), text); };
    return inner;
}

// One more setting on top of a mix.
void add_to(CostArm& mix, const CostArm& arm, const std::vector<KnobSetting>& knobs) {
    const auto knob = std::ranges::find_if(
        knobs, [&](const KnobSetting& one) { return one.knob == arm.knob && one.setting == arm.setting; });
    if (knob == knobs.end()) return;
    knob->apply(mix.settings);
    mix.keeps_estimate = mix.keeps_estimate && knob->keeps_estimate;
    mix.setting += (mix.setting.empty() ? "" : " + ") + arm.name();
    mix.options = with_options(mix.options, arm.options);
}

// The best settings together; and, as these pay off at many samples, each with Sobol points and with adaptive sampling.
std::vector<CostArm> mixes(
    const std::vector<ArmFigures>& figures, const std::vector<KnobSetting>& knobs, const CostRequest& request) {
    std::vector<CostArm> all;
    for (const std::vector<std::size_t>& together : mixed_settings(figures)) {
        CostArm mix{"mix", "", "", request.baseline, true};
        for (const std::size_t one : together) add_to(mix, figures[one].arm, knobs);
        all.push_back(std::move(mix));
    }
    return all;
}

std::vector<std::string> names_of(const std::vector<CostArm>& arms) {
    std::vector<std::string> names;
    for (const CostArm& arm : arms) names.push_back(arm.name());
    return names;
}

// Up to least_alike samples a pixel adaptive sampling is uniform: such figures say nothing of it.
void leave_out_what_did_not_adapt(CostReport& report) {
    const Sampling base = report.figures.front().arm.settings.render.sampling;
    for (const ArmFigures& figures : report.figures)
        if (figures.arm.settings.render.sampling != base && figures.points.back().samples <= least_alike)
            report.skipped.push_back({figures.arm.knob, figures.arm.setting,
                fmt::format(
                    "no more than {} samples a pixel in its share of the time, and up to {} adaptive sampling is "
                    "uniform",
                    figures.points.back().samples, least_alike)});
    std::erase_if(report.figures, [&](const ArmFigures& figures) {
        return figures.arm.settings.render.sampling != base && figures.points.back().samples <= least_alike;
    });
}

void check_knobs(const std::vector<KnobSetting>& all, const std::vector<std::string>& wanted) {
    std::vector<std::string> known;
    for (const KnobSetting& one : all)
        if (std::ranges::find(known, one.knob) == known.end()) known.push_back(one.knob);
    for (const std::string& name : wanted)
        if (std::ranges::find(known, name) == known.end())
            throw InputError(fmt::format(
                "--knob: there is no '{}'; {}there are {}", name, did_you_mean(name, known), fmt::join(known, ", ")));
}

}  // namespace

std::string with_options(const std::string& before, const std::string& more) {
    std::vector<std::pair<std::string, std::string>> all;
    std::istringstream words(before + " " + more);
    for (std::string word; words >> word;) {
        if (word.starts_with("--") || all.empty()) {
            std::erase_if(all, [&](const auto& one) { return one.first == word; });
            all.emplace_back(word, "");
        } else {
            all.back().second += " " + word;
        }
    }
    std::string text;
    for (const auto& [option, value] : all) text += (text.empty() ? "" : " ") + option + value;
    return text;
}

std::vector<CostArm> single_arms(const Scene& scene, const CostRequest& request, const RendererInfo& renderer,
    double mean, std::vector<SkippedArm>& skipped) {
    std::vector<CostArm> arms;
    const std::vector<KnobSetting> knobs = knob_settings(scene, request.baseline, renderer, mean);
    check_knobs(knobs, request.knobs);
    for (const KnobSetting& one : knobs) {
        if (!request.knobs.empty() && std::ranges::find(request.knobs, one.knob) == request.knobs.end()) continue;
        if (!one.reason.empty()) {
            skipped.push_back({one.knob, one.setting, one.reason});
            continue;
        }
        CostArm arm{one.knob, one.setting, one.options, request.baseline, one.keeps_estimate};
        one.apply(arm.settings);
        arms.push_back(std::move(arm));
    }
    return arms;
}

CostReport run_cost(const Scene& scene, CostRequest request, const CostControl& control) {
    const auto now = [&] { return now_by(control); };
    const double start = now();
    CostReport report;
    report.scene_file = request.scene_file;
    report.given = request.given;
    report.scene = scene.name;
    report.backend = request.backend;
    report.reference_backend = request.reference_backend;
    report.width = request.baseline.render.width;
    report.height = request.baseline.render.height;

    CostExperiment experiment(scene, request.make, request.seed);
    const auto spent = [&] { return now() - start; };
    if (!experiment.add({"baseline", "", "", request.baseline, true}))
        throw UnsupportedError(experiment.skipped().back().reason);  // nothing to hold the others against
    const RendererInfo info = experiment.info();
    check_knobs(knob_settings(scene, request.baseline, info, 0.0), request.knobs);
    CostSamples samples;
    samples.reference =
        long_reference(scene, request, reference_share * request.seconds, within(control, 0.0, reference_share));
    samples.key =
        hash_of(samples.reference.key + request.scene_bytes + request.program + text_of(request.baseline, info));
    if (request.earlier) {
        if (request.earlier->key != samples.key) throw other_measurement();
        samples = std::move(*request.earlier);
    }
    samples.width = report.width;
    const double mean = samples.reference.image_mean();
    // On a GPU the kernels of twenty arms take longer than many a time for measuring.
    const double making_end = spent() + making_share * std::max(0.0, request.seconds - spent());
    for (const CostArm& arm : single_arms(scene, request, info, mean, report.skipped)) {
        if (control.stop.stop_requested() || spent() > making_end)
            experiment.skip_for_time(arm, "no time was left to make its kernels");
        else
            (void)experiment.add(arm);
    }
    experiment.time_hierarchies(std::max(0.0, making_end - spent()), control);
    report.device = info.device;
    report.driver = info.driver;
    const double before = samples.seconds;
    const auto whole = [&] {
        samples.seconds = before + now() - start;
        return samples;
    };
    CostControl saving = control;
    double may_save = 0.0;  // many images are saved: no more often than it is worth
    if (control.save)
        saving.save = [&](const CostSamples&) {
            if (spent() < may_save) return;
            const double begin = spent();
            (void)whole();
            control.save(samples);
            may_save = spent() + (spent() - begin) / saving_share;
        };

    const auto tell = [&] {
        if (!request.keep) return;
        CostReport now_known = report;
        std::ranges::copy(experiment.skipped(), std::back_inserter(now_known.skipped));
        now_known.whole = false;
        request.keep(now_known);
    };
    const auto take = [&](std::vector<ArmFigures> figures) {
        report.figures = std::move(figures);
        report.reference = samples.reference;
        report.seconds = whole().seconds;
    };

    const auto left = [&] { return std::max(0.0, scheduled_share * request.seconds - spent()); };
    const double shortest = left() * short_share;
    report.whole =
        experiment.measure(names_of(experiment.arms()), shortest, samples, within(saving, reference_share, 0.5));
    take(analyse_cost(experiment.arms(), samples));
    if (report.figures.empty())
        throw StoppedError(fmt::format(
            "stopped before the baseline had {} replicates; a smaller --size has them sooner", fewest_replicates));
    tell();
    std::vector<std::string> mixed;
    // What is mixed follows from the short stage alone, so that a continued measurement mixes the same.
    for (const CostArm& mix : mixes(analyse_cost(experiment.arms(), samples, {short_stage, short_stage + 1}),
             knob_settings(scene, request.baseline, info, mean), request))
        if (!control.stop.stop_requested() && experiment.add(mix)) mixed.push_back(mix.name());
    if (!mixed.empty() && !control.stop.stop_requested()) {
        const double rest = left() * mix_share * static_cast<double>(mixed.size());
        report.whole = experiment.measure(mixed, rest, samples, within(saving, 0.5, 0.55)) && report.whole;
        take(analyse_cost(experiment.arms(), samples));
        tell();
    }
    const double later = spent();
    while (!control.stop.stop_requested()) {
        const std::optional<CostStage> stage = next_stage(report.figures, samples, left());
        if (!stage) break;
        const double done = (spent() - later) / std::max(1e-9, request.seconds - later);
        const CostControl inner = within(saving, 0.55 + 0.45 * std::min(1.0, done), 1.0);
        if (!experiment.extend(*stage, left(), samples, inner)) break;
        take(analyse_cost(experiment.arms(), samples));
        tell();
    }
    report.whole = report.whole && !control.stop.stop_requested();
    report.confirmations = confirm(experiment.arms(), samples);
    leave_out_what_did_not_adapt(report);
    report.skipped.insert(report.skipped.end(), experiment.skipped().begin(), experiment.skipped().end());
    report.seconds = whole().seconds;
    if (control.save) control.save(samples);
    return report;
}

}  // namespace tandem
