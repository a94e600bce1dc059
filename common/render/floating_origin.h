// Scenes that are far from the origin, or that move far while the shutter is open. They are moved near the origin for
// rendering, where rounding errors are least.
#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>

#include "common/render/renderer.h"

namespace tandem {

// Single precision rounds in proportion to a coordinate's size, so a mesh of size 1 has 13 representable numbers a side
// at 10^6. The point to subtract where all surfaces and the camera stand together, far from the origin along an axis.
// It is the middle of the box that holds them, rounded to few bits. So the difference is exact for numbers of up to
// some 40 bits. It is 0 along other axes. Empty: all are near.
[[nodiscard]] std::optional<glm::dvec3> floating_origin(const Scene& scene);

// All that stands in the world, moved by -origin; what happens in it stays the same. Entities whose own coordinates are
// large get their place in smaller ones. Empty where that cannot be: coordinates that a texture goes by, or vertices
// that entities share which stand apart.
[[nodiscard]] std::optional<Scene> seen_from(const Scene& scene, const glm::dvec3& origin);

// The camera's displacement, where it is large and a body shares it or most of it. Moved so far, they would see each
// other through the rounding of places that only the displacement made large. Empty also where something stands still
// that cannot move: points, spots and grids.
[[nodiscard]] std::optional<glm::dvec3> floating_motion(const Scene& scene);

// The scene as seen by who is displaced by `motion`: camera and entities move by that less.
[[nodiscard]] Scene moving_along(const Scene& scene, const glm::dvec3& motion);

// A job for the scene where it stands, its contacts apart (contacts.h). It comes by way of `prepare` for the scene as
// seen along its floating motion and from its floating origin, if it has them. The points of traced paths are those of
// the world.
[[nodiscard]] std::unique_ptr<RenderJob> prepare_near_origin(const Scene& scene, const RenderSettings& settings,
    const std::function<std::unique_ptr<RenderJob>(const Scene&)>& prepare);

}  // namespace tandem
