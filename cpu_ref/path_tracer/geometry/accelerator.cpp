#include "cpu_ref/path_tracer/geometry/accelerator.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "cpu_ref/path_tracer/geometry/chosen_kernels.h"
#include "cpu_ref/path_tracer/geometry/mesh_traversal.h"
#include "cpu_ref/path_tracer/geometry/single_query.h"

namespace tandem::cpu {

namespace {

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
    const Tables<Real>* tables;
    Ray<Lanes<Real>> ray;
    Departure<Lanes<Real>> departure;
    Ints<Real> light;
    Mask<Real> active;
    Lanes<Real> time;
    Hit<Real> hit;  // also `found` for occlusion
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
    template <bool moving>
    static void packet_closest(const RTCIntersectFunctionNArguments* arguments) {
        auto& query = *reinterpret_cast<PacketQuery<Real>*>(arguments->context);
        leaf_closest<moving>(*query.tables, query);
    }
    template <bool moving>
    static void packet_occluded(const RTCOccludedFunctionNArguments* arguments) {
        auto& query = *reinterpret_cast<PacketQuery<Real>*>(arguments->context);
        leaf_occluded<moving>(*query.tables, query);
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
    template <bool moving>
    static void single_closest(const RTCIntersectFunctionNArguments* arguments) {
        if (arguments->valid[0] == 0) return;
        auto& query = *reinterpret_cast<SingleQuery<Real>*>(arguments->context);
        const std::uint32_t id = (*query.user)[arguments->primID];
        const Candidate<Real> candidate = single<moving>(query, id);
        if (!candidate.hit || !query.accept(id, candidate.t, static_cast<std::uint32_t>(candidate.face))) return;
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
            if (!candidate.hit || !query.accept(id, candidate.t, 0)) arguments->valid[0] = 0;
            return;
        }
        const Real t = static_cast<Real>(reinterpret_cast<RTCRay*>(arguments->ray)->tfar);
        if (id == query.departed || !query.accept(id, t, 0)) arguments->valid[0] = 0;
    }
    static void filter_occluded(const RTCFilterFunctionNArguments* arguments) {
        auto& query = *reinterpret_cast<SingleQuery<Real>*>(arguments->context);
        const std::uint32_t id = (*query.native)[reinterpret_cast<RTCHit*>(arguments->hit)->primID];
        if (id == query.departed || id == query.light || (query.own_test && !single<false>(query, id).hit))
            arguments->valid[0] = 0;
        else
            query.found = true;
    }

    template <bool moving>
    static RayCallbacks for_rays() {
        return {.leaf = {packet_closest<moving>, packet_occluded<moving>},
            .user = {single_closest<moving>, single_occluded<moving>},
            .fine = {single_closest<false>, single_occluded<false>},
            .filter_closest = filter_closest,
            .filter_occluded = filter_occluded,
            .meshes = mesh_callbacks<Real>()};
    }
};

template <class Real>
Accelerator<Real>::Accelerator(RTCDevice device, const Tables<Real>& tables, std::size_t most_in_leaf)
    : tables_(tables),
      hierarchies_(device, tables, most_in_leaf,
          tables.moves ? Callbacks::template for_rays<true>() : Callbacks::template for_rays<false>()) {}

template <class Real>
Hit<Real> Accelerator<Real>::closest(
    const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure, Mask<Real> active, Lanes<Real> time) const {
    if (!hierarchies_.leaf) return closest_one_by_one(ray, departure, active, time);
    PacketQuery<Real> query{{}, &tables_, ray, left_by(tables_, departure), {}, traceable(ray, active), time, {}};
    query.hit = {Mask<Real>{}, ray.limit, Ints<Real>(UnsignedOf<Real>{0})};
    embree::initialise(query.context);
    typename Packet<Real>::Hit packet;
    alignas(64) int valid[packet_size<Real>]{};
    fill(packet.ray, valid, ray, query.active);
    for (unsigned& id : packet.hit.geomID) id = RTC_INVALID_GEOMETRY_ID;
    embree::intersect(hierarchies_.scene.get(), query.context, valid, packet);
    return query.hit;
}

template <class Real>
Mask<Real> Accelerator<Real>::occluded(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
    Ints<Real> light, Mask<Real> active, Lanes<Real> time) const {
    if (!hierarchies_.leaf) return occluded_one_by_one(ray, departure, light, active, time);
    PacketQuery<Real> query{{}, &tables_, ray, left_by(tables_, departure), light, traceable(ray, active), time, {}};
    embree::initialise(query.context);
    typename Packet<Real>::Ray packet;
    alignas(64) int valid[packet_size<Real>]{};
    fill(packet, valid, ray, query.active);
    embree::occluded(hierarchies_.scene.get(), query.context, valid, packet);
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
    query.native = &hierarchies_.native;
    query.own_test = hierarchies_.own_test;
    query.slack = hierarchies_.own_test ? hierarchies_.inflation : 0.0;
    query.light = no_primitive;
    Hit<Real> hit{Mask<Real>{}, ray.limit, Ints<Real>(U{0})};
    unsigned found = 0;
    for (unsigned left = traceable(ray, active).to_bits(); left != 0; left &= left - 1) {
        const int lane = std::countr_zero(left);
        RTCRayHit one;
        query.time = time[lane];
        query.user = &hierarchies_.user;
        query.meshes = hierarchies_.meshes.get();
        query.lead = query.slack;
        start_single(query, one.ray, ray, departure, lane);
        one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        embree::intersect(hierarchies_.scene.get(), query.context, one);
        if (hierarchies_.fine && start_near(query, one.ray, *hierarchies_.fine, hierarchies_.inflation))
            embree::intersect(hierarchies_.fine->scene.get(), query.context, one);
        if (!query.found) continue;
        if (one.hit.geomID == native_geometry && !hierarchies_.own_test) {
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
    query.native = &hierarchies_.native;
    query.own_test = hierarchies_.own_test;
    query.slack = hierarchies_.own_test ? hierarchies_.inflation : 0.0;
    unsigned blocked = 0;
    for (unsigned left = traceable(ray, active).to_bits(); left != 0; left &= left - 1) {
        const int lane = std::countr_zero(left);
        RTCRay one;
        query.time = time[lane];
        query.user = &hierarchies_.user;
        query.meshes = hierarchies_.meshes.get();
        query.lead = query.slack;
        start_single(query, one, ray, departure, lane);
        query.light = static_cast<std::uint32_t>(light[lane]);
        embree::occluded(hierarchies_.scene.get(), query.context, one);
        if (hierarchies_.fine && !query.found && start_near(query, one, *hierarchies_.fine, hierarchies_.inflation))
            embree::occluded(hierarchies_.fine->scene.get(), query.context, one);
        if (query.found) blocked |= 1u << lane;
    }
    return Mask<Real>::from_bits(blocked);
}

template class Accelerator<float>;
template class Accelerator<double>;

}  // namespace tandem::cpu
