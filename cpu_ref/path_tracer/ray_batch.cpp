#include "cpu_ref/path_tracer/ray_batch.h"

#include <tbb/task_arena.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "common/error.h"
#include "common/stopwatch.h"
#include "cpu_ref/parallel.h"
#include "cpu_ref/path_tracer/geometry/accelerator.h"
#include "cpu_ref/path_tracer/geometry/surface.h"

namespace tandem::cpu {

namespace {

// Unit as it is, or made so (common/render/ray_batch.h). Scaled first, so that no square overflows or vanishes.
glm::dvec3 unit_direction(const glm::dvec3& d) {
    const double length = glm::length(d);
    if (std::abs(length - 1.0) <= 1e-6) return d;
    const double largest = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
    if (!(largest > 0.0) || !std::isfinite(largest)) return glm::dvec3(std::numeric_limits<double>::quiet_NaN());
    return glm::normalize(d / largest);
}

template <class Real>
Vec3<Lanes<Real>> lanes_of(const std::array<std::array<Real, lane_count<Real>>, 3>& a) {
    Vec3<Lanes<Real>> result;
    for (int i = 0; i < lane_count<Real>; ++i) {
        const auto lane = static_cast<std::size_t>(i);
        result.x.v[i] = a[0][lane];
        result.y.v[i] = a[1][lane];
        result.z.v[i] = a[2][lane];
    }
    return result;
}

template <class Real>
glm::dvec3 lane_of(const Vec3<Lanes<Real>>& a, int i) {
    return {static_cast<double>(a.x[i]), static_cast<double>(a.y[i]), static_cast<double>(a.z[i])};
}

template <class Real>
class EmbreeIntersector final : public RayIntersector {
public:
    EmbreeIntersector(RTCDevice device, const Scene& scene, const RenderSettings& settings, unsigned threads)
        : tables_(make_tables<Real>(scene, settings)),
          accelerator_(device, tables_),
          arena_(threads == 0 ? tbb::task_arena::automatic : static_cast<int>(threads)) {}

    [[nodiscard]] RayHits intersect(std::span<const GivenRay> rays) override {
        RayHits result;
        result.hits.resize(rays.size());
        const Stopwatch watch;
        constexpr std::size_t batch = 64 * lane_count<Real>;
        const auto batches = static_cast<std::uint32_t>((rays.size() + batch - 1) / batch);
        parallel_for(arena_, batches, [&](std::uint32_t index) {
            const std::size_t end = std::min(rays.size(), (index + 1) * batch);
            for (std::size_t first = index * batch; first < end; first += lane_count<Real>)
                intersect_packet(rays.subspan(first, std::min<std::size_t>(lane_count<Real>, end - first)),
                    std::span(result.hits).subspan(first));
        });
        result.seconds = watch.seconds();
        return result;
    }

private:
    void intersect_packet(std::span<const GivenRay> rays, std::span<RayHit> hits) const {
        using U = UnsignedOf<Real>;
        constexpr Real infinity = std::numeric_limits<Real>::infinity();
        std::array<std::array<Real, lane_count<Real>>, 3> origin{}, direction{};
        Lanes<Real> t_min(Real(0)), limit(infinity);
        Departure<Lanes<Real>> departure{Ints<Real>(U{no_primitive}), Mask<Real>{}};
        unsigned active = 0, inside = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const GivenRay& ray = rays[i];
            const glm::dvec3 d = unit_direction(ray.direction);
            for (int axis = 0; axis < 3; ++axis) {
                origin[static_cast<std::size_t>(axis)][i] = static_cast<Real>(ray.origin[axis]);
                direction[static_cast<std::size_t>(axis)][i] = static_cast<Real>(d[axis]);
            }
            const int lane = static_cast<int>(i);
            t_min.v[lane] = static_cast<Real>(ray.t_min);
            limit.v[lane] = std::nextafter(static_cast<Real>(ray.t_max), infinity);
            departure.primitive.v[lane] =
                tables_.meshes ? tables_.meshes->slot_of(ray.left_primitive) : ray.left_primitive;
            active |= 1u << i;
            if (ray.inside) inside |= 1u << i;
        }
        departure.inside = Mask<Real>::from_bits(inside);
        const Ray<Lanes<Real>> ray = make_ray(lanes_of<Real>(origin), lanes_of<Real>(direction), t_min, limit);
        const Hit<Real> hit = accelerator_.closest(ray, departure, Mask<Real>::from_bits(active));
        if (none(hit.found)) return;
        const Surface<Real> surface = surface_at(tables_, ray, hit);
        const Vec3<Lanes<Real>> front = leaving_origin(tables_, surface, surface.normal),
                                back = leaving_origin(tables_, surface, -surface.normal);
        for (unsigned left = hit.found.to_bits(); left != 0; left &= left - 1) {
            const int i = std::countr_zero(left);
            hits[static_cast<std::size_t>(i)] = {static_cast<double>(hit.t[i]),
                id_of(tables_, static_cast<std::uint32_t>(surface.primitive[i])), lane_of<Real>(surface.point, i),
                lane_of<Real>(surface.normal, i), lane_of<Real>(front, i), lane_of<Real>(back, i)};
        }
    }

    Tables<Real> tables_;
    Accelerator<Real> accelerator_;
    tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<RayIntersector> make_intersector(
    RTCDevice device, const Scene& scene, const RenderSettings& settings, Precision precision, unsigned threads) {
    check_kernels(settings.intersection, precision);
    if (precision == Precision::mixed)
        throw UnsupportedError(
            "the cpu backend traces whole paths in mixed precision; rays that are given it traces in single or double");
    if (precision == Precision::single_precision)
        return std::make_unique<EmbreeIntersector<float>>(device, scene, settings, threads);
    return std::make_unique<EmbreeIntersector<double>>(device, scene, settings, threads);
}

void check_kernels(const IntersectionSettings& chosen, Precision precision) {
    const bool embree = chosen.triangles == TriangleKernel::embree || chosen.triangles == TriangleKernel::embree_robust;
    if (embree && precision != Precision::single_precision)
        throw UnsupportedError(
            "Embree's own triangle tests are of single precision; use --precision single or another "
            "--triangle-test");
}

}  // namespace tandem::cpu
