// Which scenes have faces of several bodies in one plane (MODEL.md section 5.2).
#pragma once

#include "common/scene/scene.h"

namespace tandem {

// Whether a triangle's or cuboid's face that lets rays through may lie in the plane of another body's face. The
// tolerance is 2^-16 of their coordinates, eight times the error of backends for equal planes in single precision. It
// may also be true for faces that lie beside each other, or with normals that differ by less than 10^-3. It is always
// true where entities move.
[[nodiscard]] bool passed_faces_coincide(const Scene& scene);

}  // namespace tandem
