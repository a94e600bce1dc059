// Which parts of a path tracer are suspected, likeliest first, each with the observation that speaks against it. The
// evidence of the pattern, the removed features and the draws is added up, weighted as for planted bugs
// (part_evidence.h). Where both sides miss a closed form alike, changes that were tried name the part. Else the scene's
// own features are the suspects.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/export/misreading.h"
#include "common/validation/explanation/part_evidence.h"
#include "common/validation/explanation/scene_features.h"
#include "common/validation/verdict/closed_form.h"
#include "common/validation/verify/data_trial.h"
#include "common/validation/verify/elimination.h"
#include "common/validation/verify/fault_place.h"
#include "common/validation/verify/missed_form.h"
#include "common/validation/verify/precision_trial.h"

namespace tandem {

struct Suspect {
    Subsystem part = Subsystem::count;
    std::string because;  // a clause that can follow a colon
};
inline constexpr std::size_t most_suspects = 3;

// Where both sides miss a closed form.
struct MissEvidence {
    std::span<const SceneFeature> features;  // of the scene, the most particular first
    std::span<const SceneFeature> met{};     // of scenes that meet their closed forms
    const MissedForm* tried = nullptr;       // where changes were tried
    std::optional<Suspect> film{};           // film_misses
};
// First comes what leaves nothing else: the film, data that are not sound, a change with which the form is met. Then
// come the features, those before that no scene of `met` has, and last those of parts that are cleared.
[[nodiscard]] std::vector<Suspect> suspects_of_miss(const MissEvidence& evidence);

// Why the film itself is suspected of a miss. Either most of the side's pixels have the closed form's value exactly,
// and few have not. Or all are off as if sums were divided by one sample too few or too many. Nothing where the image
// has noise, or is not one colour.
[[nodiscard]] std::optional<Suspect> film_misses(const ClosedForm& form, const SampledImage& side);

// Who is suspected where the loader reads otherwise than the scene's file says. With a material that is the scene's
// data, and then the part that its field is for.
[[nodiscard]] std::vector<Suspect> suspects_of(const Misreading& misreading);

// Where the two sides differ.
struct DifferenceEvidence {
    const Judgement& judgement;
    const Signature& signature;
    const PathPartings& partings;
    const FaultPlace& place;
    const Elimination* elimination = nullptr;         // where features were taken out
    const PrecisionTrial* precision_trial = nullptr;  // where a side is right in double precision
    const DataTrial* data_trial = nullptr;            // where a side has wrong data
};
// What planted bugs showed.
struct BugRecord {
    std::span<const PlantedSignature> patterns = planted_signatures();
    std::span<const PlantedNeeds> needs = planted_needs();
};
// What the ranking follows from. Each part's log-likelihood ratio: of what is counted, and with what else was observed.
struct PartRanking {
    PartEvidence evidence;
    Scores counted{}, all{};
};
struct RankedSuspects {
    std::vector<Suspect> suspects;
    PartRanking ranking;
};
[[nodiscard]] RankedSuspects suspects_of_difference(const DifferenceEvidence& evidence, const BugRecord& record = {});

// "suspects: camera, lens and time (the rays of the camera differ in 98 % of the paths that part); else ..."
[[nodiscard]] std::string told(std::span<const Suspect> suspects);

}  // namespace tandem
