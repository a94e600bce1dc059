// Builds the tables of tables.h from a Scene (MODEL.md sections 4 to 9.2). Everything is computed in double, then
// rounded. Each primitive adds rows, which become columns at the end. The members are defined in three files:
// - tables.cpp: the order of work, materials, textures, media and camera.
// - primitive_tables.cpp: triangles, spheres and cuboids, and their faces.
// - light/surface_lights.cpp: emitting primitives as sampled lights.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "cpu_ref/path_tracer/light/light_table.h"
#include "cpu_ref/path_tracer/vector_rows.h"

namespace tandem::cpu {

// Whether paths keep track of being inside such bodies (MODEL.md section 9.4).
[[nodiscard]] inline bool is_tracked(const Material& material) {
    const bool has_inside = material.translucent || material.kind == MaterialKind::boundary;
    return has_inside && (material.interior != no_index || material.priority);
}

template <class Real>
class TableBuilder {
public:
    TableBuilder(const Scene& scene, const RenderSettings& settings)
        : scene_(scene), placed_(placed_meshes(scene, settings)) {
        tables_.settings = settings;
        if (placed_.any()) tables_.meshes = std::make_shared<MeshTable>(scene, placed_);
        const IntersectionSettings& chosen = settings.intersection;
        tables_.default_kernels =
            chosen.triangles == TriangleKernel::watertight && chosen.convex == ConvexKernel::stable;
        tables_.excludes_left =
            chosen.guard == SelfIntersectionGuard::error_bound || chosen.guard == SelfIntersectionGuard::exclusion;
    }

    Tables<Real> build();

private:
    using dvec3 = glm::dvec3;

    // tables.cpp
    void add_surroundings();
    void add_motion();
    void add_materials();
    void count_bodies();  // of every material
    void add_camera();
    void add_interval();

    // primitive_tables.cpp
    void add(const PlacedPrimitive& placed);
    // A face of a sphere or cuboid, which has no edges.
    TriangleFace<Real> face_on(const dvec3& object_normal, const dvec3& point, double extent);
    void add_face(const TriangleFace<Real>& face, std::uint32_t sphere, bool curved);
    std::uint32_t add_triangle(const Primitive& primitive);
    std::uint32_t add_sphere(const Primitive& primitive);
    std::uint32_t add_cuboid(const Primitive& primitive);
    void finish_faces();
    void finish_spheres();

    // light/surface_lights.cpp
    // Notes a sampled light (section 9.2) if this primitive is one.
    bool add_light(LightKind kind, double area, std::uint32_t sphere, const dvec3& normal = dvec3(0.0));
    void add_patch(const dvec3& corner, const dvec3& edge1, const dvec3& edge2, double cumulative, std::uint32_t face);
    void add_cuboid_patches(const dvec3& low, const dvec3& high, const std::array<double, 6>& areas, double total);
    void finish_lights();

    [[nodiscard]] dvec3 to_world(const dvec3& p) const { return map_.to_world(p); }
    [[nodiscard]] std::uint32_t face_count() const { return static_cast<std::uint32_t>(face_material_.size()); }

    const Scene& scene_;
    PlacedMeshes placed_;
    Tables<Real> tables_;
    EntityMap map_;
    std::uint32_t id_ = 0, material_ = 0, entity_ = 0;

    using Unsigned = UnsignedOf<Real>;
    VectorRows<Real> face_normal_, face_terms_;
    std::array<VectorRows<Real>, 3> edge_normal_;
    std::array<std::vector<Real>, 3> edge_offset_;
    std::vector<Real> least_height_;
    std::vector<Real> face_offset_, face_extent_, face_terms_of_extent_, face_density_;
    std::vector<Unsigned> face_primitive_, face_material_, face_sphere_, face_curved_, face_entity_, face_light_;
    std::array<VectorRows<Real>, 3> sphere_to_local_, sphere_to_world_, sphere_normal_;
    VectorRows<Real> sphere_shift_, sphere_centre_;
    std::vector<Real> sphere_radius_, sphere_extent_, sphere_chance_;
    std::vector<LightDraft> lights_;
    VectorRows<Real> patch_corner_, patch_edge1_, patch_edge2_;
    std::vector<Real> patch_cumulative_;
    std::vector<Unsigned> patch_face_;
};

}  // namespace tandem::cpu
