// One path as a renderer followed it, ray by ray, for `tandem trace`.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace tandem {

// The k-th ray of a path (0: the camera's), as it stood before it met anything.
struct TracedRay {
    glm::dvec3 origin{0.0}, direction{0.0};
    glm::dvec3 throughput{1.0};
    glm::dvec3 radiance{0.0};  // gathered until here, next events of the vertex it leaves included where they are known
    std::uint32_t primitive = 0;  // id of the one that it leaves (MODEL.md section 5); no_index: camera or medium
};

struct PathTrace {
    std::vector<TracedRay> rays;
    glm::dvec3 radiance{0.0};  // of the sample
};

}  // namespace tandem
