#include "cpu_ref/bidirectional/sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cpu_ref/bidirectional/surfaces.h"

namespace tandem::cpu {

Sky::Sky(const Background& background) : down_(background.down), up_(background.up), is_light_(background.sampled) {
    if (background.image) image_.emplace(background);
    const bool black = image_ ? image_->black() : luminance(down_ + up_) == 0.0;
    if (is_light_ && black) is_light_ = false;
}

glm::dvec3 Sky::radiance(const glm::dvec3& direction) const {
    if (image_) return image_->radiance(direction);
    return glm::mix(down_, up_, 0.5 * (direction.y + 1.0));
}

glm::dvec3 Sky::sample(double v1, double v2) const {
    if (image_) return image_->sample(v1, v2).direction;
    const double down = luminance(down_), up = luminance(up_);
    const double divisor = down + std::sqrt(down * down + v1 * (up * up - down * down));
    const double y = 2.0 * (divisor > 0.0 ? v1 * (down + up) / divisor : 0.0) - 1.0;
    const glm::dvec2 ring = std::sqrt(std::max(0.0, 1.0 - y * y)) * disc_point(1.0, v2);
    return {ring.x, y, ring.y};
}

double Sky::density(const glm::dvec3& direction) const {
    if (image_) return image_->density(direction);
    const double down = luminance(down_), up = luminance(up_), a = 0.5 * (direction.y + 1.0);
    return std::max(0.0, glm::mix(down, up, a)) / (2.0 * std::numbers::pi * (down + up));
}

}  // namespace tandem::cpu
