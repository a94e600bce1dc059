// Where two renderers' paths for the same (seed, pixel, sample) part, and why.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/path_trace.h"

namespace tandem {

// How far the k-th rays lie apart. Ulps are those of single precision at the larger magnitude of the vector, so that a
// component near zero does not count as far.
struct RayDistance {
    double origin_ulp = 0.0, direction_ulp = 0.0, throughput_ulp = 0.0;
    bool same_primitive = true;
};

struct TraceComparison {
    std::vector<RayDistance> rays;  // as many as both have
    // The first ray at which the paths are no longer the same but for rounding, and what happened.
    std::optional<std::size_t> first_divergence;
    std::string reason;  // "they leave different primitives, 7 and 8"; without divergence: how far rounding took them
};

// `tolerated_ulp`: beyond it two values are not the same but for rounding. The default lets an error of an ulp grow by
// 2^14 on its way; chaotic paths part sooner or later, and then differ in all figures.
[[nodiscard]] TraceComparison compare_traces(const PathTrace& a, const PathTrace& b, double tolerated_ulp = 16384.0);

}  // namespace tandem
