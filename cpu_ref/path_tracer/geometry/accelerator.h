// Closest hits and occlusion through Embree (MODEL.md section 5). Embree finds the primitives that a ray may meet;
// whether and where it meets them is decided by the kernels of kernels.h, so that the hit is the same however it was
// found. A scene of few primitives is one leaf of user geometry, tested by a whole packet of rays at once. Otherwise
// rays go one by one through Embree's hierarchy, which holds plain triangles natively (single precision; slightly
// widened, so that its own test loses none) and everything else as user geometry. Primitives in motion are user
// geometry with bounds over the whole shutter; a ray meets them as the ray shifted back by their displacement (section
// 6).
#pragma once

#include <memory>

#include "cpu_ref/path_tracer/geometry/embree.h"
#include "cpu_ref/path_tracer/geometry/surface.h"
#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

template <class Real>
class Accelerator {
public:
    // At most so many primitives are tested as one leaf. Measured with 16 float lanes on mixed primitives, paths a
    // second against the hierarchy: 2.6 times as many at 16 primitives, 1.8 at 32, 1.3 at 64.
    static constexpr std::size_t leaf_limit = 64;

    // `tables` must outlive this. Throws Error if Embree fails.
    Accelerator(RTCDevice device, const Tables<Real>& tables, std::size_t most_in_leaf = leaf_limit);

    Accelerator(const Accelerator&) = delete;
    Accelerator& operator=(const Accelerator&) = delete;

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

private:
    [[nodiscard]] Hit<Real> closest_one_by_one(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
        Mask<Real> active, Lanes<Real> time) const;
    [[nodiscard]] Mask<Real> occluded_one_by_one(const Ray<Lanes<Real>>& ray, const Departure<Lanes<Real>>& departure,
        Ints<Real> light, Mask<Real> active, Lanes<Real> time) const;
    void add_native_triangles(RTCDevice device);
    void add_user_geometry(RTCDevice device, unsigned count);

    void set_fine_apart(RTCDevice device);
    [[nodiscard]] bool can_widen(std::uint32_t id) const;
    [[nodiscard]] std::array<glm::dvec3, 3> corners_of(std::uint32_t id) const;
    [[nodiscard]] std::array<glm::dvec3, 3> native_corners(std::uint32_t id) const;

    struct Callbacks;
    const Tables<Real>& tables_;
    bool leaf_;
    std::vector<std::uint32_t> native_, user_;  // primitive ids by Embree's primID
    bool own_test_ = true;                      // decides on native triangles
    double inflation_ = 0.0;                    // of bounds, world units
    embree::Scene scene_;
    // Triangles that are small beside `inflation_` and lie together, small themselves beside the scene, as of a fine
    // mesh far from all else: rays would meet the bounds of all. They have a hierarchy of their own, about their
    // middle, and rays start there where they come near. What rounds is then as small as they.
    struct Fine {
        embree::Scene scene;
        std::vector<std::uint32_t> ids;  // of primitives, by Embree's primID
        glm::dvec3 middle{0.0};
        double radius = 0.0, inflation = 0.0;  // of a sphere around all; of bounds
    };
    std::unique_ptr<Fine> fine_;
};

extern template class Accelerator<float>;
extern template class Accelerator<double>;

}  // namespace tandem::cpu
