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
    // For the tree, of near lights (rule 32). axis: unit, or 0 for none.
    glm::dvec3 low{0.0}, high{0.0}, axis{0.0};
    double strength = 0.0;
};
[[nodiscard]] inline bool is_far(const LightDraft& light) { return light.kind >= LightKind::sun; }

// Points and spots, then suns, then the sampled background of a scene, without black ones.
[[nodiscard]] std::vector<LightDraft> distant_lights(const Scene& scene, const ImageEnvironment* environment);

// Grows the tree of the near lights, if there are two or more, and puts them in the order of its leaves.
template <class Real>
void grow_light_tree(std::vector<LightDraft>& lights, LightTree<Real>& tree);

// Fills the columns a light, and returns the probability of each. With a tree, that of near lights is N.
template <class Real>
std::vector<double> fill_light_table(
    LightTable<Real>& table, const std::vector<LightDraft>& lights, LightSampling sampling);

extern template void grow_light_tree<float>(std::vector<LightDraft>&, LightTree<float>&);
extern template void grow_light_tree<double>(std::vector<LightDraft>&, LightTree<double>&);
extern template std::vector<double> fill_light_table<float>(
    LightTable<float>&, const std::vector<LightDraft>&, LightSampling);
extern template std::vector<double> fill_light_table<double>(
    LightTable<double>&, const std::vector<LightDraft>&, LightSampling);

}  // namespace tandem::cpu
