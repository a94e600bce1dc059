#include "common/view/camera_control.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

namespace tandem {

namespace {

using glm::dvec3;

// [Rodrigues' formula]; `axis` is a unit vector.
dvec3 rotated(const dvec3& v, const dvec3& axis, double angle) {
    const double c = glm::cos(angle);
    return c * v + glm::sin(angle) * glm::cross(axis, v) + (1.0 - c) * glm::dot(axis, v) * axis;
}

// `v` turned by `right` about `pole`, then by `up` towards it. `v` is not 0.
dvec3 turned_vector(const dvec3& v, const dvec3& pole, double right, double up) {
    const double height = glm::asin(std::clamp(glm::dot(glm::normalize(v), pole), -1.0, 1.0));
    const double most = glm::radians(89.0);
    const dvec3 level = rotated(v, pole, right);
    const dvec3 side = glm::cross(level, pole);
    if (glm::dot(side, side) == 0.0) return level;  // along the pole, which no scene has (check_settings)
    // A camera that begins nearer to a pole may come away from it, but no nearer.
    const double aim = std::clamp(height + up, std::min(height, -most), std::max(height, most));
    return rotated(level, glm::normalize(side), aim - height);
}

}  // namespace

Camera orbited(Camera camera, double right, double up) {
    const dvec3 back = camera.position - camera.target;
    camera.position = camera.target + turned_vector(back, glm::normalize(camera.up), -right, up);
    return camera;
}

Camera turned(Camera camera, double right, double up) {
    const dvec3 view = camera.target - camera.position;
    camera.target = camera.position + turned_vector(view, glm::normalize(camera.up), -right, up);
    return camera;
}

Camera moved(Camera camera, const dvec3& by) {
    const dvec3 view = camera.target - camera.position;
    const double distance = glm::length(view);
    const dvec3 forward = view / distance;
    const dvec3 right = glm::normalize(glm::cross(forward, camera.up));
    const dvec3 step = distance * (by.x * right + by.y * glm::cross(right, forward) + by.z * forward);
    camera.position += step;
    camera.target += step;
    return camera;
}

Camera approached(Camera camera, double factor) {
    const dvec3 back = camera.position - camera.target;
    camera.position = camera.target + factor * back;
    const double focus = camera.focus_distance + (factor - 1.0) * glm::length(back);
    camera.focus_distance = focus > 0.0 ? focus : factor * camera.focus_distance;  // never behind the lens
    return camera;
}

}  // namespace tandem
