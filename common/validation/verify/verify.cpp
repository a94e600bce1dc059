#include "common/validation/verify/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/error.h"
#include "common/render/foreign_job.h"
#include "common/scene/coincident_faces.h"
#include "common/statistics/multiple_tests.h"
#include "common/stopwatch.h"
#include "common/validation/verify/explain_fault.h"
#include "common/validation/verify/fault_place.h"
#include "common/validation/verify/foreign_side.h"
#include "common/validation/verify/sample_looks.h"
#include "common/validation/verify/schedule.h"

namespace tandem {

namespace {

constexpr double least_part_of_oracle = 0.05;  // of the budget, where the verdict took it all

// One renderer at work with one seed: an estimate that grows by whole batches.
struct Side {
    std::unique_ptr<RenderJob> job;
    Estimate estimate;
    std::vector<Batch> batches;
    double seconds = 0.0;
    std::optional<Estimate> first_block;  // kept from the measurement of speed
};

class Verification {
public:
    Verification(const Scene& scene, Renderer& reference, Renderer& candidate, const VerifyOptions& options)
        : scene_(scene), reference_renderer_(reference), candidate_renderer_(candidate), options_(options) {
        verdict_.scene = scene.name;
        verdict_.misreading = options.misreading;
        verdict_.settings = options.settings.value_or(verification_settings(scene));
        verdict_.criteria = options.criteria;
        verdict_.criteria.fixed_tolerance =
            std::max(options.criteria.fixed_tolerance, float_transport_tolerance(verdict_.settings.bounces));
        verdict_.closed_form = closed_form_of(scene, verdict_.settings);
        if (!options.equal_pixels && verdict_.closed_form.form)
            verdict_.closed_form = {std::nullopt, "it is a mean over the film, whose bins are not equally large"};
        verdict_.features = features_of(scene, verdict_.settings);
        verdict_.reference_seed = options.seed;
        verdict_.candidate_seed = options.seed + 1;
        verdict_.reference_info = reference.info();
        verdict_.candidate_info = candidate.info();
        verdict_.criteria.same_estimator =
            options.criteria.same_estimator &&
            same_estimator(verdict_.reference_info, verdict_.candidate_info, verdict_.settings.integrator);
        set_names();
    }

    SceneVerdict run();

private:
    void set_names();
    [[nodiscard]] Side side(Renderer& renderer, std::uint64_t seed) const;
    [[nodiscard]] std::optional<Estimate> render(Side& side, SampleRange range, const std::string& what);
    void take(Side& side, Estimate batch);
    [[nodiscard]] bool extend(Side& side, std::uint64_t samples, const std::string& what);
    void run_paired();
    [[nodiscard]] bool follow_numbers() const;
    [[nodiscard]] bool same_paths() const;
    void compare_short_paths();
    void look_at_single_samples();
    [[nodiscard]] bool add_pair(Side& a, Side& b, std::uint64_t batch);
    void judge_pairs();
    void resolve_pairs();
    [[nodiscard]] std::optional<double> measure_speed_of(Side& side);
    [[nodiscard]] bool measure_calls_of(Side& side, double& seconds_per_sample, double& seconds_a_call);
    void measure_speed();
    [[nodiscard]] static double seconds_to(const Side& side, std::uint64_t samples);
    void run_looks();
    void judge_look(const LookShare& share);
    [[nodiscard]] std::optional<Rectangle> tile_to_ask_about() const;
    void ask_the_oracle();
    void look_for_the_fault();
    [[nodiscard]] std::uint64_t max_samples() const {
        return options_.max_samples > 0 ? options_.max_samples : default_max_samples(verdict_.settings);
    }
    void report(double fraction, const std::string& text) const;

    const Scene& scene_;
    Renderer& reference_renderer_;
    Renderer& candidate_renderer_;
    const VerifyOptions& options_;
    Stopwatch watch_;
    SceneVerdict verdict_;
    Side reference_, candidate_;
    Schedule schedule_;
    std::optional<PairedDifferences> differences_;
    std::vector<double> paired_alarms_;  // shares of the paired looks
    double seconds_of_pair_ = 0.0;       // a batch of both sides
    double prepare_seconds_ = 0.0;       // of both sides
    double paired_reference_seconds_ = 0.0, paired_candidate_seconds_ = 0.0;
};

void Verification::set_names() {
    const auto name = [](const RendererInfo& info) {
        if (info.backend == "cpu") return std::string("CPU");
        if (info.backend == "vulkan") return std::string("Vulkan");
        return info.backend;
    };
    verdict_.reference_name = name(verdict_.reference_info);
    verdict_.candidate_name = name(verdict_.candidate_info);
    if (verdict_.reference_name != verdict_.candidate_name) return;
    verdict_.reference_name += " (reference)";
    verdict_.candidate_name += " (candidate)";
}

Side Verification::side(Renderer& renderer, std::uint64_t seed) const {
    RenderSettings settings = verdict_.settings;
    settings.seed = seed;
    Side result;
    result.job = renderer.prepare(scene_, settings);
    result.estimate = Estimate(settings.width, settings.height);
    return result;
}

void Verification::report(double fraction, const std::string& text) const {
    if (options_.progress) options_.progress(std::clamp(fraction, 0.0, 1.0), text);
}

// The samples of `range`, or nothing when stopped on the way: only whole batches count.
std::optional<Estimate> Verification::render(Side& side, SampleRange range, const std::string& what) {
    if (options_.stop.stop_requested()) return std::nullopt;
    if (side.first_block && range == SampleRange{0, samples_per_block}) return std::exchange(side.first_block, {});
    RenderControl control;
    control.stop = options_.stop;
    control.progress = [&](double) { report(watch_.seconds() / options_.budget_seconds, what); };
    RenderResult result = side.job->render(range, control);
    side.seconds += result.seconds;
    if (result.estimate.count() != range.count()) return std::nullopt;
    return std::move(result.estimate);
}

void Verification::take(Side& side, Estimate batch) {
    const TileGrid tiles(batch.width(), batch.height(), standard_tile_edge);
    side.batches.push_back(batch_of(batch, tiles));
    side.estimate.merge(std::move(batch));
}

bool Verification::extend(Side& side, std::uint64_t samples, const std::string& what) {
    for (std::uint64_t begin = side.estimate.count(); begin < samples; begin += schedule_.batch_samples) {
        std::optional<Estimate> batch = render(side, {begin, begin + schedule_.batch_samples}, what);
        if (!batch) return false;
        take(side, std::move(*batch));
    }
    return true;
}

// The same samples on both sides; false when stopped on the way.
bool Verification::add_pair(Side& a, Side& b, std::uint64_t batch) {
    const SampleRange range{batch * schedule_.batch_samples, (batch + 1) * schedule_.batch_samples};
    const Stopwatch watch;
    const double before_a = a.seconds, before_b = b.seconds;
    std::optional<Estimate> x = render(a, range, "reference, paired seeds");
    const std::optional<Estimate> y = x ? render(b, range, "candidate, paired seeds") : std::nullopt;
    if (!y) return false;
    differences_->add(*x, *y);
    candidate_.estimate.add_invalid(y->invalid());
    seconds_of_pair_ = watch.seconds();
    paired_candidate_seconds_ += b.seconds - before_b;
    if (&a == &reference_) {
        take(a, std::move(*x));
    } else {
        reference_.estimate.add_invalid(x->invalid());
        paired_reference_seconds_ += a.seconds - before_a;
    }
    return true;
}

void Verification::judge_pairs() {
    PairedResult result = differences_->result(verdict_.criteria, verdict_.criteria.doubt / 2.0);
    result.paths = std::move(verdict_.paired.paths);
    result.alone = std::move(verdict_.paired.alone);
    result.arithmetic = std::move(verdict_.paired.arithmetic);
    verdict_.paired = std::move(result);
}

// The reference's first batches once more by the candidate, with the reference's seed.
void Verification::run_paired() {
    if (schedule_.paired_batches < 2) return;
    Side paired = side(candidate_renderer_, verdict_.reference_seed);
    differences_.emplace(verdict_.settings.width, verdict_.settings.height, verdict_.criteria.fixed_tolerance);
    for (std::uint64_t k = 0; k < schedule_.paired_batches && !verdict_.stopped; ++k)
        verdict_.stopped = !add_pair(reference_, paired, k);
    judge_pairs();
    if (verdict_.stopped || !same_paths()) return;
    compare_short_paths();
    if (!verdict_.stopped) look_at_single_samples();
}

bool Verification::follow_numbers() const {
    return verdict_.reference_info.follows_numbers && verdict_.candidate_info.follows_numbers &&
           verdict_.settings.integrator != Integrator::bidirectional;
}

// Both follow MODEL.md section 3. Which of two faces at one place comes first is up to rounding, though (5.2), and the
// numbers of what follows with it.
bool Verification::same_paths() const { return follow_numbers() && !passed_faces_coincide(scene_); }

// The same random numbers at few bounces: the same samples.
void Verification::compare_short_paths() {
    std::vector<Estimate> estimates;
    for (Renderer* renderer : {&reference_renderer_, &candidate_renderer_}) {
        RenderSettings settings = verdict_.settings;
        settings.seed = verdict_.reference_seed;
        settings.bounces = std::min(settings.bounces, short_path_bounces);
        Side side{renderer->prepare(scene_, settings), {}, {}, 0.0, {}};
        std::optional<Estimate> block = render(side, {0, samples_per_block}, "short paths, paired seeds");
        if (!block) {
            verdict_.stopped = true;
            return;
        }
        estimates.push_back(std::move(*block));
    }
    verdict_.paired.paths = compare_paths(estimates[0], estimates[1], verdict_.criteria.fixed_tolerance);
}

void Verification::look_at_single_samples() {
    constexpr double part_of_budget = 0.1;
    RenderSettings settings = verdict_.settings;
    settings.seed = verdict_.reference_seed;
    SampleLooks looks = look_at_samples({.scene = scene_,
        .settings = settings,
        .reference = reference_renderer_,
        .candidate = candidate_renderer_,
        .other_precision = options_.other_precision,
        .budget_seconds = part_of_budget * options_.budget_seconds,
        .stop = options_.stop,
        .progress = [&](const std::string& text) { report(watch_.seconds() / options_.budget_seconds, text); }});
    verdict_.stopped = looks.stopped;
    if (!looks.left_out.empty())
        verdict_.notes.push_back(fmt::format(
            "not all looks at single samples ended in time: {}; give more --time", fmt::join(looks.left_out, "; ")));
    paired_reference_seconds_ += looks.reference_seconds;
    paired_candidate_seconds_ += looks.candidate_seconds;
    reference_.estimate.add_invalid(looks.invalid_reference);
    candidate_.estimate.add_invalid(looks.invalid_candidate);
    verdict_.paired.alone = std::move(looks.levels);
    verdict_.paired.arithmetic = std::move(looks.arithmetic);
}

// Spends what is left on pairs that resolve as much as declared, before an agreement. Their seed is another one, so
// that more of it than its low word is put to the test.
void Verification::resolve_pairs() {
    if (!differences_ || !follow_numbers()) return;
    std::optional<Side> a, b;
    std::uint64_t done = 0;  // batches of that seed
    for (std::size_t k = 0; k < schedule_.paired_looks.size(); ++k) {
        if (verdict_.judgement.verdict != Verdict::agree || pairs_resolve(verdict_.judgement, verdict_.criteria))
            return;
        const std::uint64_t batches = schedule_.paired_looks[k] - schedule_.paired_batches;
        const double seconds = seconds_of_pair_ * static_cast<double>(batches - done);
        if (watch_.seconds() + seconds > options_.budget_seconds) return;
        if (!a) a = side(reference_renderer_, high_seed(verdict_.reference_seed));
        if (!b) b = side(candidate_renderer_, high_seed(verdict_.reference_seed));
        for (; done < batches; ++done)
            if (!add_pair(*a, *b, done)) return;  // what was decided before stands
        judge_pairs();
        judge_look({paired_alarms_[k], verdict_.looks.back().share.doubt});
    }
}

void Verification::judge_look(const LookShare& share) {
    verdict_.reference = sampled_by(*reference_.job, reference_.estimate, reference_.batches);
    verdict_.candidate = sampled_by(*candidate_.job, candidate_.estimate, candidate_.batches);
    count_alike(verdict_.reference, verdict_.candidate);
    if (verdict_.reference.samples < 2 || verdict_.candidate.samples < 2) return;
    const std::optional<ClosedForm>& form = verdict_.closed_form.form;
    verdict_.judgement = judge(
        verdict_.reference, verdict_.candidate, &verdict_.paired, verdict_.criteria, share, form ? &*form : nullptr);
    const std::uint64_t samples = std::min(verdict_.reference.samples, verdict_.candidate.samples);
    verdict_.looks.push_back(look_of(verdict_.judgement, samples, share, watch_.seconds()));
    verdict_.looks.back().paired_samples = verdict_.paired.samples;
}

// Until a decision, the end of the schedule or of the budget, or a stop.
void Verification::run_looks() {
    const double scenes = static_cast<double>(std::max<std::size_t>(options_.scenes, 1));
    std::vector<std::uint64_t> looks = schedule_.looks;
    looks.insert(looks.end(), schedule_.spare_looks.begin(), schedule_.spare_looks.end());
    const std::size_t paired_looks = schedule_.paired_looks.size();
    const std::vector<double> alarms =
        alpha_spending(verdict_.criteria.false_alarm / scenes, looks.size() + paired_looks);
    paired_alarms_.assign(alarms.end() - static_cast<std::ptrdiff_t>(paired_looks), alarms.end());
    const std::vector<double> doubts = alpha_spending(verdict_.criteria.doubt / scenes, looks.size());
    for (std::size_t k = 0; k < looks.size(); ++k) {
        const std::uint64_t samples = looks[k];
        const LookShare share{alarms[k], doubts[k]};
        const std::string what = fmt::format("look {} of {}, {} samples", k + 1, looks.size(), samples);
        // A machine slower than the schedule knew, or a spare look: one that would end well past the budget is not
        // begun.
        if (k > 0 && watch_.seconds() + seconds_to(reference_, samples) + seconds_to(candidate_, samples) >
                         1.1 * options_.budget_seconds)
            return;
        const bool complete = extend(reference_, samples, what) && extend(candidate_, samples, what);
        if (!complete) {
            verdict_.stopped = true;
            if (verdict_.looks.empty()) judge_look(share);
            return;
        }
        judge_look(share);
        if (verdict_.judgement.verdict != Verdict::undecided) return;
    }
}

// Seconds a sample of every pixel, first of one block, which is used again where batches are single blocks. Calls cost
// time of their own. So eight times as many follow while that ended too soon to be timed.
std::optional<double> Verification::measure_speed_of(Side& side) {
    constexpr double least_seconds = 0.02;
    for (std::uint64_t samples = samples_per_block;; samples *= 8) {
        const Stopwatch watch;
        const double before = side.seconds;
        std::optional<Estimate> estimate = render(side, {0, samples}, "measuring speed");
        if (!estimate) return std::nullopt;
        if (samples == samples_per_block) side.first_block = std::move(estimate);
        const double wall = watch.seconds();
        const double seconds = side.seconds - before;
        if (wall >= least_seconds || 32 * 8 * samples > max_samples()) return seconds / static_cast<double>(samples);
    }
}

// Another program takes time to start, which more samples show apart from theirs. False: stopped.
bool Verification::measure_calls_of(Side& side, double& seconds_per_sample, double& seconds_a_call) {
    constexpr std::uint64_t samples = 4 * samples_per_block;
    if (dynamic_cast<const ForeignJob*>(side.job.get()) == nullptr || samples > max_samples()) return true;
    const double block = seconds_per_sample * samples_per_block;
    if (7.0 * block > options_.budget_seconds) return true;  // what is left is for judging
    const double before = side.seconds;
    if (!render(side, {0, samples}, "measuring speed")) return false;
    const double more = (side.seconds - before - block) / (samples - samples_per_block);
    seconds_per_sample = std::clamp(more, 1e-3 * seconds_per_sample, seconds_per_sample);
    seconds_a_call += block - seconds_per_sample * samples_per_block;
    return true;
}

void Verification::measure_speed() {
    ScheduleRequest request;
    std::optional<double> reference = measure_speed_of(reference_);
    std::optional<double> candidate = reference ? measure_speed_of(candidate_) : std::nullopt;
    const double reference_block = reference.value_or(0.0) * samples_per_block;
    const double candidate_block = candidate.value_or(0.0) * samples_per_block;
    verdict_.stopped = !candidate || !measure_calls_of(reference_, *reference, request.seconds_a_call) ||
                       !measure_calls_of(candidate_, *candidate, request.seconds_a_call);
    if (verdict_.stopped) return;
    request.seconds_per_sample_reference = *reference;
    request.seconds_per_sample_candidate = *candidate;
    request.budget_seconds = options_.budget_seconds - watch_.seconds();
    request.max_samples = max_samples();
    request.max_looks = options_.max_looks;
    request.paired = options_.paired;
    schedule_ = make_schedule(request);
    for (Side* side : {&reference_, &candidate_}) {
        side->seconds = 0.0;
        if (schedule_.batch_samples != samples_per_block) side->first_block.reset();
    }
    if (reference_.first_block) reference_.seconds = reference_block;
    if (candidate_.first_block) candidate_.seconds = candidate_block;
}

// The standard tile about what differs most surely.
std::optional<Rectangle> Verification::tile_to_ask_about() const {
    const std::optional<Rectangle> part = fired_region(verdict_.judgement);
    if (!part) return std::nullopt;
    const TileGrid tiles(verdict_.settings.width, verdict_.settings.height, standard_tile_edge);
    const std::size_t middle =
        std::size_t{(part->y0 + part->y1) / 2} * verdict_.settings.width + (part->x0 + part->x1) / 2;
    return tiles.rectangle(tiles.tile_of_pixel().at(middle));
}

void Verification::ask_the_oracle() {
    if (options_.oracle == nullptr || verdict_.looks.empty() || verdict_.judgement.verdict != Verdict::disagree) return;
    const RendererInfo info = options_.oracle->info();
    if (info.backend == verdict_.reference_info.backend || info.backend == verdict_.candidate_info.backend) {
        verdict_.oracle.emplace();
        verdict_.oracle->name = info.backend;
        verdict_.oracle->text = "the " + info.backend + " is one of the two, so it cannot be asked which is right";
        return;
    }
    const double samples = static_cast<double>(std::max<std::uint64_t>(reference_.estimate.count(), 1));
    RenderSettings settings = verdict_.settings;
    settings.seed = verdict_.reference_seed;
    const double left = options_.budget_seconds - watch_.seconds();
    verdict_.oracle = ask_oracle({.scene = scene_,
        .settings = settings,
        .reference = reference_renderer_,
        .candidate = candidate_renderer_,
        .oracle = *options_.oracle,
        .reference_name = verdict_.reference_name,
        .candidate_name = verdict_.candidate_name,
        .tile = tile_to_ask_about(),
        .both_miss_the_closed_form = outvoted_by_closed_form(verdict_.judgement) == Outvoted::both,
        .criteria = verdict_.criteria,
        .seconds_per_sample = (reference_.seconds + candidate_.seconds) / samples,
        .budget_seconds = std::max(left, least_part_of_oracle * options_.budget_seconds),
        .max_samples = max_samples(),
        .stop = options_.stop,
        .progress = [&](const std::string& text) { report(watch_.seconds() / options_.budget_seconds, text); }});
}

void Verification::look_for_the_fault() {
    if (verdict_.looks.empty()) return;
    verdict_.worst = worst_pixel_of(verdict_.reference, verdict_.candidate, verdict_.judgement.pixel_p);
    verdict_.worst->seed = verdict_.reference_seed;
    const bool disagree = verdict_.judgement.verdict == Verdict::disagree;
    if (!disagree || !options_.explain || options_.stop.stop_requested()) return;
    const double samples = static_cast<double>(std::max<std::uint64_t>(reference_.estimate.count(), 1));
    explain_fault(verdict_,
        {.scene = scene_,
            .reference = reference_renderer_,
            .candidate = candidate_renderer_,
            .options = options_,
            .follow_numbers = follow_numbers(),
            .same_samples = same_paths(),
            .prepare_seconds = prepare_seconds_,
            .seconds_per_sample = (reference_.seconds + candidate_.seconds) / samples,
            .reference_seconds_per_sample = reference_.seconds / samples,
            .watch = watch_,
            .report = [&](const std::string& text) { report(watch_.seconds() / options_.budget_seconds, text); }});
}

double Verification::seconds_to(const Side& side, std::uint64_t samples) {
    const double done = static_cast<double>(side.estimate.count());
    return done > 0.0 ? side.seconds / done * (static_cast<double>(samples) - done) : 0.0;
}

SceneVerdict Verification::run() {
    report(0.0, "preparing");
    reference_ = side(reference_renderer_, verdict_.reference_seed);
    candidate_ = side(candidate_renderer_, verdict_.candidate_seed);
    prepare_seconds_ = watch_.seconds();
    measure_speed();
    if (!verdict_.stopped) run_paired();
    if (!verdict_.stopped) run_looks();
    if (!verdict_.stopped) resolve_pairs();
    look_for_the_fault();
    if (!verdict_.stopped) ask_the_oracle();
    verdict_.reference_seconds = reference_.seconds + paired_reference_seconds_;
    verdict_.candidate_seconds = candidate_.seconds + paired_candidate_seconds_;
    verdict_.seconds = watch_.seconds();
    conclude(verdict_);
    report(1.0, name_of(verdict_.verdict));
    return std::move(verdict_);
}

}  // namespace

RenderSettings verification_settings(const Scene& scene, std::uint32_t longer_side) {
    const RenderSettings settings = default_settings(scene);
    return with_longer_side(settings, std::min(longer_side, std::max(settings.width, settings.height)));
}

std::uint64_t default_max_samples(const RenderSettings& settings) {
    constexpr std::uint64_t samples = 1u << 20, pixels = 128 * 128;
    return samples * std::max<std::uint64_t>(1, pixels / (std::uint64_t{settings.width} * settings.height));
}

SceneVerdict verify_scene(const Scene& scene, Renderer& reference, Renderer& candidate, const VerifyOptions& options) {
    return Verification(scene, reference, candidate, options).run();
}

}  // namespace tandem
