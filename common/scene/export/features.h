// The features that a scene uses, and how well each target of `tandem export` can express them. features.cpp has a row
// for each feature. The table in scenes/format/EXPORT.md is made from it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace tandem::scene_export {

enum class Target : std::uint32_t { gltf = 0, pbrt = 1, mitsuba = 2, blender = 3 };
inline constexpr std::array<std::string_view, 4> target_names{"gltf", "pbrt", "mitsuba", "blender"};

// - exact: the target means what MODEL.md means.
// - near: it is written, and the reason says what differs.
// - kept: the target has no word for it, so it is written into extras. `tandem import` reads these, and other programs
//   ignore them.
// - refused: it is not written.
enum class Can { exact, near, kept, refused };

struct Saying {
    Can can = Can::exact;
    std::string_view reason = {};
};

struct Feature {
    std::string_view name;
    std::array<Saying, target_names.size()> says;       // by Target
    std::optional<std::string> (*first)(const Scene&);  // the first thing of the scene that has it, for messages
};

[[nodiscard]] std::span<const Feature> features();

struct Finding {
    const Feature* feature;
    std::string where;
};
[[nodiscard]] std::vector<Finding> features_of(const Scene& scene);

// Throws InputError for what the target cannot say; with `strict` also for what only `tandem import` would read.
void check_target(const Scene& scene, Target target, bool strict);

// A line for each feature of the scene that is not exact, "what: reason": the comments of an export.
[[nodiscard]] std::vector<std::string> remarks_on(const Scene& scene, Target target);

}  // namespace tandem::scene_export
