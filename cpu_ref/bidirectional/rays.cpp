#include "cpu_ref/bidirectional/rays.h"

#include <cmath>
#include <limits>

namespace tandem::cpu {
namespace {

using glm::dvec3;
using V = Lanes<double>;

constexpr double infinity = std::numeric_limits<double>::infinity();

Vec3<V> lanes_of(const dvec3& a) { return {V(a.x), V(a.y), V(a.z)}; }
dvec3 first_of(const Vec3<V>& a) { return {a.x[0], a.y[0], a.z[0]}; }

// Moved off the surface to the side of a direction.
dvec3 moved_off(const Place& place, const dvec3& direction) {
    return place.point + std::copysign(place.error, glm::dot(direction, place.normal)) * place.normal;
}

Departure<V> departure_of(const Place& from, const dvec3& direction) {
    const bool inside = glm::dot(direction, from.normal) < 0.0;
    return {Ints<double>(std::uint64_t{from.primitive}), Mask<double>::from_bits(inside ? 1u : 0u)};
}

const Mask<double> one_ray = Mask<double>::from_bits(1u);

}  // namespace

RayCaster::RayCaster(RTCDevice device, const Scene& scene, const RenderSettings& settings)
    : tables_(make_tables<double>(scene, settings)), accelerator_(device, tables_) {
    if (tables_.bounds.empty()) return;
    BoundingBox box = tables_.bounds.front();
    for (std::uint32_t id = 0; id < tables_.bounds.size(); ++id)
        for (const dvec3& shift : {dvec3(0.0), shift_of(id, 1.0)}) {
            box.low = glm::min(box.low, tables_.bounds[id].low + shift);
            box.high = glm::max(box.high, tables_.bounds[id].high + shift);
        }
    centre_ = 0.5 * (box.low + box.high);
    radius_ = 0.5 * glm::length(box.high - box.low);
}

dvec3 RayCaster::shift_of(std::uint32_t primitive, double time) const {
    const PrimitiveRef& ref = tables_.primitives[primitive];
    if (!ref.moves) return dvec3(0.0);
    const Vec3<double>& motion = tables_.motion_list[ref.entity];
    return time * dvec3(motion.x, motion.y, motion.z);
}

std::optional<Place> RayCaster::closest(const Place& from, const dvec3& direction, double time) const {
    const Ray<V> ray = make_ray(lanes_of(moved_off(from, direction)), lanes_of(direction), V(0.0), V(infinity));
    const Hit<double> hit = accelerator_.closest(ray, departure_of(from, direction), one_ray, V(time));
    if (!any(hit.found & one_ray)) return std::nullopt;
    const auto primitive = static_cast<std::uint32_t>(tables_.faces.primitive[hit.face][0]);
    const Surface<double> surface = tables_.primitives[primitive].moves
                                        ? surface_in_motion(tables_, ray, hit, lanes_of(shift_of(primitive, time)))
                                        : surface_at(tables_, ray, hit);
    const auto face = static_cast<std::uint32_t>(hit.face[0]) - tables_.primitives[primitive].first_face;
    return Place{first_of(surface.point), first_of(surface.normal), surface.error_bound[0], primitive,
        static_cast<std::uint32_t>(surface.material[0]), face};
}

bool RayCaster::free(const Place& from, const dvec3& direction, double distance, double time) const {
    const Ray<V> ray = make_ray(lanes_of(moved_off(from, direction)), lanes_of(direction), V(0.0), V(distance));
    return !any(one_ray & accelerator_.occluded(ray, departure_of(from, direction),
                              Ints<double>(std::uint64_t{no_primitive}), one_ray, V(time)));
}

bool RayCaster::sees(const Place& from, const Place& to, double time) const {
    const dvec3 start = moved_off(from, to.point - from.point);
    const dvec3 way = moved_off(to, from.point - to.point) - start;  // short of what `to` lies on
    const double distance = glm::length(way);
    return free(from, way / distance, distance, time);
}

bool RayCaster::sees_far(const Place& from, const dvec3& direction, double time) const {
    return free(from, direction, infinity, time);
}

dvec3 RayCaster::texture_colour(const Place& place, double time) const {
    return tables_.textures.colour(place.primitive, place.face, place.point - shift_of(place.primitive, time));
}

Place RayCaster::on_primitive(
    std::uint32_t primitive, std::uint32_t material, const dvec3& point, const dvec3& normal) const {
    const double reach = std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)});
    const dvec3 size = tables_.bounds[primitive].high - tables_.bounds[primitive].low;
    return {point, normal, error_factor<double> * (reach + glm::length(size)), primitive, material};
}

}  // namespace tandem::cpu
