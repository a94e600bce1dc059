#include "common/validation/verify/trace_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace tandem {

namespace {

// Apart by how many ulp of a number of the size of `magnitude`.
double ulps(const glm::dvec3& a, const glm::dvec3& b, double magnitude) {
    if (a == b) return 0.0;
    const glm::dvec3 apart = a - b;
    if (!std::isfinite(apart.x) || !std::isfinite(apart.y) || !std::isfinite(apart.z)) return INFINITY;
    return largest_coordinate(apart) / std::ldexp(1.0, std::max(std::ilogb(magnitude), -126) - 23);
}
double ulps(const glm::dvec3& a, const glm::dvec3& b) {
    return ulps(a, b, std::max(largest_coordinate(a), largest_coordinate(b)));
}

VertexDistance distance_of(const TracedVertex& a, const TracedVertex& b, CompareRadiance radiance) {
    VertexDistance result;
    const double place = std::max({largest_coordinate(a.position), largest_coordinate(b.position),
        largest_coordinate(a.origin), largest_coordinate(b.origin)});
    result.position_ulp = ulps(a.position, b.position, place);
    result.normal_ulp = ulps(a.normal, b.normal);
    result.throughput_ulp = ulps(a.throughput, b.throughput);
    if (a.end == PathEnd::goes_on && b.end == PathEnd::goes_on) {
        result.direction_ulp = ulps(a.next_direction, b.next_direction);
        result.next_throughput_ulp = ulps(a.next_throughput, b.next_throughput);
        if (a.pdf > 0.0 && b.pdf > 0.0) result.pdf_ulp = ulps(glm::dvec3(a.pdf), glm::dvec3(b.pdf));
    }
    if (radiance == CompareRadiance::yes) result.radiance_ulp = ulps(a.radiance, b.radiance);
    return result;
}

std::string met(const TracedVertex& vertex) {
    if (vertex.in_medium) return "the medium";
    return vertex.primitive == no_index ? "nothing" : fmt::format("primitive {}", vertex.primitive);
}

std::string ending(const TracedVertex& vertex) {
    constexpr std::array names{"goes on", "leaves the scene", "is absorbed by an emitter", "has no bounces left",
        "is ended by roulette", "is absorbed", "ends with direct light", "is invalid"};
    return names.at(static_cast<std::size_t>(vertex.end));
}

// How the light at the vertex came about, where both tell it. All else follows from another direction to a light.
std::string difference_of_light(const TracedVertex& a, const TracedVertex& b, double tolerated) {
    const auto one = [](double x) { return glm::dvec3(x); };
    const glm::dvec3 none(0.0);
    const TracedLight &l = a.next_event, &m = b.next_event;
    if (l.direction != none && m.direction != none) {
        const double apart = ulps(l.direction, m.direction);
        if (!(apart <= tolerated))
            return fmt::format("the directions to the sampled light are {:.0f} ulp apart", apart);
        if ((a.light == none) != (b.light == none))
            return "one shadow ray to the sampled light brings light, the other none";
    }
    std::vector<std::pair<double, const char*>> factors;
    if (l.pdf > 0.0 && m.pdf > 0.0)
        factors = {{ulps(l.radiance, m.radiance), "the radiances of the sampled light are"},
            {ulps(one(l.pdf), one(m.pdf)), "the densities of light sampling are"},
            {ulps(l.response, m.response), "the BSDFs for the sampled light are"},
            {ulps(l.transmittance, m.transmittance), "the transmittances to the sampled light are"},
            {ulps(one(l.weight), one(m.weight)), "the MIS weights of the sampled light are"}};
    if (a.found_weight > 0.0 && b.found_weight > 0.0)
        factors.emplace_back(ulps(one(a.found_weight), one(b.found_weight)), "the MIS weights of the light met are");
    for (const auto& [ulp, what] : factors)
        if (!(ulp <= tolerated)) return fmt::format("{} {:.0f} ulp apart", what, ulp);
    return "";
}

// Empty: the vertices are the same but for rounding. What causes comes before what follows from it.
std::string difference(const TracedVertex& a, const TracedVertex& b, const VertexDistance& distance, double tolerated) {
    if (a.in_medium != b.in_medium || a.primitive != b.primitive)
        return fmt::format("the rays meet different things: {} and {}", met(a), met(b));
    const std::pair<double, const char*> place[] = {{distance.position_ulp, "the vertices lie"},
        {distance.normal_ulp, "the normals are"}, {distance.throughput_ulp, "the arriving throughputs are"}};
    for (const auto& [ulp, what] : place)
        if (!(ulp <= tolerated)) return fmt::format("{} {:.0f} ulp apart", what, ulp);
    if (distance.radiance_ulp > tolerated)
        if (std::string light = difference_of_light(a, b, tolerated); !light.empty()) return light;
    if (a.end != b.end) return fmt::format("one path {}, the other {}", ending(a), ending(b));
    const std::pair<double, const char*> onward[] = {{distance.direction_ulp, "the new directions are"},
        {distance.pdf_ulp, "the densities of the new direction are"},
        {distance.next_throughput_ulp, "the new throughputs are"},
        {distance.radiance_ulp, "the radiances gathered until here are"}};
    for (const auto& [ulp, what] : onward)
        if (!(ulp <= tolerated)) return fmt::format("{} {:.0f} ulp apart", what, ulp);
    return "";
}

}  // namespace

TraceComparison compare_traces(const PathTrace& a, const PathTrace& b, CompareRadiance radiance, double tolerated_ulp) {
    TraceComparison result;
    VertexDistance worst;
    const std::size_t both = std::min(a.vertices.size(), b.vertices.size());
    for (std::size_t k = 0; k < both; ++k) {
        const VertexDistance distance = distance_of(a.vertices[k], b.vertices[k], radiance);
        result.vertices.push_back(distance);
        worst.position_ulp = std::max(worst.position_ulp, distance.position_ulp);
        worst.direction_ulp = std::max(worst.direction_ulp, distance.direction_ulp);
        worst.throughput_ulp = std::max(worst.throughput_ulp, distance.throughput_ulp);
        if (result.first_divergence) continue;
        result.reason = difference(a.vertices[k], b.vertices[k], distance, tolerated_ulp);
        if (!result.reason.empty()) result.first_divergence = k;
    }
    if (result.first_divergence) return result;
    if (a.vertices.size() != b.vertices.size()) {
        result.first_divergence = both;
        result.reason = fmt::format("one path ends after {} vertices, the other goes on", both);
        return result;
    }
    result.reason = fmt::format(
        "the same path; rounding took positions {:.0f}, directions {:.0f}, throughputs {:.0f} ulp apart at most",
        worst.position_ulp, worst.direction_ulp, worst.throughput_ulp);
    return result;
}

}  // namespace tandem
