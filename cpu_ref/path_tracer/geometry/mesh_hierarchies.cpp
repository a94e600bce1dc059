#include "cpu_ref/path_tracer/geometry/mesh_hierarchies.h"

#include <algorithm>
#include <string>

#include "common/error.h"

namespace tandem::cpu {

namespace {

using glm::dmat3;
using glm::dvec3;

double largest(const dvec3& a) { return std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)}); }
dmat3 absolute(const dmat3& m) { return {glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])}; }
double greatest_row(const dmat3& m) {
    const dmat3 rows = glm::transpose(absolute(m));
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) sum = std::max(sum, rows[i].x + rows[i].y + rows[i].z);
    return sum;
}

// A ray meets the point w = M q + s of a place in the world. This is how far, for each coordinate, its mapped ray may
// pass the mesh's point q in object space. The point w is rounded by u of its size |w|, and W is the computed inverse
// of M. The mapped ray passes W (w + e - s) = q + (W M - I) q + W e. With v = 2^-53, W M - I is itself computed to 8 v
// |W||M|. A ray's origin o and its direction are mapped by one difference, and by products and sums of three. These err
// by 8 v |W| times the size of o - s, and of the way to w. Neither is larger than twice `reach` and |s| together.
template <class Real>
double passed_by(const MeshTable::Place& place, double object_size, double reach) {
    constexpr double u = sizeof(Real) == 4 ? 0x1p-24 : 0x1p-53, v = 0x1p-53;
    const dmat3 &m = place.map.linear, &w = place.map.inverse;
    const double inverse = greatest_row(w), world_size = std::max(largest(place.low), largest(place.high));
    const double residual = greatest_row(w * m - dmat3(1.0)) + 8.0 * v * greatest_row(absolute(w) * absolute(m));
    return residual * object_size + inverse * (u * world_size + 32.0 * v * (reach + largest(place.map.shift)));
}

void check(RTCDevice device) {
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
        throw Error(
            "Embree could not build a mesh's hierarchy (error " + std::to_string(static_cast<int>(error)) + ")");
}

RTCBounds rounded_outwards(const dvec3& low, const dvec3& high) {
    return {round_down(low.x), round_down(low.y), round_down(low.z), 0.0f, round_up(high.x), round_up(high.y),
        round_up(high.z), 0.0f};
}

}  // namespace

template <class Real>
struct MeshHierarchies<Real>::Bounds {
    static void place(const RTCBoundsFunctionArguments* arguments) {
        const MeshHierarchies& self = *static_cast<const MeshHierarchies*>(arguments->geometryUserPtr);
        const MeshTable::Place& place = self.table_.places[arguments->primID];
        constexpr double greatest = 1.8e18;  // as of other boxes (hierarchies.cpp)
        *arguments->bounds_o = rounded_outwards(glm::clamp(place.low - self.widening_, -greatest, greatest),
            glm::clamp(place.high + self.widening_, -greatest, greatest));
    }
    static void user(const RTCBoundsFunctionArguments* arguments) {
        const Mesh& mesh = *static_cast<const Mesh*>(arguments->geometryUserPtr);
        const Corners& c = mesh.corners[mesh.user[arguments->primID]];
        *arguments->bounds_o = rounded_outwards(glm::min(glm::min(c[0], c[1]), c[2]) - mesh.inflation,
            glm::max(glm::max(c[0], c[1]), c[2]) + mesh.inflation);
    }
};

template <class Real>
MeshHierarchies<Real>::MeshHierarchies(RTCDevice device, const MeshTable& table, double reach, double widening,
    RTCBuildQuality quality, const MeshCallbacks& callbacks)
    : table_(table), callbacks_(callbacks), widening_(widening), quality_(quality), meshes_(table.meshes.size()) {
    std::vector<double> sizes, off(meshes_.size(), 0.0);
    for (const MeshTable::Mesh& mesh : table.meshes) {
        double size = 0.0;
        for (std::uint32_t i = 0; i < mesh.vertex_count; ++i)
            size = std::max(size, largest(table.vertices[mesh.first_vertex + i]));
        sizes.push_back(size);
    }
    for (const MeshTable::Place& place : table.places)
        off[place.mesh] = std::max(off[place.mesh], passed_by<Real>(place, sizes[place.mesh], reach));
    for (std::size_t i = 0; i < meshes_.size(); ++i) build(device, table.meshes[i], off[i], meshes_[i]);
}

// Rays start within twice the radius, and what `inflation` counts there is in hierarchies.cpp. The kernels are not off,
// as with Fine's triangles.
template <class Real>
void MeshHierarchies<Real>::build(RTCDevice device, const MeshTable::Mesh& source, double off, Mesh& mesh) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    dvec3 low(infinity), high(-infinity);
    for (std::uint32_t i = 0; i < source.vertex_count; ++i) {
        low = glm::min(low, table_.vertices[source.first_vertex + i]);
        high = glm::max(high, table_.vertices[source.first_vertex + i]);
    }
    mesh.middle = 0.5 * (low + high);
    mesh.radius = 0.5 * glm::length(high - low);
    mesh.inflation = 2.0 * off + 32.0 * 0x1p-24 * 2.0 * (mesh.radius + 2.0 * off);
    mesh.scene = embree::Scene(rtcNewScene(device));
    rtcSetSceneFlags(mesh.scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(mesh.scene.get(), quality_);
    std::vector<Corners> corners;
    corners.reserve(source.count);
    for (std::uint32_t i = 0; i < source.count; ++i) {
        Corners& triangle = corners.emplace_back(table_.corners_of(table_.triangles[source.first + i]));
        for (dvec3& corner : triangle) corner -= mesh.middle;
        const bool wide = sizeof(Real) == 4 && incircle_of(triangle).radius >= 64.0 * mesh.inflation;
        (wide ? mesh.native : mesh.user).push_back(i);
    }
    if (!mesh.native.empty()) add_native(device, corners, mesh);
    if (!mesh.user.empty()) add_user(device, corners, mesh);
    mesh.corners = corners.data();
    rtcCommitScene(mesh.scene.get());
    mesh.corners = nullptr;
    check(device);
}

// Widened as hierarchies.cpp says; our own test, in the world, decides in the filter.
template <class Real>
void MeshHierarchies<Real>::add_native(RTCDevice device, const std::vector<Corners>& all, Mesh& mesh) const {
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
    auto* corners = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * mesh.native.size()));
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.native.size()));
    if (corners == nullptr || indices == nullptr) throw Error("Embree has no memory for the triangles of a mesh");
    unsigned next = 0;
    for (const std::uint32_t i : mesh.native) {
        const Incircle incircle = incircle_of(all[i]);
        for (const dvec3& corner : all[i]) {
            const dvec3 moved = corner + 2.0 * mesh.inflation / incircle.radius * (corner - incircle.centre);
            for (int axis = 0; axis < 3; ++axis) *corners++ = static_cast<float>(moved[axis]);
            *indices++ = next++;
        }
    }
    rtcSetGeometryIntersectFilterFunction(geometry.get(), callbacks_.filter_closest);
    rtcSetGeometryOccludedFilterFunction(geometry.get(), callbacks_.filter_occluded);
    set_build_quality(geometry.get(), quality_);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(mesh.scene.get(), geometry.get(), native_geometry);
}

template <class Real>
void MeshHierarchies<Real>::add_user(RTCDevice device, const std::vector<Corners>& all, Mesh& mesh) const {
    mesh.corners = all.data();
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
    rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned>(mesh.user.size()));
    rtcSetGeometryUserData(geometry.get(), &mesh);
    rtcSetGeometryBoundsFunction(geometry.get(), Bounds::user, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), callbacks_.user_closest);
    rtcSetGeometryOccludedFunction(geometry.get(), callbacks_.user_occluded);
    set_build_quality(geometry.get(), quality_);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(mesh.scene.get(), geometry.get(), user_geometry);
}

template <class Real>
void MeshHierarchies<Real>::attach_places(RTCDevice device, RTCScene scene) {
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
    rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned>(table_.places.size()));
    rtcSetGeometryUserData(geometry.get(), this);
    rtcSetGeometryBoundsFunction(geometry.get(), Bounds::place, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), callbacks_.place_closest);
    rtcSetGeometryOccludedFunction(geometry.get(), callbacks_.place_occluded);
    set_build_quality(geometry.get(), quality_);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene, geometry.get(), place_geometry);
}

template class MeshHierarchies<float>;
template class MeshHierarchies<double>;

}  // namespace tandem::cpu
