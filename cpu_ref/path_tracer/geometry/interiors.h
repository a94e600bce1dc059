// The bodies that contain a path's end, and which of them has priority (MODEL.md section 9.4).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/scene/scene.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

// What section 9.4 wants to know of a material.
struct BodyForm {
    bool tracked = false;
    std::uint32_t medium = no_index;
    std::int32_t priority = 0;
    double refractive_index = 1.0;   // 1 for a boundary
    std::uint32_t count = no_index;  // of spheres and cuboids; no_index if there are triangles of it, too
};

inline constexpr std::uint32_t most_interiors = 8;

// Tracked materials in the order of entry.
struct InteriorList {
    std::array<std::uint32_t, most_interiors> material{};
    std::uint32_t count = 0;

    // Takes the latest entry of `gone` out, if there is one.
    void remove(std::uint32_t gone) {
        if (planted(PlantedBug::body_not_left)) return;
        std::uint32_t at = count;
        while (at > 0 && material[at - 1] != gone) --at;
        if (at > 0) remove_entry(at - 1);
    }
    // A path that meets a front of `entered` is outside of that body. If the list has all `existing` ones, rounding hid
    // how the path left one: the earliest entry goes.
    void remove_left_unseen(std::uint32_t entered, std::uint32_t existing) {
        const auto end = material.begin() + count;
        if (std::count(material.begin(), end, entered) < static_cast<std::ptrdiff_t>(existing)) return;
        const auto earliest = std::find(material.begin(), end, entered);
        if (earliest != end) remove_entry(static_cast<std::uint32_t>(earliest - material.begin()));
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

private:
    void remove_entry(std::uint32_t at) {
        for (std::uint32_t i = at + 1; i < count; ++i) material[i - 1] = material[i];
        --count;
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
    if (front)
        list.remove_left_unseen(material, bodies[material].count);
    else
        list.remove(material);
    const std::uint32_t around = list.uppermost(bodies);
    if (around == no_index) return {};
    return {bodies[around].priority <= bodies[material].priority, bodies[around].refractive_index};
}

}  // namespace tandem::cpu
