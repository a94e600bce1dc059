// Emitting primitives as sampled lights (MODEL.md section 9.2): areas, powers, and the planar patches on which points
// are sampled. Also the densities of their faces.
#include <array>
#include <glm/glm.hpp>

#include "cpu_ref/path_tracer/table_builder.h"

namespace tandem::cpu {

// Notes a sampled light (section 9.2) if this primitive is one.
template <class Real>
bool TableBuilder<Real>::add_light(LightKind kind, double area, std::uint32_t sphere, const dvec3& normal) {
    const Material& material = scene_.materials[material_];
    const double sum = (material.radiance.x + material.radiance.y + material.radiance.z) *
                       (material.translucent ? material.alpha : 1.0);
    if ((material.translucent && is_tracked(material)) || !(sum > 0.0) || !(area > 0.0)) return false;
    lights_.push_back({kind, id_, material_, static_cast<std::uint32_t>(patch_face_.size()), sphere, area, area * sum,
        scene_.entities[entity_].motion, {}});
    // Rule 32: flat lights have an axis, if they emit to one side.
    LightDraft& light = lights_.back();
    const bool flat = kind == LightKind::triangle, two_sided = material.sides == EmittingSides::both;
    light.low = glm::min(tables_.bounds.back().low, tables_.bounds.back().low + light.motion);
    light.high = glm::max(tables_.bounds.back().high, tables_.bounds.back().high + light.motion);
    if (flat && !two_sided) light.axis = normal;
    light.strength = light.weight * (!flat ? 0.25 : two_sided ? 0.5 : 1.0);
    return true;
}

template <class Real>
void TableBuilder<Real>::add_patch(
    const dvec3& corner, const dvec3& edge1, const dvec3& edge2, double cumulative, std::uint32_t face) {
    patch_corner_.push_back(corner);
    patch_edge1_.push_back(edge1);
    patch_edge2_.push_back(edge2);
    patch_cumulative_.push_back(static_cast<Real>(cumulative));
    patch_face_.push_back(face);
}

template <class Real>
void TableBuilder<Real>::add_cuboid_patches(
    const dvec3& low, const dvec3& high, const std::array<double, 6>& areas, double total) {
    double cumulative = 0.0;
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2, j = axis == 0 ? 1 : 0, k = axis == 2 ? 1 : 2;
        dvec3 corner = low;
        corner[axis] = face % 2 == 0 ? low[axis] : high[axis];
        cumulative += areas[static_cast<std::size_t>(face)];
        if (planted(PlantedBug::cuboid_light_faces_even)) cumulative = total * (face + 1) / 6.0;
        add_patch(to_world(corner), map_.linear[j] * (high[j] - low[j]), map_.linear[k] * (high[k] - low[k]),
            cumulative / total, face_count() - 6 + static_cast<std::uint32_t>(face));
    }
}

template <class Real>
void TableBuilder<Real>::finish_lights() {
    LightTable<Real>& table = tables_.lights;
    for (const LightDraft& light : distant_lights(scene_, tables_.environment.get())) lights_.push_back(light);
    const LightSampling sampling = tables_.settings.light_sampling;
    if (sampling == LightSampling::tree) grow_light_tree(lights_, table.tree);
    const std::vector<double> chances = fill_light_table(table, lights_, sampling);
    if (table.tree.count > 0) face_light_.assign(face_density_.size(), Unsigned{0});
    for (std::size_t i = 0; i < lights_.size(); ++i) {
        const LightDraft& light = lights_[i];
        if (light.kind > LightKind::ellipsoid) continue;
        const PrimitiveRef& ref = tables_.primitives[light.primitive];
        const std::uint32_t face_count_of = ref.kind == PrimitiveKind::triangle ? 1
                                            : ref.kind == PrimitiveKind::sphere ? 2
                                                                                : 6;
        for (std::uint32_t f = 0; f < face_count_of; ++f) {
            face_density_[ref.first_face + f] = static_cast<Real>(chances[i] / light.area);
            if (table.tree.count > 0) face_light_[ref.first_face + f] = static_cast<Unsigned>(i);
        }
        if (tables_.primitives[light.primitive].kind == PrimitiveKind::sphere)
            sphere_chance_[light.sphere] = static_cast<Real>(chances[i]);
    }
    patch_corner_.assign_to(table.patch_corner);
    patch_edge1_.assign_to(table.patch_edge1);
    patch_edge2_.assign_to(table.patch_edge2);
    table.patch_cumulative.assign(patch_cumulative_);
    table.patch_face.assign(patch_face_);
}

template bool TableBuilder<float>::add_light(LightKind, double, std::uint32_t, const dvec3&);
template bool TableBuilder<double>::add_light(LightKind, double, std::uint32_t, const dvec3&);
template void TableBuilder<float>::add_patch(const dvec3&, const dvec3&, const dvec3&, double, std::uint32_t);
template void TableBuilder<double>::add_patch(const dvec3&, const dvec3&, const dvec3&, double, std::uint32_t);
template void TableBuilder<float>::add_cuboid_patches(const dvec3&, const dvec3&, const std::array<double, 6>&, double);
template void TableBuilder<double>::add_cuboid_patches(
    const dvec3&, const dvec3&, const std::array<double, 6>&, double);
template void TableBuilder<float>::finish_lights();
template void TableBuilder<double>::finish_lights();

}  // namespace tandem::cpu
