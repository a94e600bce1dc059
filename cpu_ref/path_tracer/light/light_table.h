// The list of sampled lights and their probabilities (MODEL.md section 9.2).
#pragma once

#include <vector>

#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

// A light on its way into the table. Which fields count depends on `kind`.
struct LightDraft {
    LightKind kind = LightKind::triangle;
    std::uint32_t primitive = no_primitive, material = 0, first_patch = 0, sphere = 0;  // surfaces
    double area = 0.0;                                                                  // surfaces: in the world
    double weight = 0.0;                                                                // near lights
    glm::dvec3 motion{0.0};                                                             // surfaces
    PunctualLight punctual{};                                                           // points, spots, suns
};

// Points and spots, then suns, then the sampled background of a scene, without black ones.
[[nodiscard]] std::vector<LightDraft> distant_lights(const Scene& scene, const ImageEnvironment* environment);

// Fills the columns a light, and returns the probability of each.
template <class Real>
std::vector<double> fill_light_table(LightTable<Real>& table, const std::vector<LightDraft>& lights);

extern template std::vector<double> fill_light_table<float>(LightTable<float>&, const std::vector<LightDraft>&);
extern template std::vector<double> fill_light_table<double>(LightTable<double>&, const std::vector<LightDraft>&);

}  // namespace tandem::cpu
