#include "common/cost/run_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <sstream>
#include <utility>

#include "common/cost/reference.h"
#include "common/cost/schedule.h"
#include "common/deadline.h"
#include "common/error.h"
#include "common/text.h"

namespace tandem {

namespace {

// Shares of the time: the reference, and of what is left then the short stage of all arms, that of each mix of knobs,
// and that of all mixes.
constexpr double reference_share = 0.3, short_share = 0.35, mix_share = 0.08, most_mix_share = 0.24;
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
    mix.setting += (mix.setting.empty() ? "" : " + ") + arm.name();
    mix.options = with_options(mix.options, arm.options);
}

// Chosen effects are those that the baseline needs, and others. A setting may need more (as `tandem render` has it).
void add_needed_effects(const Scene& scene, RenderSettings& settings) {
    if (settings.effects) settings.effects = settings.effects->united(needed_effects(scene, settings));
}

// What is worth measuring together (mixed_settings).
std::vector<CostArm> mixes(const Scene& scene, const std::vector<ArmFigures>& figures,
    const std::vector<KnobSetting>& knobs, const CostRequest& request) {
    std::vector<CostArm> all;
    for (const std::vector<std::size_t>& together : mixed_settings(figures)) {
        CostArm mix{"mix", "", "", request.baseline};
        for (const std::size_t one : together) add_to(mix, figures[one].arm, knobs);
        add_needed_effects(scene, mix.settings.render);
        mix.keeps_estimate = keeps_estimate(scene, request.baseline, mix.settings);
        all.push_back(std::move(mix));
    }
    return all;
}

std::vector<std::string> names_of(std::span<const CostArm> arms) {
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
                    figures.points.back().samples, least_alike),
                true});
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
        CostArm arm{one.knob, one.setting, one.options, request.baseline};
        one.apply(arm.settings);
        add_needed_effects(scene, arm.settings.render);
        arm.keeps_estimate = keeps_estimate(scene, request.baseline, arm.settings);
        arms.push_back(std::move(arm));
    }
    return arms;
}

namespace {

// One run of `tandem cost`. Its stages are called in the order of their declaration.
class CostRun {
public:
    CostRun(const Scene& scene, CostRequest request, const CostControl& control)
        : scene_(scene),
          request_(std::move(request)),
          control_(control),
          start_(now_by(control)),
          experiment_(scene, request_.make, request_.seed, request_.threads) {
        report_.scene_file = request_.scene_file;
        report_.given = request_.given;
        report_.scene = scene.name;
        report_.backend = request_.backend;
        report_.reference_backend = request_.reference_backend;
        report_.width = request_.baseline.render.width;
        report_.height = request_.baseline.render.height;
    }

    void add_baseline();
    void render_reference();
    void add_arms();
    void measure_short_stage();  // all arms
    void measure_mixes();        // the best settings together
    void measure_errors();       // the stages of the schedule
    [[nodiscard]] CostReport conclude();

private:
    [[nodiscard]] double spent() const { return now_by(control_) - start_; }
    [[nodiscard]] double left() const { return std::max(0.0, scheduled_share * request_.seconds - spent()); }
    [[nodiscard]] bool stopped() const { return control_.stop.stop_requested(); }
    // The samples, with the seconds that they took.
    CostSamples& whole() {
        samples_.seconds = seconds_before_ + spent();
        return samples_;
    }
    [[nodiscard]] CostControl saving(double from, double to);
    void take_figures();

    const Scene& scene_;
    CostRequest request_;
    const CostControl& control_;
    double start_;
    CostExperiment experiment_;
    CostReport report_;
    RendererInfo info_;
    CostSamples samples_;
    KnownFigures known_;           // of all stages
    double mean_ = 0.0;            // of the reference image
    double seconds_before_ = 0.0;  // of the measurement that is continued
    double may_save_ = 0.0;        // many images are saved: no more often than it is worth
};

void CostRun::add_baseline() {
    const CostArm baseline{
        "baseline", "", "", request_.baseline, keeps_estimate(scene_, request_.baseline, request_.baseline)};
    if (experiment_.add({&baseline, 1}, [] { return false; }) == 0)
        throw UnsupportedError(experiment_.skipped().back().reason);  // nothing to hold the others against
    info_ = experiment_.info();
    check_knobs(knob_settings(scene_, request_.baseline, info_, 0.0), request_.knobs);
}

// Then takes the samples of a measurement that is continued.
void CostRun::render_reference() {
    samples_.reference =
        long_reference(scene_, request_, reference_share * request_.seconds, within(control_, 0.0, reference_share));
    // Arms that are new to the samples would have no part in the errors that others have reached.
    const std::set<std::string> knobs(request_.knobs.begin(), request_.knobs.end());
    samples_.key = hash_of(samples_.reference.key + request_.scene_bytes + request_.program +
                           text_of(request_.baseline, info_) + fmt::format(" knobs {}", fmt::join(knobs, " ")));
    if (request_.earlier) {
        if (request_.earlier->key != samples_.key) throw other_measurement();
        request_.earlier->reference = std::move(samples_.reference);  // may have gone on
        samples_ = std::move(*request_.earlier);
    }
    samples_.width = report_.width;
    mean_ = samples_.reference.image_mean();
    seconds_before_ = samples_.seconds;
}

void CostRun::add_arms() {
    // On a GPU the kernels of twenty arms take longer than many a time for measuring.
    const double making_end = spent() + making_share * std::max(0.0, request_.seconds - spent());
    (void)experiment_.add(single_arms(scene_, request_, info_, mean_, report_.skipped),
        [&] { return stopped() || spent() > making_end; });
    experiment_.time_hierarchies(std::max(0.0, making_end - spent()), control_);
    report_.device = info_.device;
    report_.driver = info_.driver;
}

// What is said on the way, as a share of the whole; and the samples are saved now and then.
CostControl CostRun::saving(double from, double to) {
    CostControl inner = within(control_, from, to);
    if (control_.save)
        inner.save = [this](const CostSamples&) {
            if (spent() < may_save_) return;
            const double begin = spent();
            control_.save(whole());
            may_save_ = spent() + (spent() - begin) / saving_share;
        };
    return inner;
}

// Figures of all samples so far.
void CostRun::take_figures() {
    report_.figures = analyse_cost(experiment_.arms(), samples_, {}, known_);
    report_.reference = samples_.reference;
    report_.seconds = whole().seconds;
    if (report_.figures.empty() && control_.save) control_.save(whole());
    if (report_.figures.empty())
        throw StoppedError(fmt::format(
            "stopped before the baseline had {} replicates; a smaller --size has them sooner", fewest_replicates));
    if (!request_.keep) return;
    CostReport now_known = report_;
    std::ranges::copy(experiment_.skipped(), std::back_inserter(now_known.skipped));
    now_known.whole = false;
    request_.keep(now_known);
}

void CostRun::measure_short_stage() {
    const double shortest = left() * short_share;
    report_.whole = experiment_.measure(names_of(experiment_.arms()), shortest, samples_, saving(reference_share, 0.5));
    take_figures();
}

void CostRun::measure_mixes() {
    // What is mixed follows from the short stage, so that a continued measurement mixes the same unless it has grown.
    const std::vector<CostArm> mixed =
        mixes(scene_, analyse_cost(experiment_.arms(), samples_, {short_stage, short_stage + 1}),
            knob_settings(scene_, request_.baseline, info_, mean_), request_);
    if (stopped() || mixed.empty()) return;
    const std::size_t added = experiment_.add(mixed, [this] { return stopped() || left() <= 0.0; });
    if (stopped() || added == 0) return;
    const std::vector<std::string> names = names_of(std::span(experiment_.arms()).last(added));
    const double rest = left() * std::min(mix_share * static_cast<double>(added), most_mix_share);
    report_.whole = experiment_.measure(names, rest, samples_, saving(0.5, 0.55)) && report_.whole;
    take_figures();
}

void CostRun::measure_errors() {
    const double later = spent();
    while (!stopped()) {
        const std::optional<CostStage> stage = next_stage(report_.figures, samples_, left());
        if (!stage) break;
        const double done = (spent() - later) / std::max(1e-9, request_.seconds - later);
        if (!experiment_.extend(*stage, left(), samples_, saving(0.55 + 0.45 * std::min(1.0, done), 1.0))) break;
        take_figures();
    }
}

CostReport CostRun::conclude() {
    report_.whole = report_.whole && !stopped();
    if (control_.save) control_.save(whole());
    report_.confirmations = confirm(experiment_.arms(), samples_);
    leave_out_what_did_not_adapt(report_);
    report_.skipped.insert(report_.skipped.end(), experiment_.skipped().begin(), experiment_.skipped().end());
    report_.seconds = whole().seconds;
    return std::move(report_);
}

}  // namespace

CostReport run_cost(const Scene& scene, CostRequest request, const CostControl& control) {
    CostRun run(scene, std::move(request), control);
    run.add_baseline();
    run.render_reference();
    run.add_arms();
    run.measure_short_stage();
    run.measure_mixes();
    run.measure_errors();
    return run.conclude();
}

}  // namespace tandem
