// Where two renderers' paths for the same (seed, pixel, sample) part, and why.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/render/path_trace.h"

namespace tandem {

// How far the k-th vertices lie apart. Ulps are those of single precision at the larger magnitude of the vector, so
// that a component near zero does not count as far. For a position they are at the larger one of the ray's two ends.
struct VertexDistance {
    double position_ulp = 0.0, normal_ulp = 0.0, throughput_ulp = 0.0;
    double direction_ulp = 0.0, pdf_ulp = 0.0, next_throughput_ulp = 0.0;  // 0 where either path ends
    double radiance_ulp = 0.0;
};

enum class CompareRadiance { yes, no };

struct TraceComparison {
    std::vector<VertexDistance> vertices;  // as many as both have
    // The first vertex at which the paths are no longer the same but for rounding, and what happened.
    std::optional<std::size_t> first_divergence;
    std::string reason;  // "they meet different surfaces: primitives 7 and 8"; without: how far rounding took them
};

// `tolerated_ulp`: beyond it two values are not the same but for rounding. The default lets an error of an ulp grow by
// 2^14 on its way. Chaotic paths part sooner or later, and then differ in all figures. Densities count where both have
// them: a renderer that samples only may keep none. Radiances are left out where the estimators differ.
[[nodiscard]] TraceComparison compare_traces(const PathTrace& a, const PathTrace& b,
    CompareRadiance radiance = CompareRadiance::yes, double tolerated_ulp = 16384.0);

}  // namespace tandem
