#include "common/validation/verify/scene_verdict.h"

#include <algorithm>

#include "common/statistics/batch_tests.h"

namespace tandem {

namespace {

std::vector<std::vector<double>> tile_means(const SampledImage& image) {
    std::vector<std::vector<double>> means;
    for (const Batch& batch : image.batches) means.push_back(batch.tiles.means);
    return means;
}

// The votes of the closed form and of the oracle, in the order in which they count.
void add_votes(SceneVerdict& verdict) {
    const Judgement& judgement = verdict.judgement;
    verdict.outvoted = outvoted_by_closed_form(judgement);
    if (verdict.outvoted != Outvoted::nobody) {
        const std::string vote = vote_of("the closed form " + verdict.closed_form.form->formula, verdict.outvoted,
            verdict.reference_name, verdict.candidate_name, off_by(judgement.level(closed_form_reference_level)),
            off_by(judgement.level(closed_form_candidate_level)));
        if (sides_differ(verdict))
            verdict.sentence += "; " + vote;
        else
            verdict.sentence = verdict.reference_name + " and " + verdict.candidate_name +
                               " show no difference, but are not both right: " + vote;
    }
    if (!verdict.oracle) return;
    verdict.sentence += "; " + verdict.oracle->text;
    if (verdict.outvoted == Outvoted::nobody) verdict.outvoted = verdict.oracle->outvoted;
}

// What the closed form alone can tell: the sides miss it alike.
void suspect_features(SceneVerdict& verdict, std::span<const SceneFeature> met) {
    if (!misses_on_both_sides(verdict)) return;
    verdict.suspects = suspects_of_miss({.features = verdict.features,
        .met = met,
        .tried = verdict.missed_form ? &*verdict.missed_form : nullptr,
        .film = film_misses(*verdict.closed_form.form, verdict.candidate)});
}

}  // namespace

bool misses_on_both_sides(const SceneVerdict& verdict) {
    return verdict.closed_form.form && !verdict.looks.empty() && !sides_differ(verdict) &&
           outvoted_by_closed_form(verdict.judgement) == Outvoted::both;
}

bool sides_differ(const SceneVerdict& verdict) {
    const Judgement& j = verdict.judgement;
    const bool level = std::ranges::any_of(
        j.levels, [](const LevelResult& l) { return l.significant && !l.name.starts_with("closed form"); });
    return level || j.fixed.mismatches > 0 || verdict.reference.invalid > 0 || verdict.candidate.invalid > 0;
}

Look look_of(const Judgement& judgement, std::uint64_t samples, const LookShare& share, double seconds) {
    Look look;
    look.samples = samples;
    look.share = share;
    look.verdict = judgement.verdict;
    for (const LevelResult& level : judgement.levels)
        if (level.threshold > 0.0) look.least_p = std::min(look.least_p, level.p);
    look.image_bound = widest(judgement.level("image")).bound();
    look.tile_bound = widest(judgement.level("tiles 16x16")).bound();
    look.seconds = seconds;
    return look;
}

bool compare_misses(std::span<SceneVerdict> verdicts) {
    std::vector<SceneFeature> met;
    for (const SceneVerdict& verdict : verdicts)
        if (verdict.closed_form.form && verdict.verdict == Verdict::agree)
            met.insert(met.end(), verdict.features.begin(), verdict.features.end());
    if (met.empty()) return false;
    for (SceneVerdict& verdict : verdicts)
        if (!verdict.misreading) suspect_features(verdict, met);
    return std::ranges::any_of(verdicts, misses_on_both_sides);
}

namespace {

// Both sides render another scene than the file's, and may do so alike.
void judge_misreading(SceneVerdict& verdict) {
    if (!verdict.misreading) return;
    verdict.verdict = Verdict::disagree;
    if (verdict.outvoted == Outvoted::nobody) verdict.outvoted = Outvoted::both;
    verdict.sentence = "the scene is not what its file says: " + verdict.misreading->words + "; " + verdict.sentence;
    std::vector<Suspect> suspects = suspects_of(*verdict.misreading);
    for (Suspect& one : verdict.suspects)
        if (std::ranges::find(suspects, one.part, &Suspect::part) == suspects.end()) suspects.push_back(std::move(one));
    verdict.suspects = std::move(suspects);
    if (verdict.suspects.size() > most_suspects) verdict.suspects.resize(most_suspects);
}

void judge_sides(SceneVerdict& verdict) {
    if (verdict.looks.empty()) {
        verdict.sentence = verdict.reference_name + " and " + verdict.candidate_name +
                           " are undecided: stopped, or out of time, before there was enough to judge";
        return;
    }
    // What was seen before a look was due is no agreement.
    if (verdict.stopped && verdict.judgement.verdict == Verdict::agree) verdict.judgement.verdict = Verdict::undecided;
    verdict.verdict = verdict.judgement.verdict;
    verdict.sentence = sentence_of(verdict.judgement, verdict.criteria, verdict.reference_name, verdict.candidate_name);
    if (verdict.verdict != Verdict::disagree && verdict.judgement.coarse_arithmetic)
        verdict.sentence += "; but the arithmetic of " + verdict.candidate_name +
                            " is coarser than single precision: " + verdict.paired.arithmetic->text();
    if (verdict.reference.batches.size() >= 4 && verdict.candidate.batches.size() >= 4)
        verdict.permutation_p = permutation_p_value(tile_means(verdict.reference), tile_means(verdict.candidate),
            {.permutations = 999, .enough = 50, .seed = 1});
    if (verdict.verdict != Verdict::disagree) return;
    verdict.explanations = explain(verdict.reference, verdict.candidate, verdict.criteria);
    if (!verdict.explanations.empty()) verdict.sentence += "; " + told(verdict.explanations);
    add_votes(verdict);
    suspect_features(verdict, {});
}

}  // namespace

void conclude(SceneVerdict& verdict) {
    judge_sides(verdict);
    judge_misreading(verdict);
}

}  // namespace tandem
