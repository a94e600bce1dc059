#include "cpu_ref/path_tracer/geometry/hierarchies.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "common/error.h"
#include "common/render/renderer.h"
#include "common/stopwatch.h"
#include "cpu_ref/path_tracer/geometry/surface.h"

namespace tandem::cpu {

namespace {

RTCBuildQuality build_quality(HierarchyQuality quality) {
    return quality == HierarchyQuality::low      ? RTC_BUILD_QUALITY_LOW
           : quality == HierarchyQuality::medium ? RTC_BUILD_QUALITY_MEDIUM
                                                 : RTC_BUILD_QUALITY_HIGH;
}

}  // namespace

template <class Real>
struct Hierarchies<Real>::Bounds {
    static void all(const RTCBoundsFunctionArguments* arguments) {
        const Hierarchies& self = *static_cast<const Hierarchies*>(arguments->geometryUserPtr);
        BoundingBox box = self.leaf ? self.tables_.bounds[0] : self.tables_.bounds[self.user[arguments->primID]];
        if (self.leaf)
            for (const BoundingBox& other : self.tables_.bounds)
                box = {glm::min(box.low, other.low), glm::max(box.high, other.high)};
        // Embree passes over boxes that reach beyond 1.844e18; rays start within 10^18 and see what is left of them.
        constexpr double greatest = 1.8e18;
        const glm::dvec3 low = glm::clamp(box.low - self.inflation, -greatest, greatest),
                         high = glm::clamp(box.high + self.inflation, -greatest, greatest);
        *arguments->bounds_o = {round_down(low.x), round_down(low.y), round_down(low.z), 0.0f, round_up(high.x),
            round_up(high.y), round_up(high.z), 0.0f};
    }

    static void fine(const RTCBoundsFunctionArguments* arguments) {
        const Hierarchies& self = *static_cast<const Hierarchies*>(arguments->geometryUserPtr);
        const Fine& near = *self.fine;
        const auto c = self.corners_of(near.ids[arguments->primID]);
        const glm::dvec3 low = glm::min(glm::min(c[0], c[1]), c[2]) - near.middle - near.inflation,
                         high = glm::max(glm::max(c[0], c[1]), c[2]) - near.middle + near.inflation;
        *arguments->bounds_o = {round_down(low.x), round_down(low.y), round_down(low.z), 0.0f, round_up(high.x),
            round_up(high.y), round_up(high.z), 0.0f};
    }
};

template <class Real>
Hierarchies<Real>::Hierarchies(
    RTCDevice device, const Tables<Real>& tables, std::size_t most_in_leaf, const RayCallbacks& callbacks)
    : leaf(tables.default_kernels && tables.primitives.size() <= most_in_leaf && !tables.meshes),
      scene(rtcNewScene(device)),
      tables_(tables),
      quality_(build_quality(tables.settings.hierarchy)) {
    const Stopwatch watch;
    const TriangleKernel kernel = tables.settings.intersection.triangles;
    const bool embree_tests = kernel == TriangleKernel::embree || kernel == TriangleKernel::embree_robust;
    own_test = kernel == TriangleKernel::watertight;
    if (kernel != TriangleKernel::embree) rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), quality_);
    // Embree sees rays rounded to float, and the kernels of single precision round too. Let u = 2^-24 and M the largest
    // coordinate of scene and camera. A ray's origin moves by at most sqrt(3) u M. Its direction turns by sqrt(3) u
    // over a path of at most 2 sqrt(3) M. A kernel places a hit within 20 u M (surface.h). Together they are below 32 u
    // M. (With motion, shifting a ray rounds once more at each end, and M counts the displacements too.)
    const auto& camera = tables.camera;
    double reach = 0.0;
    for (const auto& [place, motion] : {std::array{camera.position.x, camera.position_motion.x},
             std::array{camera.position.y, camera.position_motion.y},
             std::array{camera.position.z, camera.position_motion.z}})
        reach = std::max(reach, std::abs(static_cast<double>(place)) + std::abs(static_cast<double>(motion)));
    reach += static_cast<double>(tables.camera.lens_radius);
    for (const BoundingBox& box : tables.bounds)
        for (int i = 0; i < 3; ++i) reach = std::max({reach, std::abs(box.low[i]), std::abs(box.high[i])});
    if (tables.meshes)
        for (const MeshTable::Place& place : tables.meshes->places)
            for (int i = 0; i < 3; ++i) reach = std::max({reach, std::abs(place.low[i]), std::abs(place.high[i])});
    inflation = 32.0 * 0x1p-24 * reach;
    if (leaf) {
        if (!tables.primitives.empty()) add_user_geometry(device, callbacks, 1);
    } else {
        if (own_test) set_fine_apart(device, callbacks);
        std::size_t apart = 0;
        for (std::uint32_t id = 0; id < tables.primitives.size(); ++id) {
            if (fine && apart < fine->ids.size() && fine->ids[apart] == id) {
                ++apart;
                continue;
            }
            const PrimitiveRef& ref = tables.primitives[id];
            const bool plain = sizeof(Real) == 4 && ref.kind == PrimitiveKind::triangle && !ref.moves;
            const bool native_one = plain && (embree_tests || (own_test && !ref.emits && can_widen(id)));
            (native_one ? native : user).push_back(id);
        }
        if (!native.empty()) add_native_triangles(device, callbacks);
        if (!user.empty()) add_user_geometry(device, callbacks, static_cast<unsigned>(user.size()));
        if (tables.meshes) {
            meshes = std::make_unique<MeshHierarchies<Real>>(
                device, *tables.meshes, reach, inflation, quality_, callbacks.meshes);
            meshes->attach_places(device, scene.get());
        }
    }
    rtcCommitScene(scene.get());
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
        throw Error("Embree could not build its hierarchy (error " + std::to_string(static_cast<int>(error)) + ")");
    if (!leaf) seconds = watch.seconds();
}

// With rho the radius about their middle, and `inflation` further off, rays start within twice that of it. There
// Embree's ray is off by what `inflation` counts, of coordinates of that size. The kernels are not off: they take a
// triangle where the exact ray passes its exact corners, or where settle.h finds so in double.
template <class Real>
void Hierarchies<Real>::set_fine_apart(RTCDevice device, const RayCallbacks& callbacks) {
    auto near = std::make_unique<Fine>();
    std::size_t plain = 0;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    glm::dvec3 low(infinity), high(-infinity);
    for (std::uint32_t id = 0; id < tables_.primitives.size(); ++id) {
        const PrimitiveRef& ref = tables_.primitives[id];
        if (ref.kind != PrimitiveKind::triangle || ref.moves) continue;
        ++plain;
        if (can_widen(id)) continue;
        near->ids.push_back(id);
        for (const glm::dvec3& corner : corners_of(id)) {
            low = glm::min(low, corner);
            high = glm::max(high, corner);
        }
    }
    if (near->ids.size() <= std::max(leaf_limit, plain / 2)) return;
    near->middle = 0.5 * (low + high);
    near->radius = 0.5 * glm::length(high - low);
    near->inflation = 32.0 * 0x1p-24 * 2.0 * (near->radius + inflation);
    if (!(8.0 * near->inflation < inflation)) return;
    fine = std::move(near);
    fine->scene = embree::Scene(rtcNewScene(device));
    rtcSetSceneBuildQuality(fine->scene.get(), quality_);
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
    rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned>(fine->ids.size()));
    rtcSetGeometryUserData(geometry.get(), this);
    rtcSetGeometryBoundsFunction(geometry.get(), Bounds::fine, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), callbacks.fine.closest);
    rtcSetGeometryOccludedFunction(geometry.get(), callbacks.fine.occluded);
    set_build_quality(geometry.get(), quality_);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(fine->scene.get(), geometry.get(), user_geometry);
    rtcCommitScene(fine->scene.get());
}

// Triangles too thin for that (below) are user geometry.
template <class Real>
bool Hierarchies<Real>::can_widen(std::uint32_t id) const {
    return incircle_of(corners_of(id)).radius >= 64.0 * inflation;
}

template <class Real>
std::array<glm::dvec3, 3> Hierarchies<Real>::corners_of(std::uint32_t id) const {
    std::array<glm::dvec3, 3> result{};
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3<double> corner = widened(tables_.triangles[tables_.primitives[id].form].corner[i]);
        result[i] = {corner.x, corner.y, corner.z};
    }
    return result;
}

// Embree's robust test loses rays at vertices (case 2 of scenes/hard). These are 2 % of those aimed there from 100
// times as far as the triangles are large. So it gets triangles whose edges are moved out by twice the bound that
// widens boxes. Our own test decides in its filter.
template <class Real>
std::array<glm::dvec3, 3> Hierarchies<Real>::native_corners(std::uint32_t id) const {
    std::array<glm::dvec3, 3> corners = corners_of(id);
    if (!own_test) return corners;
    const Incircle incircle = incircle_of(corners);
    for (glm::dvec3& corner : corners) corner += 2.0 * inflation / incircle.radius * (corner - incircle.centre);
    return corners;
}

template <class Real>
void Hierarchies<Real>::add_native_triangles(RTCDevice device, const RayCallbacks& callbacks) {
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
    auto* corners = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * native.size()));
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), native.size()));
    if (corners == nullptr || indices == nullptr) throw Error("Embree has no memory for its triangles");
    unsigned next = 0;
    for (const std::uint32_t id : native)
        for (const glm::dvec3& corner : native_corners(id)) {
            for (int axis = 0; axis < 3; ++axis) *corners++ = static_cast<float>(corner[axis]);
            *indices++ = next++;
        }
    rtcSetGeometryIntersectFilterFunction(geometry.get(), callbacks.filter_closest);
    rtcSetGeometryOccludedFilterFunction(geometry.get(), callbacks.filter_occluded);
    set_build_quality(geometry.get(), quality_);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene.get(), geometry.get(), native_geometry);
}

template <class Real>
void Hierarchies<Real>::add_user_geometry(RTCDevice device, const RayCallbacks& callbacks, unsigned count) {
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
    rtcSetGeometryUserPrimitiveCount(geometry.get(), count);
    rtcSetGeometryUserData(geometry.get(), this);
    rtcSetGeometryBoundsFunction(geometry.get(), Bounds::all, nullptr);
    const RayCallbacks::Pair& rays = leaf ? callbacks.leaf : callbacks.user;
    rtcSetGeometryIntersectFunction(geometry.get(), rays.closest);
    rtcSetGeometryOccludedFunction(geometry.get(), rays.occluded);
    set_build_quality(geometry.get(), quality_);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene.get(), geometry.get(), user_geometry);
}

template class Hierarchies<float>;
template class Hierarchies<double>;

}  // namespace tandem::cpu
