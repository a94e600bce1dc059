// Closest hits and occlusion through Embree (MODEL.md section 5). Embree finds the primitives that a ray may meet. The
// kernels of kernels.h decide whether and where it meets them, so that the hit is the same however it was found. A
// scene of few primitives is one leaf, tested by a whole packet of rays at once. Otherwise rays go one by one through
// Embree's hierarchy (hierarchies.h). A ray meets primitives in motion as the ray shifted back by their displacement
// (section 6).
#pragma once

#include "cpu_ref/path_tracer/geometry/hierarchies.h"
#include "cpu_ref/path_tracer/geometry/surface.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

template <class Real>
class Accelerator {
public:
    // `tables` must outlive this. Throws Error if Embree fails.
    Accelerator(RTCDevice device, const Tables<Real>& tables, std::size_t most_in_leaf = Hierarchies<Real>::leaf_limit);

    [[nodiscard]] Hit<Real> closest(
        const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure, Mask<Real> active) const {
        return closest(ray, departure, active, Lanes<Real>(Real(0)));
    }
    // `time` (section 4) counts where an entity moves.
    [[nodiscard]] Hit<Real> closest(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
        Mask<Real> active, Lanes<Real> time) const;
    // Does any primitive but `light` and the one left lie on the ray?
    [[nodiscard]] Mask<Real> occluded(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
        Ints<Real> light, Mask<Real> active) const {
        return occluded(ray, departure, light, active, Lanes<Real>(Real(0)));
    }
    [[nodiscard]] Mask<Real> occluded(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
        Ints<Real> light, Mask<Real> active, Lanes<Real> time) const;

    [[nodiscard]] double hierarchy_seconds() const { return hierarchies_.seconds; }  // JobFacts

private:
    [[nodiscard]] Hit<Real> closest_one_by_one(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
        Mask<Real> active, Lanes<Real> time) const;
    [[nodiscard]] Mask<Real> occluded_one_by_one(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
        Ints<Real> light, Mask<Real> active, Lanes<Real> time) const;

    struct Callbacks;
    const Tables<Real>& tables_;
    Hierarchies<Real> hierarchies_;
};

extern template class Accelerator<float>;
extern template class Accelerator<double>;

}  // namespace tandem::cpu
