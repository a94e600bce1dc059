#include "cpu_ref/oracle/lights.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cpu_ref/oracle/sampling.h"
#include "cpu_ref/oracle/textures.h"

namespace tandem::oracle {

using glm::dvec3;

dvec3 background_radiance(const Background& background, const dvec3& direction) {
    if (!background.image) return glm::mix(background.down, background.up, 0.5 * (direction.y + 1.0));
    const double angle = glm::radians(background.rotation_degrees);
    const dvec3 turned(std::cos(angle) * direction.x - std::sin(angle) * direction.z, direction.y,
        std::sin(angle) * direction.x + std::cos(angle) * direction.z);
    const double u = 0.5 + std::atan2(-turned.z, turned.x) / two_pi;
    const double v = std::acos(std::clamp(-turned.y, -1.0, 1.0)) / std::numbers::pi;
    return background.image_scale * bilinear(*background.image, u, v, Rows::held);
}

PunctualView punctual_view(const PunctualLight& light, const dvec3& from) {
    if (light.kind == PunctualKind::sun)
        return {-light.direction, std::numeric_limits<double>::infinity(), light.intensity};
    const dvec3 way = light.position - from;
    const double distance = glm::length(way);
    PunctualView view{way / distance, distance, light.intensity / (distance * distance)};
    if (light.kind == PunctualKind::spot) {
        const double inner = std::cos(glm::radians(light.inner_degrees));
        const double outer = std::cos(glm::radians(light.outer_degrees));
        const double cosine = -glm::dot(view.direction, light.direction);
        const double t = std::clamp((cosine - outer) / (inner - outer), 0.0, 1.0);
        view.irradiance *= t * t * (3.0 - 2.0 * t);
    }
    return view;
}

}  // namespace tandem::oracle
