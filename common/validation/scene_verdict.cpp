#include "common/validation/scene_verdict.h"

#include <algorithm>

#include "common/statistics/batch_tests.h"

namespace tandem {

namespace {

std::vector<std::vector<double>> tile_means(const SampledImage& image) {
    std::vector<std::vector<double>> means;
    for (const Batch& batch : image.batches) means.push_back(batch.tiles.means);
    return means;
}

}  // namespace

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
    if (verdict.reference.batches.size() >= 4 && verdict.candidate.batches.size() >= 4)
        verdict.permutation_p = permutation_p_value(tile_means(verdict.reference), tile_means(verdict.candidate),
            {.permutations = 999, .enough = 50, .seed = 1});
    if (verdict.verdict != Verdict::disagree) return;
    verdict.registration = register_images(verdict.reference, verdict.candidate);
    if (!verdict.registration->text.empty()) verdict.sentence += "; it looks like " + verdict.registration->text;
}

}  // namespace tandem
