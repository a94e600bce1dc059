// Rays, and the camera that they begin at (MODEL.md section 4).
#pragma once

#include "common/scene/scene.h"
#include "cpu_ref/first_tracer/sampling.h"

namespace tandem::first {

// Points p(t) = origin + t direction, the direction of unit length.
struct Ray {
    dvec3 origin, direction;
    std::uint32_t left = no_index;  // the primitive that the ray starts on; none at the camera
    bool inwards = false;           // it starts into that primitive, not away from its front
};

// Through a random point of a pixel, and of the lens.
inline Ray camera_ray(const Camera& camera, const RenderSettings& s, std::uint32_t pixel, std::uint64_t sample) {
    const Numbers u = numbers(s, pixel, sample, dimension::film_and_lens);
    const double width = s.width, height = s.height, x = pixel % s.width, y = pixel / s.width;

    // The camera's own axes: forward, to the right, up.
    const dvec3 f = glm::normalize(camera.target - camera.position);
    const dvec3 r = glm::normalize(glm::cross(f, camera.up));
    const dvec3 v = glm::cross(r, f);

    // q points to the sample's place on a film one unit in front of the camera.
    const double h = std::tan(0.5 * glm::radians(camera.vertical_field_degrees));
    const dvec3 q = f + h * (width / height) * (2.0 * (x + u.first) / width - 1.0) * r +
                    h * (1.0 - 2.0 * (y + u.second) / height) * v;
    if (camera.lens_radius == 0.0) return {camera.position, glm::normalize(q)};

    // A thin lens sends all rays of a film point through one point of the plane in focus.
    const dvec2 on_lens = camera.lens_radius * disc(u.third, u.fourth);
    const dvec3 origin = camera.position + on_lens.x * r + on_lens.y * v;
    return {origin, glm::normalize(camera.position + camera.focus_distance * q - origin)};
}

}  // namespace tandem::first
