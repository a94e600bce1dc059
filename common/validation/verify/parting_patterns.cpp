#include "common/validation/verify/parting_patterns.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "common/scene/scene.h"

namespace tandem {

namespace {

using glm::dvec3;

constexpr double nearly_all = 0.9;
constexpr std::size_t fewest_paths = 16;

}  // namespace

void Frames::add(const std::vector<PathTrace>& reference, const std::vector<std::optional<Parting>>& partings) {
    // Scattering over a range of directions from a surface: mirrors need no frame.
    const auto scatters = [](const TracedVertex& at) {
        return at.end == PathEnd::goes_on && !at.in_medium && at.pdf > 0.0 && at.shading_normal != dvec3(0.0);
    };
    for (std::size_t i = 0; i < partings.size(); ++i) {
        const std::vector<TracedVertex>& vertices = reference[i].vertices;
        const std::size_t same = partings[i] ? partings[i]->vertex : vertices.size();
        for (std::size_t k = 0; k < std::min(same, vertices.size()); ++k)
            if (scatters(vertices[k])) alike_.push_back({vertices[k].shading_normal, vertices[k].material});
        if (!partings[i]) continue;
        ++parted_;
        if (same < vertices.size() && partings[i]->by[static_cast<std::size_t>(PartsBy::direction)] &&
            scatters(vertices[same]))
            differ_.push_back({vertices[same].shading_normal, vertices[same].material});
    }
}

std::string Frames::words() const {
    if (differ_.size() < fewest_paths ||
        static_cast<double>(differ_.size()) < nearly_all * static_cast<double>(parted_))
        return {};
    std::set<std::uint32_t> materials;
    for (const Scattering& one : differ_) materials.insert(one.material);
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-1.0, 1.0}) {
            const auto is_there = [&](const Scattering& one) { return sign * one.normal[axis] > 0.0; };
            if (!std::ranges::all_of(differ_, is_there)) continue;
            std::size_t there = 0, elsewhere = 0;
            for (const Scattering& one : alike_)
                if (materials.contains(one.material)) ++(is_there(one) ? there : elsewhere);
            const double most = (1.0 - nearly_all) * static_cast<double>(differ_.size());
            if (static_cast<double>(there) <= most && elsewhere >= fewest_paths)
                return fmt::format("new directions differ about normals with {} {} 0 alone", "xyz"[axis],
                    sign < 0.0 ? "below" : "above");
        }
    return {};
}

PrimitiveEnd::PrimitiveEnd(const Scene& scene) {
    const PlacedPrimitives placed = placed_primitives(scene);
    slots_.resize(placed.size());
    for (const PrimitiveKind kind : {PrimitiveKind::triangle, PrimitiveKind::sphere, PrimitiveKind::cuboid})
        for (std::uint32_t id = 0; id < slots_.size(); ++id) {
            if (scene.primitives[placed[id].primitive].kind != kind) continue;
            slots_[id] = static_cast<std::uint32_t>(kinds_.size());
            kinds_.push_back(kind);
        }
}

void PrimitiveEnd::add(const std::vector<PathTrace>& reference, const std::vector<PathTrace>& candidate,
    const std::vector<std::optional<Parting>>& partings) {
    constexpr std::array of_hits{
        PartsBy::met, PartsBy::place, PartsBy::normal, PartsBy::shading_normal, PartsBy::spawned};
    for (std::size_t i = 0; i < partings.size(); ++i) {
        const std::vector<TracedVertex>&a = reference[i].vertices, &b = candidate[i].vertices;
        const std::size_t same = partings[i] ? partings[i]->vertex : a.size();
        for (std::size_t k = 0; k < std::min(same, a.size()); ++k)
            if (a[k].primitive < slots_.size()) ++alike_[slots_[a[k].primitive]];
        if (!partings[i]) continue;
        ++parted_;
        const bool by_hit =
            std::ranges::any_of(of_hits, [&](PartsBy what) { return partings[i]->by[static_cast<std::size_t>(what)]; });
        if (!by_hit || same >= a.size() || same >= b.size()) continue;
        // One side may have met another thing, as it lacks this one.
        std::optional<std::uint32_t> last;
        for (const std::uint32_t met : {a[same].primitive, b[same].primitive})
            if (met < slots_.size()) last = std::max(last.value_or(0), slots_[met]);
        if (last) ++differ_[*last];
    }
}

std::string PrimitiveEnd::words() const {
    constexpr std::size_t few_primitives = 3, most_workgroup = 256;
    constexpr std::uint32_t least_workgroup = 32;
    const auto count = [](const auto& from, const auto& to) {
        return std::accumulate(
            from, to, std::size_t{0}, [](std::size_t sum, const auto& one) { return sum + one.second; });
    };
    const std::size_t differ = count(differ_.begin(), differ_.end());
    constexpr double most = 0.75;  // others may follow from rays that miss
    if (differ < fewest_paths || differ_.size() < few_primitives ||
        static_cast<double>(differ) < most * static_cast<double>(parted_))
        return {};
    const std::uint32_t first = differ_.begin()->first;
    const auto there = alike_.lower_bound(first);
    if (static_cast<double>(count(there, alike_.end())) > (1.0 - nearly_all) * static_cast<double>(differ)) return {};
    const auto of_the_kind =
        std::count_if(alike_.begin(), there, [&](const auto& one) { return kinds_[one.first] == kinds_[first]; });
    if (static_cast<std::size_t>(of_the_kind) < few_primitives) return {};
    const std::uint32_t begin = first / least_workgroup * least_workgroup;
    if (begin <= std::prev(there)->first || kinds_.size() - begin >= most_workgroup) return {};
    return fmt::format("paths part at the last {} of {} primitives alone", kinds_.size() - begin, kinds_.size());
}

}  // namespace tandem
