// Which bodies a path is in (MODEL.md section 9.4).
#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/scene.h"

namespace tandem::oracle {

// Whether a path may go on to the other side of a surface of this material.
[[nodiscard]] bool lets_through(const Material& material);

// Whether the path keeps account of being inside bodies of this material.
[[nodiscard]] bool is_tracked(const Material& material);

// The list of tracked materials that a path is inside of.
class Interiors {
public:
    explicit Interiors(const Scene& scene) : scene_(&scene) {}

    // Index into Scene::media of the medium that the path is in, or no_index for none.
    [[nodiscard]] std::uint32_t medium() const;

    // At a tracked surface that is met on its front or back. It tells whether a body of greater priority hides the
    // surface, and the refractive index outside.
    struct Outside {
        bool hides;
        double refractive_index;
    };
    [[nodiscard]] Outside outside_of(std::uint32_t material, bool front) const;

    // The path goes on to the other side of a tracked surface. False if the list is full.
    [[nodiscard]] bool cross(std::uint32_t material, bool from_front);

private:
    void remove_latest(std::uint32_t material);
    // At a front of the material: what the list has beyond the bodies that the path can be in was left unseen.
    void remove_left_unseen(std::uint32_t material);
    [[nodiscard]] std::uint32_t uppermost() const;  // material, or no_index
    [[nodiscard]] std::int32_t priority_of(std::uint32_t material) const {
        return scene_->materials[material].priority.value_or(0);
    }

    const Scene* scene_;
    std::vector<std::uint32_t> inside_;  // indices into Scene::materials, the latest last
};

}  // namespace tandem::oracle
