// Participating media (MODEL.md section 10): optical depth along a ray and its inverse. They are exact in homogeneous
// media and cell by cell in grids; one ray at a time, in double.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "common/scene/scene.h"

namespace tandem::cpu {

struct MediumRay {
    glm::dvec3 origin, direction;  // unit
};

class MediumForm {
public:
    explicit MediumForm(const Medium& medium);

    // N(length) = integral of the density over the first `length` (may be infinite) of the ray.
    [[nodiscard]] double density_integral(const MediumRay& ray, double length) const;
    // The least t <= length with N(t) = target, or infinity.
    [[nodiscard]] double distance_to(const MediumRay& ray, double length, double target) const;
    // T(length), a channel.
    [[nodiscard]] glm::dvec3 transmittance(const MediumRay& ray, double length) const;

    struct Step {
        bool scattered;
        double t;  // where
        glm::dvec3 weight;
    };
    // The way to `end`, by the numbers m1 and m2 of the medium's block.
    [[nodiscard]] Step advance(const MediumRay& ray, double end, double m1, double m2) const;

    [[nodiscard]] bool scatters() const { return scatters_; }
    [[nodiscard]] double anisotropy() const { return anisotropy_; }

private:
    [[nodiscard]] glm::dvec3 attenuation(double integral) const;  // exp(-sigma_t N), 1 where sigma_t = 0
    template <class Visit>
    void walk(const MediumRay& ray, double length, Visit visit) const;

    glm::dvec3 scattering_, extinction_;
    double anisotropy_;
    bool scatters_;
    std::shared_ptr<const DensityGrid> grid_;
};

}  // namespace tandem::cpu
