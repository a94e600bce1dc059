// Scenes changed in ways that must not change their image. So scenes without a closed form can be tested too.
#pragma once

#include <array>
#include <optional>
#include <stop_token>
#include <string_view>

#include "common/render/renderer.h"
#include "common/stability/stability.h"

namespace tandem::stability {

enum class Change { scaled, turned, mirrored, permuted, split, baked };
inline constexpr std::array<std::string_view, 6> change_names{
    "scaled", "turned", "mirrored", "permuted", "split", "baked"};

// The scene changed. All lengths times 2^10 (with what is per length or per area). A quarter turn about y; x mirrored;
// x, y, z to y, z, x. Every triangle cut in two at the middle of its longest edge, lights too; triangles of instances
// with their transform applied. Nothing where the change would alter the image, or changes nothing. Examples are a sky
// that is not even, a grid that would have to turn, no triangle.
[[nodiscard]] std::optional<Scene> changed(const Scene& scene, Change change);

// Renders each scene as it is and changed, the same pixels and samples, and compares. Scaled ones are compared value by
// value: what differs counts as a false hit. Others are compared by image means, within six standard errors of their
// difference. worst_ulp and bound are the worst such deviation and what is allowed. No longer than `seconds`, one scene
// excepted.
void judge_change(const HardCase& hard_case, Renderer& renderer, Precision precision, double seconds,
    const std::stop_token& stop, CaseResult& result);

}  // namespace tandem::stability
