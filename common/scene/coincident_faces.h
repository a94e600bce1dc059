// Which scenes have faces of several bodies in one plane (MODEL.md section 5.2).
#pragma once

#include "common/scene/scene.h"

namespace tandem {

// Whether a triangle's or cuboid's face that lets rays through may lie in the plane of another body's face. The
// tolerance is 2^-16 of their coordinates, eight times what backends make of equal planes in single precision. Where
// faces lie beside each other or normals are off by less than 10^-3 it may say so too, and where entities move it does.
[[nodiscard]] bool passed_faces_coincide(const Scene& scene);

}  // namespace tandem
