// Decides whether a ray hits a triangle if rounding leaves that in doubt (kernels.h). This is for few rays, one by one.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/vec3.h"

namespace tandem::cpu {

struct Settled {
    bool within;
    double nearest, farthest;  // of the corners along the ray: where a hit can be
};

// In double: corners projected along the ray, and the exact sign of their edge functions, edges and vertices included
// [Woop 2013]. A corner's projection depends on it and the ray alone, so whoever shares it agrees. A ray in the plane
// passes nothing.
[[nodiscard]] Settled settle_one(
    const std::array<Vec3<double>, 3>& corners, const Vec3<double>& origin, const Vec3<double>& direction);

template <class Real>
TANDEM_INLINE Vec3<double> widened(const Vec3<Real>& a) {
    return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)};
}

// Decides the lanes of `doubtful` in `within`, and keeps t between their corners: seen nearly edge-on, the plane gives
// any distance.
template <class Real>
[[gnu::noinline]] void settle(const std::array<Vec3<Real>, 3>& corners, const Vec3<Lanes<Real>>& origin,
    const Vec3<Lanes<Real>>& direction, Mask<Real> doubtful, Mask<Real>& within, Lanes<Real>& t) {
    const std::array<Vec3<double>, 3> wide{widened(corners[0]), widened(corners[1]), widened(corners[2])};
    unsigned decided = within.to_bits();
    for (unsigned left = doubtful.to_bits(); left != 0; left &= left - 1) {
        const int i = std::countr_zero(left);
        const Settled one = settle_one(wide, widened(Vec3<Real>{origin.x[i], origin.y[i], origin.z[i]}),
            widened(Vec3<Real>{direction.x[i], direction.y[i], direction.z[i]}));
        if (!one.within) continue;
        decided |= 1u << i;
        t.v[i] = least(greatest(t[i], static_cast<Real>(one.nearest)), static_cast<Real>(one.farthest));
    }
    within = Mask<Real>::from_bits(decided);
}

template <class Real>
requires std::is_floating_point_v<Real>
[[gnu::noinline]] void settle(const std::array<Vec3<Real>, 3>& corners, const Vec3<Real>& origin,
    const Vec3<Real>& direction, bool /*doubtful*/, bool& within, Real& t) {
    const Settled one = settle_one(
        {widened(corners[0]), widened(corners[1]), widened(corners[2])}, widened(origin), widened(direction));
    within = one.within;
    t = least(greatest(t, static_cast<Real>(one.nearest)), static_cast<Real>(one.farthest));
}

}  // namespace tandem::cpu
