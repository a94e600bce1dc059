// The features of a scene: the part of a path tracer that simulates each, and the scene without it.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "common/render/renderer.h"
#include "common/scene/scene.h"
#include "common/validation/explanation/likeness.h"

namespace tandem {

// A scene and what is to be rendered of it, to be edited.
struct EditedScene {
    Scene scene;
    RenderSettings settings;
};

// What is learnt where a difference needs a feature: how many faults of other parts need it, too.
enum class Naming : std::uint8_t {
    particular,  // few do: a lens
    general,     // many do: lights that are sampled
    shape,       // all that happen on a body need it
    nobody       // nearly all do: paths of several bounces
};

struct SceneFeature {
    Subsystem part = Subsystem::count;
    std::string_view words;    // "a lens"
    std::string_view section;  // of MODEL.md that defines it; empty: the words are the whole clause
    // Takes all of it out: media become vacuum, materials diffuse, lights dark. nullptr: it cannot be taken out.
    void (*take_out)(EditedScene& edited) = nullptr;
    bool whole = false;  // without all such features of the part, the scene calls for nothing of it
    Naming naming = Naming::particular;
    bool keeps_mean = false;  // without it every pixel has the same mean still (MODEL.md sections 3 and 9)
    bool operator==(const SceneFeature&) const = default;
};

// The most particular first: few scenes have a lens, all have surfaces.
[[nodiscard]] std::vector<SceneFeature> features_of(const Scene& scene, const RenderSettings& settings);

// Those that can be taken out, the most particular first, and besides them what the settings add: weights, the
// generator, bounces.
[[nodiscard]] std::vector<SceneFeature> removable_features(const Scene& scene, const RenderSettings& settings);

}  // namespace tandem
