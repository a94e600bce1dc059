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

// A light that was sampled (9.2). Where it was seen it brought A f L T w / p, and all is told.
struct TracedLight {
    glm::dvec3 direction{0.0};      // to it: wherever a shadow ray was sent
    glm::dvec3 radiance{0.0};       // L; of lights without a surface what MODEL.md 8.3 has in its place
    double pdf = 0.0;               // p, of the direction, the choice of the light included
    glm::dvec3 response{0.0};       // f with its cosine
    glm::dvec3 transmittance{1.0};  // T of the medium on the way
    double weight = 0.0;            // w against scattering
    bool operator==(const TracedLight&) const = default;
};

// What befell the path from one vertex to the next. Zero: what a renderer does not tell of.
struct TracedVertex {
    glm::dvec3 origin{0.0}, direction{0.0};                   // of the ray that arrives
    double t = std::numeric_limits<double>::infinity();       // its length; infinite where it met nothing
    glm::dvec3 position{0.0}, normal{0.0};                    // where it ends; normal to the front, zero off surfaces
    glm::dvec3 shading_normal{0.0};                           // on the side that the ray comes from (5.4)
    std::uint32_t primitive = no_index, material = no_index;  // primitive id (MODEL.md section 5)
    bool in_medium = false;                                   // scattered before any surface (section 10)
    glm::dvec3 throughput{1.0};                               // A of the arriving ray, the medium on its way included
    glm::dvec3 radiance{0.0};                                 // gathered until here, this vertex included
    PathEnd end = PathEnd::goes_on;
    // Where the path goes on: the new direction and its density per solid angle (0 where directions are only sampled,
    // as a mirror's). A is that of the new ray, roulette included.
    glm::dvec3 next_direction{0.0}, next_throughput{0.0};
    double pdf = 0.0;
    double survival = 0.0;      // the chance that roulette left it (9.3)
    double found_weight = 0.0;  // W of light that scattering found (9.2)
    glm::dvec3 light{0.0};      // what a next event brought; zero: none
    TracedLight next_event{};   // and how
    bool operator==(const TracedVertex&) const = default;
};

struct PathTrace {
    std::vector<TracedVertex> vertices;
    glm::dvec3 radiance{0.0};  // of the sample, as the renderer has it before section 12
};

// A random number that is taken to be another one, in all paths traced: one bit of its word is turned over. So it shows
// what it decides.
struct ChangedNumber {
    std::uint32_t block = no_index;  // of MODEL.md section 3; no_index: none
    std::uint32_t number = 0;        // 0 ... 3 in the block
    std::uint32_t bit = 31;          // 8 ... 31: u changes by 2^(bit - 32)
};

// The factor by which the vertex changed A, roulette included; 0 in channels that brought nothing.
[[nodiscard]] glm::dvec3 weight_of(const TracedVertex& vertex);

// What happened, as one would say it: "reflected", "scattered in a medium", "left the scene", "ended by roulette".
[[nodiscard]] std::string event_name(const Scene& scene, const TracedVertex& vertex);

}  // namespace tandem
