// Exact answers for tests: on which side of an edge a ray passes, by rational arithmetic (Boost.Multiprecision). The
// coordinates are taken as the binary numbers that they are. Slow: microseconds a question.
#pragma once

#include <array>
#include <glm/vec3.hpp>

namespace tandem::test {

// Where the line of a ray passes a triangle. In the plane: the line lies in it, or the triangle has no area.
enum class Passage { inside, edge, vertex, outside, in_plane };

[[nodiscard]] Passage exact_passage(
    const glm::dvec3& origin, const glm::dvec3& direction, const std::array<glm::dvec3, 3>& corners);

// The sign of the parameter at which that line meets the triangle's plane: -1 behind the origin, 0 at it, 1 ahead. It
// is also 0 where it never does.
[[nodiscard]] int exact_side(
    const glm::dvec3& origin, const glm::dvec3& direction, const std::array<glm::dvec3, 3>& corners);

}  // namespace tandem::test
