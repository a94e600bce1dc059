// What a path tracer keeps of the paths that it follows (the last parameter of PathTracer). It is nothing, at no cost,
// or one path whole, for `tandem trace`.
#pragma once

#include <cstdint>
#include <vector>

#include "common/render/path_trace.h"

namespace tandem::cpu {

struct NoRecorder {
    static constexpr bool records = false;
};

// Records a batch of one path.
struct PathRecorder {
    static constexpr bool records = true;
    std::vector<TracedVertex> vertices;
    glm::dvec3 light_direction{0.0}, light{0.0};  // of the vertex at hand
    unsigned scattered = 0;  // lanes whose last scattering gave a direction and left light to carry
};

}  // namespace tandem::cpu
