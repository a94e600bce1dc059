#include "common/validation/verify/data_trial.h"

#include <fmt/format.h>

#include "common/error.h"
#include "common/render/effects.h"
#include "common/scene/sound_scene.h"

namespace tandem {

namespace {

VerifiedSide other_than(VerifiedSide side) {
    return side == VerifiedSide::candidate ? VerifiedSide::reference : VerifiedSide::candidate;
}

// How many part where the side that is not faulty has the fault. Nothing where the scene is as before, or refused.
std::optional<std::size_t> left_with(const DataQuestion& question, const DataFault& fault, VerifiedSide faulty) {
    Scene wrong = question.scene;
    if (!fault.plant(wrong) || !unsound_part(wrong).empty()) return std::nullopt;
    RenderSettings settings = question.settings;
    // Kernels are made for effects, which takes long: for the whole scene's, and what the fault calls for.
    settings.effects = needed_effects(question.scene, settings).united(needed_effects(wrong, settings));
    if (question.settings.effects) settings.effects = settings.effects->united(*question.settings.effects);
    const VerifiedSide side = other_than(faulty);
    Renderer& renderer = side == VerifiedSide::reference ? question.reference : question.candidate;
    try {
        return question.paths.parted_with(side, renderer, wrong, settings, question.paths.most_left());
    } catch (const UnsupportedError&) {
        return std::nullopt;
    }
}

}  // namespace

std::optional<DataTrial> try_data_faults(const DataQuestion& question) {
    if (!question.paths.tell()) return std::nullopt;
    // The reference takes less long to prepare, as a rule, so that what it is asked comes first.
    const std::vector<DataFault> faults = data_faults();
    for (const VerifiedSide faulty : {VerifiedSide::candidate, VerifiedSide::reference})
        for (const DataFault& fault : faults) {
            if (!question.in_time()) return std::nullopt;
            const std::optional<std::size_t> left = left_with(question, fault, faulty);
            if (left && question.paths.undone(*left))
                return DataTrial{.fault = fault, .faulty = faulty, .parted = question.paths.parted(), .left = *left};
        }
    return std::nullopt;
}

std::string told(const DataTrial& trial) {
    return fmt::format("the {} draws the {}'s samples where {}", name_of(other_than(trial.faulty)),
        name_of(trial.faulty), trial.fault.words);
}

}  // namespace tandem
