// How surfaces scatter, for paths from both ends (MODEL.md sections 7 and 9.6): one point at a time, in double.
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "common/scene/scene.h"

namespace tandem::cpu {

// Y (sections 8.2 and 9.2).
[[nodiscard]] inline double luminance(const glm::dvec3& colour) { return colour.x + colour.y + colour.z; }

// What is known of a material's lobe. A connection needs a known one. A lobe that is only sampled, from the camera's
// side, has no known transpose: a subpath from a light ends there.
enum class Lobe { known, delta, sampled_only };
[[nodiscard]] Lobe lobe_of(const Material& material);

// A surface that a path has come to.
struct Reached {
    const Material* material = nullptr;
    glm::dvec3 colour{1.0};
    glm::dvec3 normal{0.0};  // to the front, unit
    glm::dvec3 back{0.0};    // unit, to where the path came from
    [[nodiscard]] bool front() const { return glm::dot(back, normal) > 0.0; }
    [[nodiscard]] glm::dvec3 facing() const { return front() ? normal : -normal; }
};

// f and the density over solid angle of scattering towards `out`. For a delta lobe: the density by which the two ends'
// specular scattering compare, n^2 |cos| on the side of `out`. Both ends choose between reflection and refraction
// alike.
[[nodiscard]] glm::dvec3 scattering_value(const Reached& at, const glm::dvec3& out);
[[nodiscard]] double scattering_density(const Reached& at, const glm::dvec3& out);

// From which end the path comes. Light that is refracted into index n carries 1/n^2 of the radiance, which the paths
// from the camera leave out (section 7.4).
enum class Transport { from_camera, from_light };

struct ScatteredPath {
    glm::dvec3 direction;
    glm::dvec3 weight;  // the throughput's factor
    double density;     // scattering_density
};
// By three numbers; nothing where the path ends.
[[nodiscard]] std::optional<ScatteredPath> scatter_path(
    const Reached& at, const glm::dvec3& numbers, Transport transport);

// The frame of a unit vector (section 3.1), and directions from numbers.
[[nodiscard]] glm::dvec3 in_frame_of(const glm::dvec3& normal, const glm::dvec3& local);
[[nodiscard]] glm::dvec3 cosine_direction(const glm::dvec3& normal, double a, double b);
[[nodiscard]] glm::dvec3 sphere_direction(double a, double b);
[[nodiscard]] glm::dvec2 disc_point(double a, double b);

}  // namespace tandem::cpu
