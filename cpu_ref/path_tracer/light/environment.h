// The background as an image and as a light (MODEL.md sections 8.1 and 8.2), one direction at a time, in double.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "common/scene/scene.h"

namespace tandem::cpu {

class ImageEnvironment {
public:
    // background.image must be there. Only a sampled one makes the tables of sample() and density().
    explicit ImageEnvironment(const Background& background);

    [[nodiscard]] glm::dvec3 radiance(const glm::dvec3& direction) const;
    [[nodiscard]] bool black() const { return total_ <= 0.0; }  // of a sampled one
    struct Sample {
        glm::dvec3 direction;
        double density;  // over solid angle
    };
    [[nodiscard]] Sample sample(double v1, double v2) const;
    [[nodiscard]] double density(const glm::dvec3& direction) const;

private:
    [[nodiscard]] glm::dvec3 to_image(const glm::dvec3& direction) const;  // d' of section 8.1
    [[nodiscard]] double solid_angle(std::size_t row) const;               // of a cell
    std::shared_ptr<const Pixels> image_;
    double scale_, cosine_, sine_;  // of the rotation
    double total_ = 0.0;
    std::vector<double> shares_;      // of the cells, row by row
    std::vector<double> row_sums_;    // cumulative within a row
    std::vector<double> cumulative_;  // of the rows
};

}  // namespace tandem::cpu
