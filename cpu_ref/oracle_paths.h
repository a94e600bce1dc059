// The oracle's light transport: camera (MODEL.md section 4), materials (7), background (8) and the estimator `path`
// (9.1), one sample at a time.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "common/renderer.h"
#include "common/scene.h"
#include "cpu_ref/oracle_geometry.h"

namespace tandem::oracle {

// A scene made ready for one set of settings; immutable, so any number of threads may ask it.
class PathSampler {
public:
    // Throws InputError for a camera that MODEL.md section 4 refuses.
    PathSampler(const Scene& scene, const RenderSettings& settings);

    // Radiance of sample `sample` of pixel (x, y): a function of (seed, pixel, sample) alone.
    [[nodiscard]] glm::dvec3 radiance(std::uint32_t x, std::uint32_t y, std::uint64_t sample) const;

    [[nodiscard]] const RenderSettings& settings() const { return settings_; }

private:
    [[nodiscard]] Ray camera_ray(std::uint32_t x, std::uint32_t y, std::uint64_t sample) const;
    [[nodiscard]] glm::dvec3 background(const glm::dvec3& direction) const;

    RenderSettings settings_;
    Camera camera_;
    Background background_;
    std::vector<Material> materials_;
    World world_;
    glm::dvec3 forward_, right_, upward_;  // the camera's frame
};

}  // namespace tandem::oracle
