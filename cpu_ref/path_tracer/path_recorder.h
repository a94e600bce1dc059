// What a path tracer records of its paths (a parameter of PathTracer). Usually it records nothing, at no cost. For
// `tandem trace` it records one whole path, and for feature images the first vertices of many.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/render/path_trace.h"

namespace tandem::cpu {

struct NoRecorder {
    static constexpr bool records = false;
};

// Records a batch of one path; or of any batch each path's first vertex, where paths then end.
struct PathRecorder {
    static constexpr bool records = true;
    static constexpr std::size_t most_lanes = 32;
    bool first_only = false;
    ChangedNumber changed{};
    std::vector<TracedVertex> vertices;              // first_only: by the number of the path
    std::array<TracedVertex, most_lanes> at_hand{};  // by lane, what is known before the vertex is done
    unsigned scattered = 0;  // lanes whose last scattering gave a direction and left light to carry

    // A vertex to fill in.
    [[nodiscard]] TracedVertex& next(std::uint32_t path) {
        return first_only ? vertices[path] = {} : vertices.emplace_back();
    }
};

}  // namespace tandem::cpu
