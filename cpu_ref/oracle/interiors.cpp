#include "cpu_ref/oracle/interiors.h"

#include <algorithm>

namespace tandem::oracle {

bool lets_through(const Material& material) { return material.translucent || material.kind == MaterialKind::boundary; }

bool is_tracked(const Material& material) {
    return lets_through(material) && (material.interior != no_index || material.priority);
}

std::uint32_t Interiors::uppermost() const {
    std::uint32_t found = no_index;
    for (const std::uint32_t material : inside_)
        if (found == no_index || priority_of(material) >= priority_of(found)) found = material;
    return found;
}

std::uint32_t Interiors::medium() const {
    const std::uint32_t material = uppermost();
    return material == no_index ? scene_->medium : scene_->materials[material].interior;
}

Interiors::Outside Interiors::outside_of(std::uint32_t material, bool front) const {
    Interiors others = *this;
    if (front)
        others.remove_left_unseen(material);
    else
        others.remove_latest(material);
    const std::uint32_t neighbour = others.uppermost();
    if (neighbour == no_index) return {false, 1.0};
    const Material& outer = scene_->materials[neighbour];
    return {priority_of(neighbour) > priority_of(material),
        outer.kind == MaterialKind::boundary ? 1.0 : outer.refractive_index};
}

bool Interiors::cross(std::uint32_t material, bool from_front) {
    constexpr std::size_t most = 8;
    if (!from_front) {
        remove_latest(material);
        return true;
    }
    remove_left_unseen(material);
    if (inside_.size() == most) return false;
    inside_.push_back(material);
    return true;
}

void Interiors::remove_latest(std::uint32_t material) {
    const auto latest = std::find(inside_.rbegin(), inside_.rend(), material);
    if (latest != inside_.rend()) inside_.erase(std::next(latest).base());
}

void Interiors::remove_left_unseen(std::uint32_t material) {
    const auto earliest = std::find(inside_.begin(), inside_.end(), material);
    if (earliest == inside_.end()) return;
    std::ptrdiff_t existing = 0;
    for (const Entity& entity : scene_->entities) {
        if (entity.material != material) continue;
        existing += entity.primitive_count;
        for (std::uint32_t i = 0; i < entity.primitive_count; ++i)
            if (scene_->primitives[entity.first_primitive + i].kind == PrimitiveKind::triangle) return;
    }
    if (std::count(inside_.begin(), inside_.end(), material) >= existing) inside_.erase(earliest);
}

}  // namespace tandem::oracle
