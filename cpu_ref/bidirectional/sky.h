// The background as bidirectional path tracing needs it (MODEL.md sections 8.1 and 8.2).
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "cpu_ref/path_tracer/light/environment.h"

namespace tandem::cpu {

class Sky {
public:
    explicit Sky(const Background& background);

    [[nodiscard]] glm::dvec3 radiance(const glm::dvec3& direction) const;

    // Whether it is a sampled light, and then directions by two numbers and their density over solid angle.
    [[nodiscard]] bool is_light() const { return is_light_; }
    [[nodiscard]] glm::dvec3 sample(double v1, double v2) const;
    [[nodiscard]] double density(const glm::dvec3& direction) const;

private:
    glm::dvec3 down_, up_;
    std::optional<ImageEnvironment> image_;  // takes the place of the two
    bool is_light_;
};

}  // namespace tandem::cpu
