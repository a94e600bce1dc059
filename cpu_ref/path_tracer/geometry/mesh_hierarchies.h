// What Embree holds of meshes that several entities place (mesh_table.h). Each mesh has a hierarchy, in object space
// about its middle. Each place is one box in the scene's hierarchy. Rays are traced in mesh_traversal.h.
#pragma once

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "cpu_ref/path_tracer/geometry/embree.h"
#include "cpu_ref/path_tracer/geometry/mesh_table.h"

namespace tandem::cpu {

inline constexpr std::uint32_t native_geometry = 0, user_geometry = 1, place_geometry = 2;  // Embree's geomID

// A float no less than `a`, so that Embree culls nothing at `a`.
[[nodiscard]] inline float round_up(double a) {
    const float rounded = static_cast<float>(a);
    return static_cast<double>(rounded) < a ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : rounded;
}
[[nodiscard]] inline float round_down(double a) { return -round_up(-a); }

// The circle within a triangle that touches its sides.
struct Incircle {
    glm::dvec3 centre;
    double radius;
};
[[nodiscard]] inline Incircle incircle_of(const std::array<glm::dvec3, 3>& c) {
    const double a = glm::distance(c[1], c[2]), b = glm::distance(c[2], c[0]), e = glm::distance(c[0], c[1]);
    const double perimeter = a + b + e;
    if (!(perimeter > 0.0)) return {c[0], 0.0};
    return {
        (a * c[0] + b * c[1] + e * c[2]) / perimeter, glm::length(glm::cross(c[1] - c[0], c[2] - c[0])) / perimeter};
}

// What Embree calls for a ray at a place, at user geometry of a mesh, and at its native triangles.
struct MeshCallbacks {
    RTCIntersectFunctionN place_closest, user_closest;
    RTCOccludedFunctionN place_occluded, user_occluded;
    RTCFilterFunctionN filter_closest, filter_occluded;
};

// To be called before a geometry is committed. Embree builds scenes of low quality from trees of their geometries, each
// of its own quality.
inline void set_build_quality(RTCGeometry geometry, RTCBuildQuality of_scene) {
    if (of_scene == RTC_BUILD_QUALITY_LOW) rtcSetGeometryBuildQuality(geometry, of_scene);
}

template <class Real>
class MeshHierarchies {
public:
    struct Mesh {
        embree::Scene scene;
        std::vector<std::uint32_t> native, user;  // triangles of the mesh by Embree's primID
        glm::dvec3 middle{0.0};
        double radius = 0.0, inflation = 0.0;  // object space: of a sphere around all; of bounds
        const Corners* corners = nullptr;      // while it is built, of user triangles, about the middle
    };

    // `reach`: the largest coordinate of scene and camera; `widening`: of boxes in the world. The table must outlive
    // this. Throws Error if Embree fails.
    MeshHierarchies(RTCDevice device, const MeshTable& table, double reach, double widening, RTCBuildQuality quality,
        const MeshCallbacks& callbacks);

    MeshHierarchies(const MeshHierarchies&) = delete;  // Embree knows its address
    MeshHierarchies& operator=(const MeshHierarchies&) = delete;

    void attach_places(RTCDevice device, RTCScene scene);

    [[nodiscard]] const Mesh& mesh(std::uint32_t index) const { return meshes_[index]; }
    [[nodiscard]] const MeshTable& table() const { return table_; }

private:
    void build(RTCDevice device, const MeshTable::Mesh& source, double off, Mesh& mesh) const;
    void add_native(RTCDevice device, const std::vector<Corners>& corners, Mesh& mesh) const;
    void add_user(RTCDevice device, const std::vector<Corners>& corners, Mesh& mesh) const;

    struct Bounds;
    const MeshTable& table_;
    MeshCallbacks callbacks_;
    double widening_;
    RTCBuildQuality quality_;
    std::vector<Mesh> meshes_;
};

extern template class MeshHierarchies<float>;
extern template class MeshHierarchies<double>;

}  // namespace tandem::cpu
