// Which parts of a path tracer are suspected, likeliest first, each with the observation that speaks against it. What
// paths and kernels show outranks what planted bugs look like (likeness.h). Where both sides miss a closed form alike,
// the scene's own features are the suspects.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/scene.h"
#include "common/validation/explanation/likeness.h"
#include "common/validation/verdict/closed_form.h"
#include "common/validation/verify/fault_place.h"

namespace tandem {

struct Suspect {
    Subsystem part = Subsystem::count;
    std::string because;  // a clause that can follow a colon
};
inline constexpr std::size_t most_suspects = 3;

// What a scene has beyond the plainest one, and where MODEL.md defines it.
struct SceneFeature {
    Subsystem part = Subsystem::count;
    std::string_view words;    // "a lens"
    std::string_view section;  // empty: the words are the whole clause
    bool operator==(const SceneFeature&) const = default;
};

// The most particular first: few scenes have a lens, all have surfaces.
[[nodiscard]] std::vector<SceneFeature> features_of(const Scene& scene, const RenderSettings& settings);

// Where both sides miss a closed form: the scene's features. First come those that none of `met` has, the features of
// scenes that meet their closed forms.
[[nodiscard]] std::vector<Suspect> suspects_of_miss(
    std::span<const SceneFeature> features, std::span<const SceneFeature> met = {});

// Why the film itself is suspected of a miss: most of the side's pixels have the closed form's value exactly, and few
// have not. Nothing where the image has noise, or is not one colour.
[[nodiscard]] std::optional<Suspect> film_misses(const ClosedForm& form, const SampledImage& side);

// Where the two sides differ.
struct DifferenceEvidence {
    const Judgement& judgement;
    const Signature& signature;
    const PathPartings& partings;
    const FaultPlace& place;
};
[[nodiscard]] std::vector<Suspect> suspects_of_difference(
    const DifferenceEvidence& evidence, std::span<const PlantedSignature> rows = planted_signatures());

// "suspects: camera, lens and time (the rays of the camera differ in 98 % of the paths that part); else ..."
[[nodiscard]] std::string told(std::span<const Suspect> suspects);

}  // namespace tandem
