// What Embree holds of a scene (MODEL.md section 5). A scene of few primitives is one leaf of user geometry. Otherwise
// plain triangles are Embree's own, in single precision and slightly widened, so that Embree's test loses none. All
// other primitives are user geometry, and so is a box for each place of a mesh (mesh_hierarchies.h). Primitives in
// motion have bounds over the whole shutter time. Rays are traced in accelerator.h.
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "cpu_ref/path_tracer/geometry/embree.h"
#include "cpu_ref/path_tracer/geometry/mesh_hierarchies.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

// What Embree calls for a ray at the leaf, at other user geometry, and at Fine's triangles. Filters are called at
// native triangles that would become the closest hit, or occlude.
struct RayCallbacks {
    struct Pair {
        RTCIntersectFunctionN closest;
        RTCOccludedFunctionN occluded;
    };
    Pair leaf, user, fine;
    RTCFilterFunctionN filter_closest, filter_occluded;
    MeshCallbacks meshes;
};

template <class Real>
class Hierarchies {
public:
    // At most so many primitives are tested as one leaf. Measured: paths a second against the hierarchy, with 16 float
    // lanes on mixed primitives. There are 2.6 times as many at 16 primitives, 1.8 at 32, 1.3 at 64.
    static constexpr std::size_t leaf_limit = 64;

    // `tables` must outlive this. Throws Error if Embree fails.
    Hierarchies(RTCDevice device, const Tables<Real>& tables, std::size_t most_in_leaf, const RayCallbacks& callbacks);

    Hierarchies(const Hierarchies&) = delete;  // Embree knows its address
    Hierarchies& operator=(const Hierarchies&) = delete;

    // Triangles that are small beside `inflation` and lie together in a part that is small beside the scene. A fine
    // mesh far from all else is such a part. In the scene's hierarchy rays would meet the bounds of all of them. They
    // have a hierarchy of their own, about their middle, and rays start there where they come near. What rounds is then
    // as small as they.
    struct Fine {
        embree::Scene scene;
        std::vector<std::uint32_t> ids;  // of primitives, by Embree's primID
        glm::dvec3 middle{0.0};
        double radius = 0.0, inflation = 0.0;  // of a sphere around all; of bounds
    };

    bool leaf;
    std::vector<std::uint32_t> native, user;  // primitive ids by Embree's primID
    bool own_test = true;                     // decides on native triangles
    double inflation = 0.0;                   // of bounds, world units
    double seconds = 0.0;                     // that building took; 0: there is a leaf alone
    embree::Scene scene;
    std::unique_ptr<Fine> fine;
    std::unique_ptr<MeshHierarchies<Real>> meshes;  // where there are any: their places are the scene's third geometry

private:
    void add_native_triangles(RTCDevice device, const RayCallbacks& callbacks);
    void add_user_geometry(RTCDevice device, const RayCallbacks& callbacks, unsigned count);

    void set_fine_apart(RTCDevice device, const RayCallbacks& callbacks);
    [[nodiscard]] bool can_widen(std::uint32_t id) const;
    [[nodiscard]] std::array<glm::dvec3, 3> corners_of(std::uint32_t id) const;
    [[nodiscard]] std::array<glm::dvec3, 3> native_corners(std::uint32_t id) const;

    struct Bounds;
    const Tables<Real>& tables_;
    const RTCBuildQuality quality_;
};

extern template class Hierarchies<float>;
extern template class Hierarchies<double>;

}  // namespace tandem::cpu
