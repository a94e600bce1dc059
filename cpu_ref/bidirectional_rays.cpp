#include "cpu_ref/bidirectional_rays.h"

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
    : tables_(make_tables<double>(scene, settings, PlantedBug::none)), accelerator_(device, tables_) {
    if (tables_.bounds.empty()) return;
    BoundingBox box = tables_.bounds.front();
    for (const BoundingBox& other : tables_.bounds) {
        box.low = glm::min(box.low, other.low);
        box.high = glm::max(box.high, other.high);
    }
    centre_ = 0.5 * (box.low + box.high);
    radius_ = 0.5 * glm::length(box.high - box.low);
}

std::optional<Place> RayCaster::closest(const Place& from, const dvec3& direction) const {
    const Ray<V> ray = make_ray(lanes_of(moved_off(from, direction)), lanes_of(direction), V(0.0), V(infinity));
    const Hit<double> hit = accelerator_.closest(ray, departure_of(from, direction), one_ray);
    if (!any(hit.found & one_ray)) return std::nullopt;
    const Surface<double> surface = surface_at(tables_, ray, hit);
    return Place{first_of(surface.point), first_of(surface.normal), surface.error_bound[0],
        static_cast<std::uint32_t>(surface.primitive[0]), static_cast<std::uint32_t>(surface.material[0])};
}

bool RayCaster::free(const Place& from, const dvec3& direction, double distance) const {
    const Ray<V> ray = make_ray(lanes_of(moved_off(from, direction)), lanes_of(direction), V(0.0), V(distance));
    return !any(one_ray & accelerator_.occluded(
                              ray, departure_of(from, direction), Ints<double>(std::uint64_t{no_primitive}), one_ray));
}

bool RayCaster::sees(const Place& from, const Place& to) const {
    const dvec3 start = moved_off(from, to.point - from.point);
    const dvec3 way = moved_off(to, from.point - to.point) - start;  // short of what `to` lies on
    const double distance = glm::length(way);
    return free(from, way / distance, distance);
}

bool RayCaster::sees_far(const Place& from, const dvec3& direction) const { return free(from, direction, infinity); }

Place RayCaster::on_primitive(
    std::uint32_t primitive, std::uint32_t material, const dvec3& point, const dvec3& normal) const {
    const double reach = std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)});
    const dvec3 size = tables_.bounds[primitive].high - tables_.bounds[primitive].low;
    return {point, normal, error_factor<double> * (reach + glm::length(size)), primitive, material};
}

}  // namespace tandem::cpu
