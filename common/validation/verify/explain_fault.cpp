#include "common/validation/verify/explain_fault.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "common/render/effects.h"
#include "common/validation/verify/data_trial.h"
#include "common/validation/verify/elimination.h"
#include "common/validation/verify/fault_place.h"
#include "common/validation/verify/missed_form.h"
#include "common/validation/verify/path_partings.h"
#include "common/validation/verify/precision_trial.h"
#include "common/validation/verify/retraced_paths.h"

namespace tandem {

namespace {

constexpr double part_beside_oracle = 0.5;  // of the time that is left; the oracle has the rest

class Fault {
public:
    Fault(SceneVerdict& verdict, const FaultRequest& request)
        : verdict_(verdict), request_(request), settings_(verdict.settings) {
        settings_.seed = verdict.reference_seed;
    }

    void explain() {
        find_place();
        if (misses_on_both_sides(verdict_)) look_into_the_miss();
        if (!sides_differ(verdict_)) return;
        compare_with_planted_bugs();
        trace_again();
        suspect();
        change_data();
        take_features_out();
        change_precision();
        suspect();
    }

private:
    void find_place() {
        const VerifyOptions& options = request_.options;
        const bool in_time = request_.watch.seconds() < options.budget_seconds;  // each kernel is built anew
        verdict_.fault_place =
            find_fault(*verdict_.worst, {.scene = request_.scene,
                                            .settings = settings_,
                                            .reference = request_.reference,
                                            .candidate = request_.candidate,
                                            .reference_name = verdict_.reference_name,
                                            .candidate_name = verdict_.candidate_name,
                                            .region = fired_region(verdict_.judgement),
                                            .differ = sides_differ(verdict_),
                                            .kernels = in_time ? options.kernels : std::vector<std::string>(),
                                            .with_kernel = options.with_kernel,
                                            .stop = options.stop});
    }

    void compare_with_planted_bugs() {
        verdict_.partings = partings_of_paths({.scene = request_.scene,
            .settings = settings_,
            .reference = request_.reference,
            .candidate = request_.candidate,
            .region = fired_region(verdict_.judgement),
            .stop = request_.options.stop});
        if (!verdict_.partings) return;  // no path can be traced, or no time was left for many
        const EffectSet effects = needed_effects(request_.scene, settings_);
        verdict_.signature = signature_of(verdict_.judgement, verdict_.paired, *verdict_.partings, effects);
        verdict_.likeness = likeness_of(*verdict_.signature);
    }

    [[nodiscard]] DifferenceEvidence evidence() const {
        static const Signature no_signature{};
        static const PathPartings no_partings{};
        return {.judgement = verdict_.judgement,
            .signature = verdict_.signature ? *verdict_.signature : no_signature,
            .partings = verdict_.partings ? *verdict_.partings : no_partings,
            .place = verdict_.fault_place,
            .elimination = verdict_.elimination ? &*verdict_.elimination : nullptr,
            .precision_trial = verdict_.precision_trial ? &*verdict_.precision_trial : nullptr,
            .data_trial = verdict_.data_trial ? &*verdict_.data_trial : nullptr};
    }
    void suspect() {
        constexpr std::span<const PlantedSignature> no_patterns;
        RankedSuspects ranked =
            suspects_of_difference(evidence(), {.patterns = verdict_.signature ? planted_signatures() : no_patterns});
        verdict_.suspects = std::move(ranked.suspects);
        verdict_.ranking = ranked.ranking;
    }

    // What is left of the time, beside the oracle's part.
    [[nodiscard]] double budget() const {
        const VerifyOptions& options = request_.options;
        return (options.oracle != nullptr ? part_beside_oracle : 1.0) *
               (options.budget_seconds - request_.watch.seconds());
    }

    void look_into_the_miss() {
        constexpr std::uint64_t longer = 16;  // as many samples as the verdict took
        verdict_.missed_form = look_into_miss({.scene = request_.scene,
            .settings = settings_,
            .renderer = request_.reference,
            .form = *verdict_.closed_form.form,
            .criteria = verdict_.criteria,
            .most_samples = longer * verdict_.reference.samples,
            .budget_seconds = budget(),
            .expected_seconds =
                request_.prepare_seconds + 2.0 * samples_per_block * request_.reference_seconds_per_sample,
            .stop = request_.options.stop,
            .progress = request_.report});
    }

    void take_features_out() {
        if (!request_.follow_numbers) {
            verdict_.elimination.emplace().left_out = "the sides do not draw the same random numbers";
            return;
        }
        const VerifyOptions& options = request_.options;
        constexpr double samples = 16.0;  // of the first scene
        std::vector<double> suspicion;
        if (verdict_.signature) {
            const Scores scores = scores_of(*verdict_.signature, planted_signatures());
            suspicion.assign(scores.begin(), scores.end());
        }
        verdict_.elimination = eliminate({.scene = request_.scene,
            .settings = settings_,
            .reference = request_.reference,
            .candidate = request_.candidate,
            .other_precision = options.other_precision,
            .criteria = verdict_.criteria,
            .same_samples = request_.same_samples,
            .suspicion = std::move(suspicion),
            .budget_seconds = budget(),
            .expected_seconds = request_.prepare_seconds + samples * request_.seconds_per_sample,
            .stop = options.stop,
            .progress = request_.report});
    }

    void trace_again() {
        if (!verdict_.partings || verdict_.partings->parted == 0 || !in_time(0.0)) return;
        paths_.emplace(RetracedSides{
            request_.scene, settings_, request_.reference, request_.candidate, verdict_.partings->pixels});
    }

    // Whether a side may be prepared once more, and so much of the time is left then.
    [[nodiscard]] bool in_time(double left) const {
        return budget() > left + 2.0 * request_.prepare_seconds && !request_.options.stop.stop_requested();
    }

    void change_data() {
        if (!paths_) return;
        constexpr double for_features = 0.7;
        const double left = for_features * budget();
        verdict_.data_trial = try_data_faults({.paths = *paths_,
            .scene = request_.scene,
            .settings = settings_,
            .reference = request_.reference,
            .candidate = request_.candidate,
            .in_time = [&] { return in_time(left); }});
    }

    void change_precision() {
        if (!paths_) return;
        verdict_.precision_trial = try_precisions({.paths = *paths_,
            .scene = request_.scene,
            .settings = settings_,
            .in_precision = request_.options.in_precision,
            .in_time = [&] { return in_time(0.0); }});
    }

    SceneVerdict& verdict_;
    const FaultRequest& request_;
    RenderSettings settings_;
    std::optional<RetracedPaths> paths_;  // where some part
};

}  // namespace

void explain_fault(SceneVerdict& verdict, const FaultRequest& request) {
    try {
        Fault(verdict, request).explain();
    } catch (const Error&) {  // a device was lost; any sample will do
    }
}

}  // namespace tandem
