#include "cpu_ref/path_tracer/geometry/accelerator.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "common/error.h"
#include "cpu_ref/path_tracer/geometry/chosen_kernels.h"

namespace tandem::cpu {

namespace {

constexpr std::uint32_t native_geometry = 0, user_geometry = 1;

// Calls visit(form) with the intersection constants of a primitive.
template <class Real, class Visit>
TANDEM_INLINE auto with_form(const Tables<Real>& tables, const PrimitiveRef& ref, Visit visit) {
    switch (ref.kind) {
        case PrimitiveKind::triangle:
            return visit(tables.triangles[ref.form]);
        case PrimitiveKind::sphere:
            return visit(tables.spheres[ref.form]);
        default:
            return visit(tables.cuboids[ref.form]);
    }
}

// A packet of rays on its way through Embree. Embree hands the context back to the callbacks.
template <class Real>
struct PacketQuery {
    embree::Context context;
    Ray<Lanes<Real>> ray;
    Departure<Lanes<Real>> departure;
    Ints<Real> light;
    Mask<Real> active;
    Lanes<Real> time;
    Hit<Real> hit;  // also `found` for occlusion
};

template <class Real>
struct SingleQuery {
    embree::Context context;
    const Tables<Real>* tables;
    const std::vector<std::uint32_t>* native;
    const std::vector<std::uint32_t>* user;
    Ray<Real> ray;
    std::uint32_t departed;
    bool inside;
    std::uint32_t light;
    Real time;
    bool own_test;  // of native triangles, in place of Embree's
    double lead;    // by which Embree's ray starts earlier; negative: later
    double slack;   // by which it goes on behind a hit, whose t is rounded
    Real t;
    std::uint32_t face, primitive;
    bool found;
};

// The ray that meets a primitive at rest as `ray` meets it in motion.
template <class V>
TANDEM_INLINE Ray<V> seen_by(const Ray<V>& ray, const Tables<RealOf<V>>& tables, const PrimitiveRef& ref, V time) {
    if (!ref.moves) return ray;
    const Vec3<V> origin = along(ray.origin, V(-time), splat<V>(tables.motion_list[ref.entity]));
    return make_ray(origin, ray.direction, ray.t_min, ray.limit);
}

// As the guard against self-intersection has it (section 5.3).
template <class Real>
TANDEM_INLINE Departure<Lanes<Real>> left_by(const Tables<Real>& tables, const Departure<Lanes<Real>>& departure) {
    if (tables.excludes_left) [[likely]]
        return departure;
    return {Ints<Real>(UnsignedOf<Real>{no_primitive}), Mask<Real>{}};
}

// A float no less than `a`, so that Embree culls nothing at `a`.
float round_up(double a) {
    const float rounded = static_cast<float>(a);
    return static_cast<double>(rounded) < a ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : rounded;
}
float round_down(double a) { return -round_up(-a); }

template <class Real>
struct PacketTypes;
template <>
struct PacketTypes<std::integral_constant<int, 4>> {
    using Hit = RTCRayHit4;
    using Ray = RTCRay4;
};
template <>
struct PacketTypes<std::integral_constant<int, 8>> {
    using Hit = RTCRayHit8;
    using Ray = RTCRay8;
};
template <>
struct PacketTypes<std::integral_constant<int, 16>> {
    using Hit = RTCRayHit16;
    using Ray = RTCRay16;
};
// Embree's smallest packet has four rays; those without a lane are not valid.
template <class Real>
inline constexpr int packet_size = std::max(4, lane_count<Real>);
template <class Real>
using Packet = PacketTypes<std::integral_constant<int, packet_size<Real>>>;

template <class Real>
TANDEM_INLINE void store_floats(float* target, Lanes<Real> value) {
    for (int i = 0; i < lane_count<Real>; ++i) target[i] = static_cast<float>(value.v[i]);
}

template <class Real, class EmbreeRay>
TANDEM_INLINE void fill(EmbreeRay& packet, int* valid, const Ray<Lanes<Real>>& ray, Mask<Real> active) {
    store_floats(packet.org_x, ray.origin.x);
    store_floats(packet.org_y, ray.origin.y);
    store_floats(packet.org_z, ray.origin.z);
    store_floats(packet.dir_x, ray.direction.x);
    store_floats(packet.dir_y, ray.direction.y);
    store_floats(packet.dir_z, ray.direction.z);
    const Lanes<Real> dead(Real(-1));
    store_floats(packet.tfar, select(active, Lanes<Real>(std::numeric_limits<Real>::infinity()), dead));
    const unsigned bits = active.to_bits();
    if constexpr (packet_size < Real >> lane_count<Real>)
        for (int i = lane_count<Real>; i < packet_size<Real>; ++i)
            packet.org_x[i] = packet.org_y[i] = packet.org_z[i] = packet.dir_x[i] = packet.dir_y[i] = packet.dir_z[i] =
                packet.tnear[i] = packet.tfar[i] = packet.time[i] = 0.0f;
    for (int i = 0; i < lane_count<Real>; ++i) {
        packet.tnear[i] = 0.0f;
        packet.time[i] = 0.0f;
        packet.mask[i] = 0xFFFFFFFFu;
        packet.flags[i] = 0;
        valid[i] = -static_cast<int>((bits >> i) & 1u);
    }
}

// Rays that Embree may be given; others miss (section 5.2). Its Debian build aborts on a NaN interval, and on
// coordinates from 1.8e18 on.
template <class Real>
TANDEM_INLINE Mask<Real> traceable(const Ray<Lanes<Real>>& ray, Mask<Real> active) {
    using V = Lanes<Real>;
    // 0 x is NaN unless x is finite, and a zero direction meets nothing.
    const V zero(Real(0)), probe = (ray.origin.x + ray.origin.y + ray.origin.z) * zero;
    return active & (probe == zero) & (largest_magnitude(ray.origin) <= V(Real(1e18))) &
           (dot(ray.direction, ray.direction) > zero) & (ray.t_min <= ray.limit);
}

}  // namespace

template <class Real>
struct Accelerator<Real>::Callbacks {
    static void bounds(const RTCBoundsFunctionArguments* arguments) {
        const Accelerator& self = *static_cast<const Accelerator*>(arguments->geometryUserPtr);
        BoundingBox box = self.leaf_ ? self.tables_.bounds[0] : self.tables_.bounds[self.user_[arguments->primID]];
        if (self.leaf_)
            for (const BoundingBox& other : self.tables_.bounds)
                box = {glm::min(box.low, other.low), glm::max(box.high, other.high)};
        // Embree passes over boxes that reach beyond 1.844e18; rays start within 10^18 and see what is left of them.
        constexpr double greatest = 1.8e18;
        const glm::dvec3 low = glm::clamp(box.low - self.inflation_, -greatest, greatest),
                         high = glm::clamp(box.high + self.inflation_, -greatest, greatest);
        *arguments->bounds_o = {round_down(low.x), round_down(low.y), round_down(low.z), 0.0f, round_up(high.x),
            round_up(high.y), round_up(high.z), 0.0f};
    }

    static void fine_bounds(const RTCBoundsFunctionArguments* arguments) {
        const Accelerator& self = *static_cast<const Accelerator*>(arguments->geometryUserPtr);
        const Fine& fine = *self.fine_;
        const auto c = self.corners_of(fine.ids[arguments->primID]);
        const glm::dvec3 low = glm::min(glm::min(c[0], c[1]), c[2]) - fine.middle - fine.inflation,
                         high = glm::max(glm::max(c[0], c[1]), c[2]) - fine.middle + fine.inflation;
        *arguments->bounds_o = {round_down(low.x), round_down(low.y), round_down(low.z), 0.0f, round_up(high.x),
            round_up(high.y), round_up(high.z), 0.0f};
    }

    template <bool moving>
    static void packet_closest(const RTCIntersectFunctionNArguments* arguments) {
        const Accelerator& self = *static_cast<const Accelerator*>(arguments->geometryUserPtr);
        leaf_closest<moving>(self.tables_, *reinterpret_cast<PacketQuery<Real>*>(arguments->context));
    }
    template <bool moving>
    static void packet_occluded(const RTCOccludedFunctionNArguments* arguments) {
        const Accelerator& self = *static_cast<const Accelerator*>(arguments->geometryUserPtr);
        leaf_occluded<moving>(self.tables_, *reinterpret_cast<PacketQuery<Real>*>(arguments->context));
    }

    // All primitives in ascending id order with strict comparison: of equal t the lower id wins.
    template <bool moving>
    static void leaf_closest(const Tables<Real>& tables, PacketQuery<Real>& query) {
        using V = Lanes<Real>;
        using U = UnsignedOf<Real>;
        Ray<V> ray = query.ray;
        Hit<Real> hit{Mask<Real>{}, ray.limit, Ints<Real>(U{0})};
        U id = 0;
        for (const PrimitiveRef& ref : tables.primitives) {
            const Mask<Real> departing = query.departure.primitive == Ints<Real>(id++);
            const Candidate<V> candidate = with_form(tables, ref, [&](const auto& form) {
                if constexpr (moving)
                    return intersect(form, seen_by(ray, tables, ref, query.time), departing, query.departure.inside);
                else
                    return intersect(form, ray, departing, query.departure.inside);
            });
            ray.limit = select(candidate.hit, candidate.t, ray.limit);
            hit.face = select(candidate.hit, candidate.face + Ints<Real>(U{ref.first_face}), hit.face);
            hit.found = hit.found | candidate.hit;
        }
        hit.t = ray.limit;
        hit.found = hit.found & query.active;
        query.hit = hit;
    }
    template <bool moving>
    static void leaf_occluded(const Tables<Real>& tables, PacketQuery<Real>& query) {
        using V = Lanes<Real>;
        using U = UnsignedOf<Real>;
        const Ray<V> ray = query.ray;
        Mask<Real> blocked = !query.active;
        U id = 0;
        for (const PrimitiveRef& ref : tables.primitives) {
            const Ints<Real> number(id++);
            const Mask<Real> departing = query.departure.primitive == number;
            const Mask<Real> hit = with_form(tables, ref, [&](const auto& form) {
                if constexpr (moving)
                    return blocks(form, seen_by(ray, tables, ref, query.time), departing, query.departure.inside);
                else
                    return blocks(form, ray, departing, query.departure.inside);
            });
            blocked = blocked | (hit & !(query.light == number));
            if (all(blocked)) break;
        }
        query.hit.found = blocked & query.active;
    }

    template <bool moving>
    static Candidate<Real> single(const SingleQuery<Real>& query, std::uint32_t id) {
        if (id == query.light) return {false, Real(0), 0};
        const PrimitiveRef& ref = query.tables->primitives[id];
        if (!query.tables->default_kernels) [[unlikely]]
            return intersect_as_chosen(*query.tables, ref, seen_by(query.ray, *query.tables, ref, query.time),
                id == query.departed, query.inside);
        return with_form(*query.tables, ref, [&](const auto& form) {
            if constexpr (moving)
                return intersect(
                    form, seen_by(query.ray, *query.tables, ref, query.time), id == query.departed, query.inside);
            else
                return intersect(form, query.ray, id == query.departed, query.inside);
        });
    }
    // Takes a hit in if it is nearer, or as near with a lower id.
    static bool accept(SingleQuery<Real>& query, std::uint32_t id, Real t, std::uint32_t face) {
        if (query.found && (t > query.t || (t == query.t && id > query.primitive))) return false;
        query.found = true;
        query.t = t;
        query.primitive = id;
        query.face = query.tables->primitives[id].first_face + face;
        return true;
    }

    template <bool moving>
    static void single_closest(const RTCIntersectFunctionNArguments* arguments) {
        if (arguments->valid[0] == 0) return;
        auto& query = *reinterpret_cast<SingleQuery<Real>*>(arguments->context);
        const std::uint32_t id = (*query.user)[arguments->primID];
        const Candidate<Real> candidate = single<moving>(query, id);
        if (!candidate.hit || !accept(query, id, candidate.t, static_cast<std::uint32_t>(candidate.face))) return;
        auto& ray = *reinterpret_cast<RTCRayHit*>(arguments->rayhit);
        ray.ray.tfar = std::min(ray.ray.tfar, round_up(static_cast<double>(candidate.t) + query.lead + query.slack));
        ray.hit.geomID = arguments->geomID;
        ray.hit.primID = arguments->primID;
    }
    template <bool moving>
    static void single_occluded(const RTCOccludedFunctionNArguments* arguments) {
        if (arguments->valid[0] == 0) return;
        auto& query = *reinterpret_cast<SingleQuery<Real>*>(arguments->context);
        if (!single<moving>(query, (*query.user)[arguments->primID]).hit) return;
        query.found = true;
        reinterpret_cast<RTCRay*>(arguments->ray)->tfar = -std::numeric_limits<float>::infinity();
    }

    // Called for each native triangle that would become the closest hit, or occlude.
    static void filter_closest(const RTCFilterFunctionNArguments* arguments) {
        auto& query = *reinterpret_cast<SingleQuery<Real>*>(arguments->context);
        const std::uint32_t id = (*query.native)[reinterpret_cast<RTCHit*>(arguments->hit)->primID];
        if (query.own_test) {
            const Candidate<Real> candidate = single<false>(query, id);
            if (!candidate.hit || !accept(query, id, candidate.t, 0)) arguments->valid[0] = 0;
            return;
        }
        const Real t = static_cast<Real>(reinterpret_cast<RTCRay*>(arguments->ray)->tfar);
        if (id == query.departed || !accept(query, id, t, 0)) arguments->valid[0] = 0;
    }
    static void filter_occluded(const RTCFilterFunctionNArguments* arguments) {
        auto& query = *reinterpret_cast<SingleQuery<Real>*>(arguments->context);
        const std::uint32_t id = (*query.native)[reinterpret_cast<RTCHit*>(arguments->hit)->primID];
        if (id == query.departed || id == query.light || (query.own_test && !single<false>(query, id).hit))
            arguments->valid[0] = 0;
        else
            query.found = true;
    }
};

template <class Real>
Accelerator<Real>::Accelerator(RTCDevice device, const Tables<Real>& tables, std::size_t most_in_leaf)
    : tables_(tables),
      leaf_(tables.default_kernels && tables.primitives.size() <= most_in_leaf),
      scene_(rtcNewScene(device)) {
    const TriangleKernel kernel = tables.settings.intersection.triangles;
    const bool embree_tests = kernel == TriangleKernel::embree || kernel == TriangleKernel::embree_robust;
    own_test_ = kernel == TriangleKernel::watertight;
    if (kernel != TriangleKernel::embree) rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);
    // Embree sees rays rounded to float, and the kernels of single precision round too. With u = 2^-24 and M the
    // largest coordinate of scene and camera, a ray's origin moves by at most sqrt(3) u M, its direction turns by
    // sqrt(3) u over a path of at most 2 sqrt(3) M, and a kernel places a hit within 20 u M (surface.h): below 32 u M
    // together.
    // (With motion, shifting a ray rounds once more at each end, and M counts the displacements too.)
    const auto& camera = tables.camera;
    double reach = 0.0;
    for (const auto& [place, motion] : {std::array{camera.position.x, camera.position_motion.x},
             std::array{camera.position.y, camera.position_motion.y},
             std::array{camera.position.z, camera.position_motion.z}})
        reach = std::max(reach, std::abs(static_cast<double>(place)) + std::abs(static_cast<double>(motion)));
    reach += static_cast<double>(tables.camera.lens_radius);
    for (const BoundingBox& box : tables.bounds)
        for (int i = 0; i < 3; ++i) reach = std::max({reach, std::abs(box.low[i]), std::abs(box.high[i])});
    inflation_ = 32.0 * 0x1p-24 * reach;
    if (leaf_) {
        if (!tables.primitives.empty()) add_user_geometry(device, 1);
    } else {
        if (own_test_) set_fine_apart(device);
        std::size_t apart = 0;
        for (std::uint32_t id = 0; id < tables.primitives.size(); ++id) {
            if (fine_ && apart < fine_->ids.size() && fine_->ids[apart] == id) {
                ++apart;
                continue;
            }
            const PrimitiveRef& ref = tables.primitives[id];
            const bool plain = sizeof(Real) == 4 && ref.kind == PrimitiveKind::triangle && !ref.moves;
            const bool native = plain && (embree_tests || (own_test_ && !ref.emits && can_widen(id)));
            (native ? native_ : user_).push_back(id);
        }
        if (!native_.empty()) add_native_triangles(device);
        if (!user_.empty()) add_user_geometry(device, static_cast<unsigned>(user_.size()));
    }
    rtcCommitScene(scene_.get());
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
        throw Error("Embree could not build its hierarchy (error " + std::to_string(static_cast<int>(error)) + ")");
}

namespace {

struct Incircle {
    glm::dvec3 centre;
    double radius;
};
Incircle incircle_of(const std::array<glm::dvec3, 3>& c) {
    const double a = glm::distance(c[1], c[2]), b = glm::distance(c[2], c[0]), e = glm::distance(c[0], c[1]);
    const double perimeter = a + b + e;
    if (!(perimeter > 0.0)) return {c[0], 0.0};
    return {
        (a * c[0] + b * c[1] + e * c[2]) / perimeter, glm::length(glm::cross(c[1] - c[0], c[2] - c[0])) / perimeter};
}

}  // namespace

// With rho the radius about their middle, and `inflation_` further off, rays start within twice that of it. There
// Embree's ray is off by what `inflation_` counts, of coordinates of that size. The kernels are not off: they take a
// triangle where the exact ray passes its exact corners, or where settle.h finds so in double.
template <class Real>
void Accelerator<Real>::set_fine_apart(RTCDevice device) {
    auto fine = std::make_unique<Fine>();
    std::size_t plain = 0;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    glm::dvec3 low(infinity), high(-infinity);
    for (std::uint32_t id = 0; id < tables_.primitives.size(); ++id) {
        const PrimitiveRef& ref = tables_.primitives[id];
        if (ref.kind != PrimitiveKind::triangle || ref.moves) continue;
        ++plain;
        if (can_widen(id)) continue;
        fine->ids.push_back(id);
        for (const glm::dvec3& corner : corners_of(id)) {
            low = glm::min(low, corner);
            high = glm::max(high, corner);
        }
    }
    if (fine->ids.size() <= std::max(leaf_limit, plain / 2)) return;
    fine->middle = 0.5 * (low + high);
    fine->radius = 0.5 * glm::length(high - low);
    fine->inflation = 32.0 * 0x1p-24 * 2.0 * (fine->radius + inflation_);
    if (!(8.0 * fine->inflation < inflation_)) return;
    fine_ = std::move(fine);
    fine_->scene = embree::Scene(rtcNewScene(device));
    rtcSetSceneBuildQuality(fine_->scene.get(), RTC_BUILD_QUALITY_HIGH);
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
    rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned>(fine_->ids.size()));
    rtcSetGeometryUserData(geometry.get(), this);
    rtcSetGeometryBoundsFunction(geometry.get(), Callbacks::fine_bounds, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), Callbacks::template single_closest<false>);
    rtcSetGeometryOccludedFunction(geometry.get(), Callbacks::template single_occluded<false>);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(fine_->scene.get(), geometry.get(), user_geometry);
    rtcCommitScene(fine_->scene.get());
}

// Triangles too thin for that (below) are user geometry.
template <class Real>
bool Accelerator<Real>::can_widen(std::uint32_t id) const {
    return incircle_of(corners_of(id)).radius >= 64.0 * inflation_;
}

template <class Real>
std::array<glm::dvec3, 3> Accelerator<Real>::corners_of(std::uint32_t id) const {
    std::array<glm::dvec3, 3> result{};
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3<double> corner = widened(tables_.triangles[tables_.primitives[id].form].corner[i]);
        result[i] = {corner.x, corner.y, corner.z};
    }
    return result;
}

// Embree's robust test loses rays at vertices (2 % of those aimed there from 100 times as far as the triangles are
// large; case 2 of scenes/hard). So it gets triangles whose edges are moved out by twice the bound that boxes are
// widened by, and our own test decides in its filter.
template <class Real>
std::array<glm::dvec3, 3> Accelerator<Real>::native_corners(std::uint32_t id) const {
    std::array<glm::dvec3, 3> corners = corners_of(id);
    if (!own_test_) return corners;
    const Incircle incircle = incircle_of(corners);
    for (glm::dvec3& corner : corners) corner += 2.0 * inflation_ / incircle.radius * (corner - incircle.centre);
    return corners;
}

template <class Real>
void Accelerator<Real>::add_native_triangles(RTCDevice device) {
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
    auto* corners = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3 * native_.size()));
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), native_.size()));
    if (corners == nullptr || indices == nullptr) throw Error("Embree has no memory for its triangles");
    unsigned next = 0;
    for (const std::uint32_t id : native_)
        for (const glm::dvec3& corner : native_corners(id)) {
            for (int axis = 0; axis < 3; ++axis) *corners++ = static_cast<float>(corner[axis]);
            *indices++ = next++;
        }
    rtcSetGeometryIntersectFilterFunction(geometry.get(), Callbacks::filter_closest);
    rtcSetGeometryOccludedFilterFunction(geometry.get(), Callbacks::filter_occluded);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene_.get(), geometry.get(), native_geometry);
}

template <class Real>
void Accelerator<Real>::add_user_geometry(RTCDevice device, unsigned count) {
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER));
    rtcSetGeometryUserPrimitiveCount(geometry.get(), count);
    rtcSetGeometryUserData(geometry.get(), this);
    rtcSetGeometryBoundsFunction(geometry.get(), Callbacks::bounds, nullptr);
    const auto set_callbacks = [&]<bool moving>() {
        rtcSetGeometryIntersectFunction(geometry.get(),
            leaf_ ? Callbacks::template packet_closest<moving> : Callbacks::template single_closest<moving>);
        rtcSetGeometryOccludedFunction(geometry.get(),
            leaf_ ? Callbacks::template packet_occluded<moving> : Callbacks::template single_occluded<moving>);
    };
    tables_.moves ? set_callbacks.template operator()<true>() : set_callbacks.template operator()<false>();
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene_.get(), geometry.get(), user_geometry);
}

template <class Real>
Hit<Real> Accelerator<Real>::closest(
    const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure, Mask<Real> active, Lanes<Real> time) const {
    if (!leaf_) return closest_one_by_one(ray, departure, active, time);
    PacketQuery<Real> query{{}, ray, left_by(tables_, departure), {}, traceable(ray, active), time, {}};
    query.hit = {Mask<Real>{}, ray.limit, Ints<Real>(UnsignedOf<Real>{0})};
    embree::initialise(query.context);
    typename Packet<Real>::Hit packet;
    alignas(64) int valid[packet_size<Real>]{};
    fill(packet.ray, valid, ray, query.active);
    for (unsigned& id : packet.hit.geomID) id = RTC_INVALID_GEOMETRY_ID;
    embree::intersect(scene_.get(), query.context, valid, packet);
    return query.hit;
}

template <class Real>
Mask<Real> Accelerator<Real>::occluded(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
    Ints<Real> light, Mask<Real> active, Lanes<Real> time) const {
    if (!leaf_) return occluded_one_by_one(ray, departure, light, active, time);
    PacketQuery<Real> query{{}, ray, left_by(tables_, departure), light, traceable(ray, active), time, {}};
    embree::initialise(query.context);
    typename Packet<Real>::Ray packet;
    alignas(64) int valid[packet_size<Real>]{};
    fill(packet, valid, ray, query.active);
    embree::occluded(scene_.get(), query.context, valid, packet);
    return query.hit.found;
}

namespace {

template <class Real>
Vec3<Real> lane_of(const Vec3<Lanes<Real>>& a, int lane) {
    return {a.x[lane], a.y[lane], a.z[lane]};
}

// The query's ray for Embree, in coordinates about `middle`.
template <class Real>
void start_traversal(const SingleQuery<Real>& query, RTCRay& out, const glm::dvec3& middle) {
    const double lead = query.lead;
    const auto start = [&](Real origin, Real direction, double centre) {
        return static_cast<float>(static_cast<double>(origin) - lead * static_cast<double>(direction) - centre);
    };
    out.org_x = start(query.ray.origin.x, query.ray.direction.x, middle.x);
    out.org_y = start(query.ray.origin.y, query.ray.direction.y, middle.y);
    out.org_z = start(query.ray.origin.z, query.ray.direction.z, middle.z);
    out.dir_x = static_cast<float>(query.ray.direction.x);
    out.dir_y = static_cast<float>(query.ray.direction.y);
    out.dir_z = static_cast<float>(query.ray.direction.z);
    // Embree's own interval is (tnear, tfar]; our kernels hold the exact one. Its ray starts `lead` earlier, so that it
    // sees what lies at t = 0 too.
    const double t_min = static_cast<double>(query.ray.t_min) + std::min(lead, 0.0);
    out.tnear = t_min > 0.0 ? std::max(0.0f, std::nextafter(round_down(t_min), -1.0f)) : 0.0f;
    out.tfar = round_up(static_cast<double>(query.ray.limit) + lead + query.slack);
    out.time = 0.0f;
    out.mask = 0xFFFFFFFFu;
    out.id = 0;
    out.flags = 0;
}

// One lane's ray, ready for Embree.
template <class Real>
void start_single(SingleQuery<Real>& query, RTCRay& out, const Ray<Lanes<Real>>& ray,
    const Departure<Lanes<Real>>& departure, int lane) {
    embree::initialise(query.context);
    query.ray = {lane_of(ray.origin, lane), lane_of(ray.direction, lane), lane_of(ray.moment, lane), ray.t_min[lane],
        ray.limit[lane]};
    query.departed = query.tables->excludes_left ? static_cast<std::uint32_t>(departure.primitive[lane]) : no_primitive;
    query.inside = ((departure.inside.to_bits() >> lane) & 1u) != 0;
    query.found = false;
    start_traversal(query, out, glm::dvec3(0.0));
}

// The query's ray from where it comes near to the fine triangles, for what is nearer than it has found. False: there is
// nothing.
template <class Real, class Fine>
bool start_near(SingleQuery<Real>& query, RTCRay& out, const Fine& fine, double lead) {
    const Vec3<double> o = widened(query.ray.origin), d = widened(query.ray.direction);
    const glm::dvec3 way = fine.middle - glm::dvec3(o.x, o.y, o.z), direction(d.x, d.y, d.z);
    const double along = glm::dot(way, direction) / glm::dot(direction, direction), reach = fine.radius + lead;
    if (glm::length(way - along * direction) > reach || along < -reach) return false;
    query.user = &fine.ids;
    query.lead = lead - std::max(0.0, along - reach);
    start_traversal(query, out, fine.middle);
    if (query.found) out.tfar = std::min(out.tfar, round_up(static_cast<double>(query.t) + query.lead + query.slack));
    return out.tfar >= 0.0f;
}

}  // namespace

template <class Real>
Hit<Real> Accelerator<Real>::closest_one_by_one(
    const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure, Mask<Real> active, Lanes<Real> time) const {
    using U = UnsignedOf<Real>;
    SingleQuery<Real> query{};
    query.tables = &tables_;
    query.native = &native_;
    query.own_test = own_test_;
    query.slack = own_test_ ? inflation_ : 0.0;
    query.light = no_primitive;
    Hit<Real> hit{Mask<Real>{}, ray.limit, Ints<Real>(U{0})};
    unsigned found = 0;
    for (unsigned left = traceable(ray, active).to_bits(); left != 0; left &= left - 1) {
        const int lane = std::countr_zero(left);
        RTCRayHit one;
        query.time = time[lane];
        query.user = &user_;
        query.lead = query.slack;
        start_single(query, one.ray, ray, departure, lane);
        one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        embree::intersect(scene_.get(), query.context, one);
        if (fine_ && start_near(query, one.ray, *fine_, inflation_))
            embree::intersect(fine_->scene.get(), query.context, one);
        if (!query.found) continue;
        if (one.hit.geomID == native_geometry && !own_test_) {
            // Embree chose the triangle; its plane says where.
            const TriangleForm<Real>& plane = tables_.triangles[tables_.primitives[query.primitive].form];
            const Real t =
                (plane.offset - dot(plane.normal, query.ray.origin)) / dot(plane.normal, query.ray.direction);
            if (std::isfinite(t)) query.t = std::max(t, query.ray.t_min);
        }
        found |= 1u << lane;
        hit.t.v[lane] = query.t;
        hit.face.v[lane] = query.face;
    }
    hit.found = Mask<Real>::from_bits(found);
    return hit;
}

template <class Real>
Mask<Real> Accelerator<Real>::occluded_one_by_one(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
    Ints<Real> light, Mask<Real> active, Lanes<Real> time) const {
    SingleQuery<Real> query{};
    query.tables = &tables_;
    query.native = &native_;
    query.own_test = own_test_;
    query.slack = own_test_ ? inflation_ : 0.0;
    unsigned blocked = 0;
    for (unsigned left = traceable(ray, active).to_bits(); left != 0; left &= left - 1) {
        const int lane = std::countr_zero(left);
        RTCRay one;
        query.time = time[lane];
        query.user = &user_;
        query.lead = query.slack;
        start_single(query, one, ray, departure, lane);
        query.light = static_cast<std::uint32_t>(light[lane]);
        embree::occluded(scene_.get(), query.context, one);
        if (fine_ && !query.found && start_near(query, one, *fine_, inflation_))
            embree::occluded(fine_->scene.get(), query.context, one);
        if (query.found) blocked |= 1u << lane;
    }
    return Mask<Real>::from_bits(blocked);
}

template class Accelerator<float>;
template class Accelerator<double>;

}  // namespace tandem::cpu
