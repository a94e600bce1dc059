#include "vulkan/renderer/scene/bvh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <numeric>
#include <utility>

namespace tandem {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::size_t bin_count = 16;

struct Bounds : Box {
    Bounds() : Box{glm::dvec3(infinity), glm::dvec3(-infinity)} {}
    void add(const Box& box) {
        low = glm::min(low, box.low);
        high = glm::max(high, box.high);
    }
    [[nodiscard]] double half_area() const {
        const glm::dvec3 size = high - low;
        return size.x * size.y + size.y * size.z + size.z * size.x;
    }
};

// What the shader's arithmetic displaces a box's planes by, relative to the box's distance from 0
// (shaders/geometry/bvh.glsl). It is 2 u, and a third u for what half the extent is off by itself.
constexpr double displaced = 3.0 * 0x1p-24;

gpu::Vec3 centre_of(const Bounds& box) {
    const glm::vec3 centre(0.5 * box.low + 0.5 * box.high);
    return {centre.x, centre.y, centre.z};
}

float half_extent(double low, double high, double centre) {
    const double half = std::max(high - centre, centre - low) + displaced * std::max(std::abs(low), std::abs(high));
    const auto rounded = static_cast<float>(half);
    return rounded < half ? std::nextafterf(rounded, std::numeric_limits<float>::infinity()) : rounded;
}

gpu::Vec3 half_extent(const Bounds& box, const gpu::Vec3& centre) {
    return {half_extent(box.low.x, box.high.x, centre.x), half_extent(box.low.y, box.high.y, centre.y),
        half_extent(box.low.z, box.high.z, centre.z)};
}

std::uint32_t levels_needed(std::size_t count) { return static_cast<std::uint32_t>(std::bit_width(count - 1)); }

class Builder {
public:
    Builder(std::span<const Box> boxes, std::vector<gpu::BvhNode>& nodes, HierarchyQuality quality)
        : boxes_(boxes), nodes_(nodes), quality_(quality), order_(boxes.size()) {
        std::iota(order_.begin(), order_.end(), 0u);
    }

    std::uint32_t build() { return build(order_, 0); }

private:
    using Range = std::span<std::uint32_t>;
    struct Split {
        double cost = infinity;
        int axis = 0;
        std::size_t bin = 0;  // the first of the right half
    };

    [[nodiscard]] glm::dvec3 centroid(std::uint32_t i) const { return 0.5 * boxes_[i].low + 0.5 * boxes_[i].high; }

    [[nodiscard]] Bounds bounds(Range range) const {
        Bounds result;
        for (const std::uint32_t i : range) result.add(boxes_[i]);
        return result;
    }

    [[nodiscard]] Bounds centroid_bounds(Range range) const {
        Bounds result;
        for (const std::uint32_t i : range) result.add({centroid(i), centroid(i)});
        return result;
    }

    static std::size_t bin_of(double x, double low, double high) {
        return std::min(bin_count - 1, static_cast<std::size_t>(bin_count * ((x - low) / (high - low))));
    }

    // The cheapest of the splits between bins of one axis by the surface area heuristic [Wald 2007].
    void try_axis(Range range, const Bounds& centroids, int axis, Split& best) const {
        const double low = centroids.low[axis], high = centroids.high[axis];
        if (!(high > low)) return;
        std::array<Bounds, bin_count> bins;
        std::array<std::size_t, bin_count> counts{};
        for (const std::uint32_t i : range) {
            const std::size_t bin = bin_of(centroid(i)[axis], low, high);
            bins[bin].add(boxes_[i]);
            ++counts[bin];
        }
        std::array<double, bin_count> right{};  // cost of bins [b, end)
        Bounds running;
        std::size_t count = 0;
        for (std::size_t b = bin_count - 1; b > 0; --b) {
            running.add(bins[b]);
            count += counts[b];
            right[b] = count == 0 ? infinity : running.half_area() * static_cast<double>(count);
        }
        running = {};
        count = 0;
        for (std::size_t b = 1; b < bin_count; ++b) {
            running.add(bins[b - 1]);
            count += counts[b - 1];
            if (count == 0) continue;
            const double cost = running.half_area() * static_cast<double>(count) + right[b];
            if (cost < best.cost) best = {cost, axis, b};
        }
    }

    // Where to part `range`, both parts being non-empty and small enough for the levels that are left to them. In the
    // middle, a half of n needs one level less than n.
    std::size_t partition(Range range, std::uint32_t level) {
        const Bounds centroids = centroid_bounds(range);
        const glm::dvec3 size = centroids.high - centroids.low;
        const int longest = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        Split split;
        if (quality_ != HierarchyQuality::low)
            for (int axis = 0; axis < 3; ++axis)
                if (axis == longest || quality_ == HierarchyQuality::high) try_axis(range, centroids, axis, split);
        if (split.cost < infinity) {
            const double low = centroids.low[split.axis], high = centroids.high[split.axis];
            const auto middle = std::partition(range.begin(), range.end(),
                [&](std::uint32_t i) { return bin_of(centroid(i)[split.axis], low, high) < split.bin; });
            const auto left = static_cast<std::size_t>(middle - range.begin());
            const std::size_t larger = std::max(left, range.size() - left);
            if (level + 1 + levels_needed(larger) <= most_bvh_levels) return left;
        }
        const std::size_t half = range.size() / 2;
        std::nth_element(range.begin(), range.begin() + static_cast<std::ptrdiff_t>(half), range.end(),
            [&](std::uint32_t a, std::uint32_t b) {
                return std::pair{centroid(a)[longest], a} < std::pair{centroid(b)[longest], b};
            });
        return half;
    }

    std::uint32_t build(Range range, std::uint32_t level) {
        if (range.size() == 1) return bvh_leaf | range[0];
        const std::size_t left = partition(range, level);
        const Bounds bounds0 = bounds(range.first(left)), bounds1 = bounds(range.subspan(left));
        const auto node = static_cast<std::uint32_t>(nodes_.size());
        const gpu::Vec3 centre0 = centre_of(bounds0), centre1 = centre_of(bounds1);
        nodes_.push_back({centre0, 0, half_extent(bounds0, centre0), 0, centre1, 0, half_extent(bounds1, centre1), 0});
        const std::uint32_t child0 = build(range.first(left), level + 1);
        const std::uint32_t child1 = build(range.subspan(left), level + 1);
        nodes_[node].child0 = child0;
        nodes_[node].child1 = child1;
        return node;
    }

    std::span<const Box> boxes_;
    std::vector<gpu::BvhNode>& nodes_;
    HierarchyQuality quality_;
    std::vector<std::uint32_t> order_;
};

}  // namespace

std::uint32_t build_bvh(std::span<const Box> boxes, std::vector<gpu::BvhNode>& nodes, HierarchyQuality quality) {
    nodes.reserve(nodes.size() + boxes.size());
    return Builder(boxes, nodes, quality).build();
}

}  // namespace tandem
