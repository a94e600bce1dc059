// How mouse and keys move a camera (MODEL.md section 4). Its motion while the shutter is open, its lens and its field
// of view stay.
#pragma once

#include "common/scene/scene.h"

namespace tandem {

// Turns the camera about its target: `right` about the up vector, `up` towards it, in radians. It never comes nearer to
// the poles than a degree, where the up vector would say nothing.
[[nodiscard]] Camera orbited(Camera camera, double right, double up);

// Turns the view about the camera's own place, in the same way.
[[nodiscard]] Camera turned(Camera camera, double right, double up);

// Moves camera and target alike: right, up and forward, each in distances to the target.
[[nodiscard]] Camera moved(Camera camera, const glm::dvec3& by);

// Moves the camera so that its distance to the target is `factor` > 0 times as large. What was in focus at the target
// is so still.
[[nodiscard]] Camera approached(Camera camera, double factor);

}  // namespace tandem
