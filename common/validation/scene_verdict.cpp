#include "common/validation/scene_verdict.h"

#include <algorithm>

namespace tandem {

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

void conclude(SceneVerdict& verdict) {
    if (verdict.looks.empty()) {
        verdict.sentence = verdict.reference_name + " and " + verdict.candidate_name +
                           " are undecided: stopped before there was enough to judge";
        return;
    }
    // What was seen before a look was due is no agreement.
    if (verdict.stopped && verdict.judgement.verdict == Verdict::agree) verdict.judgement.verdict = Verdict::undecided;
    verdict.verdict = verdict.judgement.verdict;
    verdict.sentence = sentence_of(verdict.judgement, verdict.criteria, verdict.reference_name, verdict.candidate_name);
    if (verdict.verdict != Verdict::disagree) return;
    verdict.registration = register_images(verdict.reference, verdict.candidate);
    if (!verdict.registration->text.empty()) verdict.sentence += "; it looks like " + verdict.registration->text;
}

}  // namespace tandem
