// The bodies that a path is inside of, and which of them rules (MODEL.md section 9.4).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/scene.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

// What section 9.4 wants to know of a material.
struct BodyForm {
    bool tracked = false;
    std::uint32_t medium = no_index;
    std::int32_t priority = 0;
    double refractive_index = 1.0;  // 1 for a boundary
};

inline constexpr std::uint32_t most_interiors = 4;

// Tracked materials in the order of entry.
struct InteriorList {
    std::array<std::uint32_t, most_interiors> material{};
    std::uint32_t count = 0;

    // Takes the latest entry of `gone` out, if there is one.
    void remove(std::uint32_t gone) {
        if (planted(PlantedBug::body_not_left)) return;
        std::uint32_t at = count;
        while (at > 0 && material[at - 1] != gone) --at;
        if (at == 0) return;
        for (std::uint32_t i = at; i < count; ++i) material[i - 1] = material[i];
        --count;
    }
    // False if there is no room.
    [[nodiscard]] bool append(std::uint32_t entered) {
        if (count == most_interiors) return false;
        material[count++] = entered;
        return true;
    }
    // The entry of greatest priority, of equal ones the latest; no_index if there is none.
    [[nodiscard]] std::uint32_t uppermost(const std::vector<BodyForm>& bodies) const {
        std::uint32_t best = no_index;
        for (std::uint32_t i = 0; i < count; ++i)
            if (best == no_index || bodies[material[i]].priority >= bodies[best].priority) best = material[i];
        return best;
    }
};

// What a path on one side of a tracked surface of `material` finds: is the surface there at all, and the index on its
// outside.
struct Interface {
    bool present = true;
    double outside_index = 1.0;
};
[[nodiscard]] inline Interface interface_at(
    InteriorList list, const std::vector<BodyForm>& bodies, std::uint32_t material, bool front) {
    if (!front) list.remove(material);
    if (planted(PlantedBug::priority_ignored))
        return {true, list.count > 0 ? bodies[list.material[list.count - 1]].refractive_index : 1.0};
    const std::uint32_t around = list.uppermost(bodies);
    if (around == no_index) return {};
    return {bodies[around].priority <= bodies[material].priority, bodies[around].refractive_index};
}

}  // namespace tandem::cpu
