#include "common/cost/run_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/deadline.h"
#include "common/error.h"
#include "common/experiment/experiment.h"
#include "common/files/read_file.h"
#include "common/files/write_file.h"
#include "common/text.h"

namespace tandem {

namespace {

// Shares of the time: the reference, and of the rest what the arms of mixed knobs get, and what is measured anew.
constexpr double reference_share = 0.35, mix_share = 0.2, confirmation_share = 0.15;
constexpr double making_share = 0.3;  // of the time after the reference, for the kernels of the arms
constexpr double mix_begin = 1.0 - mix_share - confirmation_share, confirmation_begin = 1.0 - confirmation_share;
constexpr std::uint64_t reference_seed = 0x7265666572656e63u;  // "referenc": unlike any that a user gives

std::string text_of(const ArmSettings& settings, const RendererInfo& info) {
    const RenderSettings& render = settings.render;
    const IntersectionSettings& meeting = render.intersection;
    return fmt::format(
        "{}x{} seed {} {} bounces {} roulette {} rays {} {} kernels {} {} {} {} on {} {} {} precision {} {} generator "
        "{} clamp {} fresnel {} mis {} accumulation {} sampling {}",
        render.width, render.height, render.seed, integrator_name(render.integrator), render.bounces,
        render.roulette_start, render.ray_min, render.ray_max, static_cast<int>(meeting.triangles),
        static_cast<int>(meeting.convex), static_cast<int>(meeting.guard), meeting.epsilon, info.backend, info.device,
        info.driver, settings.backend.precision ? static_cast<int>(*settings.backend.precision) : -1,
        settings.backend.kernel, static_cast<int>(render.generator), render.clamp,
        render.fresnel ? static_cast<int>(*render.fresnel) : -1, render.mis,
        static_cast<int>(render.accumulation.value_or(info.accumulation)),
        sampling_names[static_cast<std::size_t>(render.sampling)]);
}

// What the reference's bits depend on: the files, the settings, the machine and the program.
std::string key_of(const CostRequest& request, const ArmSettings& settings, const RendererInfo& info) {
    return hash_of(fmt::format("{}\n{}\n{}", request.scene_bytes, text_of(settings, info), request.program));
}

std::optional<CostReference> cached(const std::filesystem::path& file, const std::string& key, std::size_t size) {
    if (!std::filesystem::exists(file)) return std::nullopt;
    CostReference reference = reference_from_bytes(read_file(file), file.string());
    if (reference.key != key || reference.mean.size() != size)
        throw input_error(file.string(), "", "is not the reference that its name says", "delete it");
    return reference;
}

// What is said on the way, as a share of the whole.
CostControl within(const CostControl& control, double from, double to) {
    CostControl inner = control;
    if (control.progress)
        inner.progress = [from, to, tell = control.progress](
                             double fraction, const std::string& text) { tell(from + fraction * (to - from), text); };
    return inner;
}

InputError other_measurement() {
    return InputError(
        "--resume: that measurement is of another scene, size, device, program or of other settings; name another file "
        "to begin anew");
}

CostReference make_reference(const Scene& scene, const CostRequest& request, const CostControl& control) {
    ArmSettings settings = reference_settings(scene, request.baseline, request.reference_backend);
    settings.render.seed = reference_seed;
    const std::unique_ptr<Renderer> renderer = request.make_reference(settings.backend);
    const std::unique_ptr<RenderJob> job = renderer->prepare(scene, settings.render);
    const RendererInfo info = renderer->info();
    const std::string key = key_of(request, settings, info);
    if (request.earlier && request.earlier->reference.key != key) throw other_measurement();
    if (request.earlier) return request.earlier->reference;
    const std::filesystem::path file =
        request.references.empty() ? std::filesystem::path() : request.references / (key + ".cbor");
    const std::size_t size = std::size_t{settings.render.width} * settings.render.height * channel_count;
    std::optional<CostReference> earlier = file.empty() ? std::nullopt : cached(file, key, size);
    const double before = earlier ? earlier->seconds : 0.0;
    CostReference reference = render_reference(*job, std::move(earlier), reference_share * request.seconds, control);
    if (reference.samples == 0)
        throw StoppedError(fmt::format(
            "stopped before there was a reference, of {} samples a pixel at least; a smaller --size has one sooner",
            2 * samples_per_block));
    reference.key = key;
    reference.options = fmt::format("--integrator {} --bounces {} --roulette {}{}",
        integrator_name(settings.render.integrator), settings.render.bounces, settings.render.roulette_start,
        settings.backend.precision
            ? " --precision " + std::string(precision_names[static_cast<std::size_t>(*settings.backend.precision)])
            : "");
    if (!file.empty() && reference.seconds > before) {
        std::filesystem::create_directories(request.references);
        write_text_file(file, to_bytes(reference), request.read == nullptr ? FilesRead{} : *request.read);
    }
    if (!(reference.image_mean() > 0.0))
        throw InputError("the image is black, so that no error is relative to anything");
    return reference;
}

CostArm mixed(
    const std::vector<ArmFigures>& figures, const std::vector<KnobSetting>& knobs, const CostRequest& request) {
    CostArm mix{"mix", "", "", request.baseline, true};
    for (const std::size_t best : best_settings(figures)) {
        const CostArm& arm = figures[best].arm;
        const auto knob = std::ranges::find_if(
            knobs, [&](const KnobSetting& one) { return one.knob == arm.knob && one.setting == arm.setting; });
        if (knob == knobs.end()) continue;
        knob->apply(mix.settings);
        mix.keeps_estimate = mix.keeps_estimate && knob->keeps_estimate;
        mix.setting += (mix.setting.empty() ? "" : " + ") + arm.name();
        mix.options += (mix.options.empty() ? "" : " ") + arm.options;
    }
    return mix;
}

std::vector<std::string> names_of(const std::vector<CostArm>& arms) {
    std::vector<std::string> names;
    for (const CostArm& arm : arms) names.push_back(arm.name());
    return names;
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
    samples.reference = make_reference(scene, request, within(control, 0.0, reference_share));
    samples.key = hash_of(samples.reference.key + text_of(request.baseline, info));
    if (request.earlier) {
        if (request.earlier->key != samples.key) throw other_measurement();
        samples = std::move(*request.earlier);
    }
    const double mean = samples.reference.image_mean();
    // On a GPU the kernels of twenty arms take longer than many a time for measuring.
    const double making_end = spent() + making_share * std::max(0.0, request.seconds - spent());
    for (const CostArm& arm : single_arms(scene, request, info, mean, report.skipped)) {
        if (control.stop.stop_requested() || spent() > making_end)
            experiment.skip_for_time(arm, "no time was left to make its kernels");
        else
            (void)experiment.add(arm);
    }
    report.device = info.device;
    report.driver = info.driver;
    const double before = samples.seconds;
    const auto whole = [&] {
        samples.seconds = before + now() - start;
        return samples;
    };
    CostControl saving = control;
    if (control.save)
        saving.save = [&](const CostSamples&) {
            (void)whole();
            control.save(samples);
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

    const double left = request.seconds - spent();
    report.whole = experiment.measure(names_of(experiment.arms()), std::max(0.0, left * mix_begin), samples,
        within(saving, reference_share, mix_begin));
    take(analyse_cost(experiment.arms(), samples));
    if (report.figures.empty())
        throw StoppedError(fmt::format(
            "stopped before the baseline had {} replicates; a smaller --size has them sooner", fewest_replicates));
    tell();
    const CostArm mix = mixed(report.figures, knob_settings(scene, request.baseline, info, mean), request);
    if (!mix.setting.empty() && !control.stop.stop_requested() && experiment.add(mix)) {
        std::vector<std::string> names{"baseline", mix.name()};
        for (const std::size_t best : best_settings(report.figures)) names.push_back(report.figures[best].arm.name());
        const double rest = std::max(0.5 * mix_share * request.seconds, confirmation_begin * request.seconds - spent());
        report.whole =
            experiment.measure(names, rest, samples, within(saving, mix_begin, confirmation_begin)) && report.whole;
        take(analyse_cost(experiment.arms(), samples));
        tell();
    }
    if (const std::vector<std::string> names = arms_to_confirm(report.figures); !names.empty()) {
        CostSamples anew = trials_to_confirm(names, samples);
        CostControl unsaved = control;  // it is of use to no later measurement
        unsaved.save = {};
        const double rest = std::max(0.5 * confirmation_share * request.seconds, request.seconds - spent());
        report.whole = experiment.measure(names, rest, anew, within(unsaved, confirmation_begin, 1.0)) && report.whole;
        report.confirmations = confirm(report.figures, experiment.arms(), anew);
    }
    report.skipped.insert(report.skipped.end(), experiment.skipped().begin(), experiment.skipped().end());
    report.seconds = whole().seconds;
    if (control.save) control.save(samples);
    return report;
}

}  // namespace tandem
