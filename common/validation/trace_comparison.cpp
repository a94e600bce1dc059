#include "common/validation/trace_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/scene.h"

namespace tandem {

namespace {

double greatest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

double ulps(const glm::dvec3& a, const glm::dvec3& b) {
    if (a == b) return 0.0;
    const glm::dvec3 apart = a - b;
    if (!std::isfinite(apart.x) || !std::isfinite(apart.y) || !std::isfinite(apart.z)) return INFINITY;
    const double magnitude = std::max(greatest(a), greatest(b)), difference = greatest(apart);
    return difference / std::ldexp(1.0, std::max(std::ilogb(magnitude), -126) - 23);
}

std::string place(std::uint32_t primitive) {
    return primitive == no_index ? "none" : fmt::format("primitive {}", primitive);
}

std::string reason_of(const TracedRay& a, const TracedRay& b, const RayDistance& distance, double tolerated) {
    if (!distance.same_primitive)
        return fmt::format("the rays leave different surfaces: {} and {}", place(a.primitive), place(b.primitive));
    if (distance.origin_ulp > tolerated) return fmt::format("the vertices lie {:.0f} ulp apart", distance.origin_ulp);
    if (distance.direction_ulp > tolerated)
        return fmt::format("the rays go into different directions, {:.0f} ulp apart", distance.direction_ulp);
    return fmt::format("the throughputs differ by {:.0f} ulp", distance.throughput_ulp);
}

}  // namespace

TraceComparison compare_traces(const PathTrace& a, const PathTrace& b, double tolerated_ulp) {
    TraceComparison result;
    RayDistance worst;
    const std::size_t both = std::min(a.rays.size(), b.rays.size());
    for (std::size_t k = 0; k < both; ++k) {
        const TracedRay &x = a.rays[k], &y = b.rays[k];
        const RayDistance distance{ulps(x.origin, y.origin), ulps(x.direction, y.direction),
            ulps(x.throughput, y.throughput), x.primitive == y.primitive};
        result.rays.push_back(distance);
        const bool parted = !distance.same_primitive || std::max({distance.origin_ulp, distance.direction_ulp,
                                                            distance.throughput_ulp}) > tolerated_ulp;
        if (parted && !result.first_divergence) {
            result.first_divergence = k;
            result.reason = reason_of(x, y, distance, tolerated_ulp);
        }
        worst.origin_ulp = std::max(worst.origin_ulp, distance.origin_ulp);
        worst.direction_ulp = std::max(worst.direction_ulp, distance.direction_ulp);
        worst.throughput_ulp = std::max(worst.throughput_ulp, distance.throughput_ulp);
    }
    if (result.first_divergence) return result;
    if (a.rays.size() != b.rays.size()) {
        result.first_divergence = both;
        result.reason = fmt::format("one path ends after {} rays, the other goes on", both);
        return result;
    }
    result.reason = fmt::format(
        "the same path; rounding took origins {:.0f}, directions {:.0f}, throughputs {:.0f} ulp "
        "apart at most",
        worst.origin_ulp, worst.direction_ulp, worst.throughput_ulp);
    return result;
}

}  // namespace tandem
