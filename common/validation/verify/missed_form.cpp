#include "common/validation/verify/missed_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/error.h"
#include "common/scene/sound_scene.h"
#include "common/text.h"
#include "common/validation/explanation/scene_features.h"
#include "common/validation/verdict/greatest_sample.h"
#include "common/validation/verify/fault_place.h"
#include "common/validation/verify/foreign_side.h"

namespace tandem {

namespace {

constexpr std::uint64_t seed_of_miss = 4;  // beside those of the verdict and of the oracle's tile
constexpr double false_miss = 1e-4;        // a look's chance
constexpr double miss_deviations = 3.0;
constexpr double part_for_whole_scene = 0.25;  // for the scene as it is
// The form counts as met if at most this part of the miss remains. A change unrelated to the fault moves the mean too,
// and may bring it near the form by chance. The smaller this part is, the rarer that is.
constexpr double part_of_miss = 0.1;

struct Change {
    FormTrial trial;
    std::function<void(EditedScene&)> make;
};

void move_limit(EditedScene& edited, int by) {
    edited.settings.bounces = static_cast<std::uint32_t>(static_cast<std::int64_t>(edited.settings.bounces) + by);
}

std::vector<Change> changes_of(const Scene& scene, const RenderSettings& settings) {
    std::vector<Change> changes;
    const auto add = [&](Subsystem part, std::string change, bool whole, std::function<void(EditedScene&)> make) {
        changes.push_back({{part, std::move(change), whole, FormOutcome::unknown, {}}, std::move(make)});
    };
    std::vector<SceneFeature> features = removable_features(scene, settings);
    // What takes out least comes first: without sampled lights there are no weights either.
    std::ranges::stable_partition(
        features, [](const SceneFeature& feature) { return feature.part == Subsystem::mis_weights; });
    for (const SceneFeature& feature : features) {
        // What `whitted` and `bidirectional` show without sampled lights is another mean.
        const bool samples_lights = feature.part == Subsystem::light_sampling;
        if (!feature.keeps_mean || (samples_lights && settings.integrator != Integrator::next_event)) continue;
        add(feature.part, fmt::format("without {}", feature.words), feature.whole, feature.take_out);
    }
    add(Subsystem::roulette, "with one bounce more", false, [](EditedScene& e) { move_limit(e, 1); });
    if (settings.bounces > 0)
        add(Subsystem::roulette, "with one bounce fewer", false, [](EditedScene& e) { move_limit(e, -1); });
    return changes;
}

class MissExperiments {
public:
    explicit MissExperiments(const MissQuestion& question) : question_(question), start_(question.now()) {
        settings_ = question.settings;
        settings_.seed += seed_of_miss;
    }

    MissedForm run() {
        result_.data = unsound_part(question_.scene);
        if (question_.expected_seconds > part_for_whole_scene * question_.budget_seconds) {
            result_.left_out = "no time was left";
            return std::move(result_);
        }
        result_.film = film_against_paths(question_.renderer, question_.scene, settings_, question_.stop);
        if (!result_.film.empty())
            result_.left_out = "the film is at fault";
        else if (look_at_whole())
            try_changes();
        result_.seconds = since_start();
        return std::move(result_);
    }

private:
    [[nodiscard]] double since_start() const { return question_.now() - start_; }

    // Twice as many samples as before until the outcome is known.
    template <typename Judge>
    [[nodiscard]] FormOutcome look_at(const EditedScene& edited, double until, FormLook& look, const Judge& judge) {
        const double begun = since_start();
        const std::unique_ptr<RenderJob> job = question_.renderer.prepare(edited.scene, edited.settings);
        ClosedForm form = question_.form;
        form.greatest = greatest_sample(edited.scene, edited.settings);
        RenderControl control;
        control.stop = question_.stop;
        Estimate estimate(edited.settings.width, edited.settings.height);
        for (std::uint64_t next = 2 * samples_per_block;; next *= 2) {
            const double before = since_start();
            const std::uint64_t done = estimate.count();
            RenderResult more = job->render({done, next}, control);
            if (more.estimate.count() != next - done) return FormOutcome::unknown;
            estimate.merge(std::move(more.estimate));
            const LevelResult level = compare_closed_form("closed form", form, sampled_by(*job, estimate, {}),
                question_.criteria, 0.5 * question_.criteria.doubt);
            look = look_of(level, next);
            const FormOutcome outcome = judge(level);
            const double now = since_start();
            if (next == 2 * samples_per_block) first_look_seconds_ = now - begun;
            if (outcome != FormOutcome::unknown || 2 * next > question_.most_samples ||
                now + 2.0 * (now - before) > until)
                return outcome;
        }
    }

    // The channel that is off most, beyond rounding.
    [[nodiscard]] FormLook look_of(const LevelResult& level, std::uint64_t samples) const {
        const RegionComparison& most = *std::ranges::max_element(
            level.regions, {}, [](const RegionComparison& region) { return std::abs(region.relative); });
        return {samples, most.relative, most.relative_error};
    }

    // How far the channel that is off most is from the form at most.
    [[nodiscard]] double bound(const LevelResult& level) const {
        double most = 0.0;
        for (const RegionComparison& region : level.regions)
            most = std::max(most, std::abs(region.relative) + miss_deviations * region.relative_error);
        return std::max(0.0, most - question_.form.rounding);
    }

    [[nodiscard]] bool look_at_whole() {
        const auto shows = [&](const LevelResult& level) {
            const FormLook look = look_of(level, 0);
            const bool sharp = miss_deviations * look.error <= part_of_miss * std::abs(look.relative);
            return level.p < false_miss && sharp ? FormOutcome::missed : FormOutcome::unknown;
        };
        const FormOutcome outcome = look_at(
            {question_.scene, settings_}, part_for_whole_scene * question_.budget_seconds, result_.whole, shows);
        const FormLook& whole = result_.whole;
        miss_ = std::abs(whole.relative) - miss_deviations * whole.error;
        if (outcome == FormOutcome::missed || miss_ > 0.0) return true;
        result_.left_out = question_.stop.stop_requested()
                               ? "stopped"
                               : fmt::format("{} samples do not show the miss again", whole.samples);
        return false;
    }

    [[nodiscard]] FormOutcome outcome_of(const LevelResult& level) const {
        if (level.p < false_miss) return FormOutcome::missed;
        return bound(level) <= part_of_miss * miss_ ? FormOutcome::met : FormOutcome::unknown;
    }

    void try_changes() {
        std::vector<Change> changes = changes_of(question_.scene, settings_);
        for (std::size_t i = 0; i < changes.size(); ++i) {
            FormTrial& trial = changes[i].trial;
            const double now = since_start(), left = question_.budget_seconds - now;
            if (left < first_look_seconds_ || question_.stop.stop_requested()) {
                result_.left_out = "no time was left for the rest";
            } else {
                if (question_.progress) question_.progress(fmt::format("closed form {}", trial.change));
                EditedScene edited{question_.scene, settings_};
                changes[i].make(edited);
                try {
                    const double until = now + left / static_cast<double>(changes.size() - i);
                    trial.outcome =
                        look_at(edited, until, trial.look, [&](const LevelResult& one) { return outcome_of(one); });
                } catch (const UnsupportedError&) {  // the side cannot do with it
                }
            }
            result_.trials.push_back(std::move(trial));
        }
    }

    const MissQuestion& question_;
    double start_;
    RenderSettings settings_;
    double first_look_seconds_ = 0.0;
    double miss_ = 0.0;  // relative, at least
    MissedForm result_;
};

}  // namespace

MissedForm look_into_miss(const MissQuestion& question) { return MissExperiments(question).run(); }

std::vector<Subsystem> cleared_parts(const MissedForm& missed) {
    std::vector<Subsystem> parts;
    for (const FormTrial& trial : missed.trials) {
        const bool all = std::ranges::all_of(missed.trials,
            [&](const FormTrial& one) { return one.part != trial.part || one.outcome == FormOutcome::missed; });
        if (trial.whole && all && std::ranges::find(parts, trial.part) == parts.end()) parts.push_back(trial.part);
    }
    return parts;
}

std::string told(const MissedForm& missed, const FormTrial& met) {
    return fmt::format("the closed form is met {}: off by {} ± {}, else by {}", met.change,
        signed_percent(met.look.relative), percent(2.0 * met.look.error), signed_percent(missed.whole.relative));
}

std::string told(const MissedForm& missed) {
    if (missed.trials.empty()) return fmt::format("no change was tried on the closed form: {}", missed.left_out);
    std::string text =
        fmt::format("{} changes tried on the closed form in {:.1f} s", missed.trials.size(), missed.seconds);
    for (const FormOutcome outcome : {FormOutcome::met, FormOutcome::missed, FormOutcome::unknown}) {
        std::vector<std::string_view> changes;
        for (const FormTrial& trial : missed.trials)
            if (trial.outcome == outcome) changes.push_back(trial.change);
        const std::string_view name = outcome == FormOutcome::unknown
                                          ? std::string_view("not known")
                                          : form_outcome_names.at(static_cast<std::size_t>(outcome));
        if (!changes.empty()) text += fmt::format("; {}: {}", name, fmt::join(changes, ", "));
    }
    if (!missed.left_out.empty()) text += "; " + missed.left_out;
    return text;
}

}  // namespace tandem
