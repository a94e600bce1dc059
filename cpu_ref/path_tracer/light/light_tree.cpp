// The tree of near lights (MODEL.md section 9.2, rules 32 to 35).
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "common/rounding.h"
#include "cpu_ref/path_tracer/light/light_table.h"
#include "cpu_ref/path_tracer/vector_rows.h"

namespace tandem::cpu {

namespace {

using glm::dvec3;

template <class Real>
class Grower {
public:
    explicit Grower(const std::vector<LightDraft>& lights) : lights_(lights) {}

    void grow(std::span<std::uint32_t> own) {
        add_node(own);
        if (own.size() < 2) return;
        sort_along_axis(own);
        grow(own.first(own.size() / 2));
        grow(own.subspan(own.size() / 2));
    }

    void assign_to(LightTree<Real>& tree) const {
        centre_.assign_to(tree.centre);
        axis_.assign_to(tree.axis);
        tree.radius.assign(radius_);
        tree.cone_cosine.assign(cone_cosine_);
        std::vector<Real> shares;
        for (const double strength : strength_)
            shares.push_back(static_cast<Real>(rounded_to_single(strength / strength_.front())));
        tree.strength.assign(shares);
    }

private:
    void add_node(std::span<const std::uint32_t> own) {
        dvec3 low = lights_[own[0]].low, high = lights_[own[0]].high, axes(0.0);
        double strength = 0.0;
        bool to_all_sides = false;
        for (const std::uint32_t i : own) {
            const LightDraft& light = lights_[i];
            low = glm::min(low, light.low);
            high = glm::max(high, light.high);
            axes += light.axis;
            strength += light.strength;
            to_all_sides = to_all_sides || light.axis == dvec3(0.0);
        }
        const double length = glm::length(axes);
        to_all_sides = to_all_sides || length < 0x1p-10 * static_cast<double>(own.size());
        const dvec3 axis = to_all_sides ? dvec3(0.0) : axes / length;
        double cosine = to_all_sides ? -1.0 : 1.0;
        if (!to_all_sides)
            for (const std::uint32_t i : own) cosine = std::min(cosine, glm::dot(axis, lights_[i].axis));
        centre_.push_back(rounded_to_single(0.5 * (low + high)));
        radius_.push_back(static_cast<Real>(rounded_to_single(0.5 * glm::length(high - low))));
        axis_.push_back(rounded_to_single(axis));
        cone_cosine_.push_back(static_cast<Real>(rounded_to_single(cosine)));
        strength_.push_back(strength);
    }

    [[nodiscard]] dvec3 middle(std::uint32_t light) const { return 0.5 * (lights_[light].low + lights_[light].high); }

    void sort_along_axis(std::span<std::uint32_t> own) const {
        dvec3 low = middle(own[0]), high = low;
        for (const std::uint32_t i : own) {
            low = glm::min(low, middle(i));
            high = glm::max(high, middle(i));
        }
        const dvec3 extent = high - low;
        const double enough = (1.0 - 0x1p-20) * std::max({extent.x, extent.y, extent.z});
        const glm::length_t axis = extent.x >= enough ? 0 : extent.y >= enough ? 1 : 2;
        const auto place = [&](std::uint32_t light) {
            if (!(extent[axis] > 0.0)) return 0.0;
            return std::floor(0x1p20 * (middle(light)[axis] - low[axis]) / extent[axis] + 0.5);
        };
        std::ranges::sort(own, [&](std::uint32_t a, std::uint32_t b) {
            const double of_a = place(a), of_b = place(b);
            return of_a != of_b ? of_a < of_b : a < b;
        });
    }

    const std::vector<LightDraft>& lights_;
    VectorRows<Real> centre_, axis_;
    std::vector<Real> radius_, cone_cosine_;
    std::vector<double> strength_;
};

}  // namespace

template <class Real>
void grow_light_tree(std::vector<LightDraft>& lights, LightTree<Real>& tree) {
    const auto far = std::ranges::find_if(lights, [](const LightDraft& light) { return is_far(light); });
    std::vector<std::uint32_t> leaves(static_cast<std::size_t>(far - lights.begin()));
    if (leaves.size() < 2) return;
    std::iota(leaves.begin(), leaves.end(), 0u);
    Grower<Real> grower(lights);
    grower.grow(leaves);
    grower.assign_to(tree);
    tree.count = leaves.size();
    const std::vector<LightDraft> listed = lights;
    for (std::size_t i = 0; i < leaves.size(); ++i) lights[i] = listed[leaves[i]];
}

template void grow_light_tree<float>(std::vector<LightDraft>&, LightTree<float>&);
template void grow_light_tree<double>(std::vector<LightDraft>&, LightTree<double>&);

}  // namespace tandem::cpu
