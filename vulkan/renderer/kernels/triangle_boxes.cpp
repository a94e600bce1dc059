#include "vulkan/renderer/kernels/triangle_boxes.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <optional>

namespace tandem {

namespace {

constexpr std::size_t corners_of_box = 8;

struct Corner {
    std::uint32_t number;     // of the first like it
    glm::dvec3 vertex;        // in its entity's space
    std::uint32_t place = 0;  // bit k: the higher of the two places along edge k
};

using Corners = std::vector<Corner>;

std::uint32_t number_of(std::span<const std::uint32_t> corners, std::uint32_t triangle, std::uint32_t k) {
    return corners[triangle] >> 8 * k & 255u;
}

glm::dvec3 vertex_of(const SceneData& scene, std::uint32_t corner) {
    const gpu::PrimitiveSource& source = scene.sources[corner / 3];
    const std::array<std::uint32_t, 3> index{source.index0, source.index1, source.index2};
    const gpu::Vec4& vertex = scene.vertices[index[corner % 3]];
    return {vertex.x, vertex.y, vertex.z};
}

// The triangles that hang together with `first` by corners, in ascending order.
std::vector<std::uint32_t> connected(std::uint32_t first, std::uint32_t count, std::span<const std::uint32_t> corners) {
    std::vector<std::uint32_t> result{first};
    for (std::size_t at = 0; at < result.size(); ++at)
        for (std::uint32_t i = 0; i < count; ++i) {
            if (std::ranges::find(result, i) != result.end()) continue;
            for (std::uint32_t a = 0; a < 9; ++a)
                if (number_of(corners, result[at], a / 3) == number_of(corners, i, a % 3)) {
                    result.push_back(i);
                    break;
                }
        }
    std::ranges::sort(result);
    return result;
}

double size_of(glm::dvec3 v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

// Gives each corner its place, if they are those of a box with these edges from the first corner.
bool place_corners(Corners& corners, const std::array<glm::dvec3, 3>& edges) {
    const double tolerance = 1e-5 * (size_of(edges[0]) + size_of(edges[1]) + size_of(edges[2]));
    std::vector<Corners::iterator> placed;
    for (std::uint32_t place = 0; place < corners_of_box; ++place) {
        glm::dvec3 wanted = corners[0].vertex;
        for (std::uint32_t k = 0; k < 3; ++k)
            if ((place >> k & 1u) != 0) wanted += edges[k];
        const auto found = std::ranges::find_if(
            corners, [&](const Corner& corner) { return size_of(corner.vertex - wanted) <= tolerance; });
        if (found == corners.end() || std::ranges::find(placed, found) != placed.end()) return false;
        found->place = place;
        placed.push_back(found);
    }
    return true;
}

// The three edges from the first corner.
std::optional<std::array<glm::dvec3, 3>> find_edges(Corners& corners) {
    for (std::size_t a = 1; a < corners_of_box; ++a)
        for (std::size_t b = a + 1; b < corners_of_box; ++b)
            for (std::size_t c = b + 1; c < corners_of_box; ++c) {
                const glm::dvec3 from = corners[0].vertex;
                const std::array edges{corners[a].vertex - from, corners[b].vertex - from, corners[c].vertex - from};
                if (place_corners(corners, edges)) return edges;
            }
    return {};
}

// Puts a triangle into its half of its face; false: it lies in none, or another is there.
bool place_triangle(TriangleBox& box, std::uint32_t& cut, std::uint32_t slot, std::array<std::uint32_t, 3> places) {
    const std::uint32_t common = ~((places[0] ^ places[1]) | (places[0] ^ places[2])) & 7u;
    if (common != 1 && common != 2 && common != 4) return false;
    const std::uint32_t k = common >> 1, i = (k + 1) % 3, j = (k + 2) % 3;
    const auto in_face = [&](std::uint32_t place) { return (place >> i & 1u) | (place >> j & 1u) << 1; };
    // The missing corner of the square is across from the right angle; corners are numbered by their two bits.
    const std::uint32_t missing = in_face(places[0]) ^ in_face(places[1]) ^ in_face(places[2]);
    const std::uint32_t right_angle = missing ^ 3u;
    const bool rising = right_angle == 1 || right_angle == 2;
    const std::uint32_t half = right_angle == 1 || right_angle == 3 ? 0 : 1;
    const std::uint32_t face = 2 * k + (places[0] >> k & 1u);
    if ((cut >> face & 1u) != 0 && (box.rising >> face & 1u) != static_cast<std::uint32_t>(rising)) return false;
    cut |= 1u << face;
    if (rising) box.rising |= 1u << face;
    std::uint8_t& place = box.slots[2 * face + half];
    if (place != no_triangle) return false;
    place = static_cast<std::uint8_t>(slot);
    return true;
}

// The map to the box, and what rounding may amount to. Sizes are of vectors' greatest components. A line is off by at
// most 30 u R^2 (|p| + |c|) + 8 u R in the kernel (R: of the rows' sums; p: from the centre c; sums of products of
// three terms, and m). The corners that the tests of triangles project are off by up to 28 u of their distance, by
// Vulkan's least accuracy and for directions of unit length to within float's rounding, as all are that paths take;
// each edge function answers with up to twice R^2 as much, and with 3 u of the square of the longest side on top, as
// is_near of shaders/geometry/shapes.glsl keeps farther rays off. 128 is above the sum of these. What corners are off
// the box counts by `deviation`, whatever its size.
bool measure(
    TriangleBox& box, const gpu::EntityTransform& m, const Corners& corners, const std::array<glm::dvec3, 3>& edges) {
    constexpr double u = 0.5 * std::numeric_limits<float>::epsilon();
    const glm::dmat3 rows{m.to_world0.x, m.to_world0.y, m.to_world0.z, m.to_world1.x, m.to_world1.y, m.to_world1.z,
        m.to_world2.x, m.to_world2.y, m.to_world2.z};
    const glm::dmat3 linear = glm::transpose(rows);
    const glm::dvec3 shift(m.to_world0.w, m.to_world1.w, m.to_world2.w);
    const glm::dmat3 halves(linear * (0.5 * edges[0]), linear * (0.5 * edges[1]), linear * (0.5 * edges[2]));
    const glm::dmat3 to_box = glm::inverse(halves);
    const glm::dvec3 centre = linear * corners[0].vertex + shift + halves[0] + halves[1] + halves[2];
    double reach = size_of(centre), deviation = 0, longest = 0;
    for (const Corner& corner : corners) {
        const glm::dvec3 world = linear * corner.vertex + shift, at = to_box * (world - centre);
        longest = std::max(longest, 2 * glm::length(world - centre));
        for (int k = 0; k < 3; ++k) {
            const double terms = glm::dot(glm::abs(rows[k]), glm::abs(corner.vertex)) + std::abs(shift[k]);
            reach = std::max(reach, terms);
            deviation = std::max(deviation, std::abs(at[k] - ((corner.place >> k & 1u) != 0 ? 1.0 : -1.0)));
        }
    }
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        double row = 0;
        for (int j = 0; j < 3; ++j) {
            row += std::abs(to_box[j][k]);
            box.to_box[static_cast<std::size_t>(3 * k + j)] = static_cast<float>(to_box[j][k]);
        }
        sum = std::max(sum, row);
        box.centre[static_cast<std::size_t>(k)] = static_cast<float>(centre[k]);
    }
    const double slope = 128 * u * sum * sum;
    const double across = 4 * u * longest * longest * std::abs(glm::determinant(to_box));
    box.slope = static_cast<float>(slope);
    box.margin = static_cast<float>(slope * 2 * reach + 32 * u * sum + 8 * deviation * sum + across);
    // Neither products that overflow nor numbers that are subnormal.
    return sum > 1e-9 && sum < 1e9 && reach < 1e9 && std::isfinite(box.margin);
}

std::optional<TriangleBox> box_of(
    const SceneData& scene, std::span<const std::uint32_t> triangles, std::span<const std::uint32_t> numbers) {
    Corners corners;
    for (const std::uint32_t triangle : triangles)
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t number = number_of(numbers, triangle, k);
            if (std::ranges::find(corners, number, &Corner::number) == corners.end())
                corners.push_back({number, vertex_of(scene, number)});
        }
    const gpu::EntityTransform& m = scene.transforms[scene.sources[triangles.front()].entity];
    if (corners.size() != corners_of_box || m.motion.x != 0 || m.motion.y != 0 || m.motion.z != 0) return {};
    const auto edges = find_edges(corners);
    if (!edges) return {};
    TriangleBox box;
    box.slots.fill(no_triangle);
    std::uint32_t cut = 0;
    for (const std::uint32_t triangle : triangles) {
        std::array<std::uint32_t, 3> places{};
        for (std::uint32_t k = 0; k < 3; ++k)
            places[k] = std::ranges::find(corners, number_of(numbers, triangle, k), &Corner::number)->place;
        if (!place_triangle(box, cut, triangle, places)) return {};
    }
    return measure(box, m, corners, *edges) ? std::optional(box) : std::nullopt;
}

}  // namespace

bool is_selective(const TriangleBox& box) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
        double row = 0;
        for (std::size_t j = 0; j < 3; ++j) row += std::abs(double{box.to_box[3 * k + j]});
        least = std::min(least, row);
    }
    return box.margin < 0.05 * least;
}

std::vector<TriangleBox> find_triangle_boxes(const SceneData& scene, std::span<const std::uint32_t> corners) {
    std::vector<TriangleBox> result;
    std::vector<bool> seen(scene.triangle_count);
    for (std::uint32_t i = 0; i < scene.triangle_count && result.size() < most_triangle_boxes; ++i) {
        if (seen[i]) continue;
        const std::vector<std::uint32_t> triangles = connected(i, scene.triangle_count, corners);
        for (const std::uint32_t triangle : triangles) seen[triangle] = true;
        if (const std::optional<TriangleBox> box = box_of(scene, triangles, corners)) result.push_back(*box);
    }
    return result;
}

}  // namespace tandem
