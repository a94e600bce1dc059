// One path as a renderer followed it, vertex by vertex, for `tandem trace`.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <string>
#include <vector>

#include "common/scene/scene.h"

namespace tandem {

// Why a path ends at a vertex (MODEL.md section 9).
enum class PathEnd : std::uint32_t {
    goes_on = 0,
    left_scene,    // nothing was hit
    emitter,       // the material only emits
    bounces,       // no scattering events are left
    roulette,      // chosen to end (9.3)
    absorbed,      // scattering gave no direction, or no light would be left
    direct_light,  // the integrator whitted goes no further (9.5)
    invalid        // a ninth body (9.4)
};

// What befell the path from one vertex to the next.
struct TracedVertex {
    glm::dvec3 origin{0.0}, direction{0.0};                   // of the ray that arrives
    double t = std::numeric_limits<double>::infinity();       // its length; infinite where it met nothing
    glm::dvec3 position{0.0}, normal{0.0};                    // where it ends; normal to the front, zero off surfaces
    std::uint32_t primitive = no_index, material = no_index;  // primitive id (MODEL.md section 5)
    bool in_medium = false;                                   // scattered before any surface (section 10)
    glm::dvec3 throughput{1.0};                               // A of the arriving ray, the medium on its way included
    glm::dvec3 radiance{0.0};                                 // gathered until here, this vertex included
    PathEnd end = PathEnd::goes_on;
    // Where the path goes on: the new direction and its density per solid angle (0 where directions are only sampled,
    // as a mirror's). A is that of the new ray, roulette included.
    glm::dvec3 next_direction{0.0}, next_throughput{0.0};
    double pdf = 0.0;
    // Next event (9.2): the direction in which a light was sampled, and what that brought; zero: none.
    glm::dvec3 light_direction{0.0}, light{0.0};
    bool operator==(const TracedVertex&) const = default;
};

struct PathTrace {
    std::vector<TracedVertex> vertices;
    glm::dvec3 radiance{0.0};  // of the sample, as the renderer has it before section 12
};

// The factor by which the vertex changed A, roulette included; 0 in channels that brought nothing.
[[nodiscard]] glm::dvec3 weight_of(const TracedVertex& vertex);

// What happened, as one would say it: "reflected", "scattered in a medium", "left the scene", "ended by roulette".
[[nodiscard]] std::string event_name(const Scene& scene, const TracedVertex& vertex);

}  // namespace tandem
