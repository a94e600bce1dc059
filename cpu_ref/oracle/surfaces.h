// The oracle's materials (MODEL.md section 7).
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "common/scene/scene.h"
#include "cpu_ref/oracle/sampling.h"

namespace tandem::oracle {

// How a ray meets a surface.
struct Incidence {
    glm::dvec3 direction;  // d
    bool front;
    glm::dvec3 near_normal;  // n_f
    double cosine;           // c
};
[[nodiscard]] Incidence incidence_of(const glm::dvec3& direction, const glm::dvec3& front_normal);
// The same by the shading normal, which a vertex normal gives in place of n_f (section 5.4).
[[nodiscard]] Incidence shaded_incidence(const Incidence& flat, const glm::dvec3& vertex_normal);
// Whether a direction is on the same side of both normals.
[[nodiscard]] bool is_on_one_side(const Incidence& flat, const Incidence& shaded, const glm::dvec3& direction);

// The surface at a hit: its material, the colour C there, and n_incident / n_transmitted if it is translucent.
struct Surface {
    const Material& material;
    glm::dvec3 colour;
    double relative_index;
    Incidence in;
};

// Radiance emitted towards where the ray comes from.
[[nodiscard]] glm::dvec3 emitted(const Material& material, bool front);
[[nodiscard]] bool ends_path(const Material& material);

// A new direction, and the factor by which the throughput changes. The density per solid angle is there where the model
// has one (for `trace`; the estimator needs none).
struct Scattering {
    glm::dvec3 direction;
    glm::dvec3 weight;
    double pdf = 0.0;
};
// Nothing where the path ends.
[[nodiscard]] std::optional<Scattering> scatter(const Surface& surface, const Numbers& u);

// f cos theta towards a direction, of the materials for which it is known: all but deltas, fuzz and rough glass.
[[nodiscard]] bool has_known_scattering(const Material& material);
[[nodiscard]] glm::dvec3 scattered_share(const Surface& surface, const glm::dvec3& towards);

}  // namespace tandem::oracle
