// The place of a sample on the film within its pixel's filter (MODEL.md section 4.1), in lanes or for single numbers.
#pragma once

#include <array>
#include <cmath>

#include "common/render/renderer.h"
#include "cpu_ref/path_tracer/arithmetic/lanes.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

inline constexpr double gaussian_tail = 0.0013498980316300945;  // Phi(-3), which is cut off on either side

// By Horner's rule, the highest power first.
template <class V>
TANDEM_INLINE V polynomial(const std::array<double, 8>& coefficients, V x) {
    using Real = RealOf<V>;
    V sum(static_cast<Real>(coefficients[0]));
    for (std::size_t i = 1; i < coefficients.size(); ++i) sum = fma(sum, x, V(static_cast<Real>(coefficients[i])));
    return sum;
}

TANDEM_INLINE double logarithm(double x) { return std::log(x); }
template <class Real>
TANDEM_INLINE Lanes<Real> logarithm(Lanes<Real> x) {
    for (int i = 0; i < lane_count<Real>; ++i) x.v[i] = std::log(x.v[i]);
    return x;
}

// -Phi^-1(tail) of the normal distribution, for tail in [1e-9, 1/2]; `middle` is 1/2 - tail, to its own accuracy.
// Within 1e-16 of its value, but for rounding. [Wichura 1988, AS 241: PPND16]
template <class V>
TANDEM_INLINE V normal_quantile(V tail, V middle) {
    using Real = RealOf<V>;
    constexpr std::array near_above{2509.0809287301226727, 33430.575583588128105, 67265.770927008700853,
        45921.953931549871457, 13731.693765509461125, 1971.5909503065514427, 133.14166789178437745,
        3.387132872796366608};
    constexpr std::array near_below{5226.495278852854561, 28729.085735721942674, 39307.89580009271061,
        21213.794301586595867, 5394.1960214247511077, 687.1870074920579083, 42.313330701600911252, 1.0};
    constexpr std::array far_above{7.7454501427834140764e-4, 0.0227238449892691845833, 0.24178072517745061177,
        1.27045825245236838258, 3.64784832476320460504, 5.7694972214606914055, 4.6303378461565452959,
        1.42343711074968357734};
    constexpr std::array far_below{1.05075007164441684324e-9, 5.475938084995344946e-4, 0.0151986665636164571966,
        0.14810397642748007459, 0.68976733498510000455, 1.6763848301838038494, 2.05319162663775882187, 1.0};
    const V r = V(Real(0.180625)) - middle * middle;
    const V near = middle * (polynomial(near_above, r) / polynomial(near_below, r));
    const auto is_far = middle > V(Real(0.425));
    if (none(is_far)) return near;
    const V s = sqrt(V(-logarithm(tail))) - V(Real(1.6));
    return select(is_far, polynomial(far_above, s) / polynomial(far_below, s), near);
}

// How far from the middle, in pixels, for number 1/2 - side and, by symmetry, 1/2 + side, side being in [0, 1/2].
template <class V>
TANDEM_INLINE V distance_from_middle(PixelFilter filter, V side) {
    using Real = RealOf<V>;
    const V rest = V(Real(0.5)) - side, one(Real(1));  // exact: u has 24 bits
    if (planted(PlantedBug::filter_even)) return side * V(Real(filter == PixelFilter::tent ? 2 : 3));
    if (filter == PixelFilter::tent) return one - sqrt(V(V(Real(2)) * rest));
    const V kept(static_cast<Real>(1.0 - 2.0 * gaussian_tail)), tail(static_cast<Real>(gaussian_tail));
    return V(Real(0.5)) * normal_quantile(V(fma(kept, rest, tail)), V(kept * side));
}

// From number u along one axis to the place from the pixel's left or upper edge, in pixels. Rising in u.
template <class V>
[[gnu::noinline]] V place_by_filter(PixelFilter filter, V u) {
    using Real = RealOf<V>;
    const V half(Real(0.5)), zero(Real(0)), side = u - half;
    const V away = distance_from_middle(filter, V(select(side < zero, -side, side))) *
                   V(static_cast<Real>(planted_scale(PlantedBug::filter_width_scaled)));
    const V middle = planted(PlantedBug::filter_off_centre) ? zero : half;
    return middle + select(side < zero, -away, away);
}

}  // namespace tandem::cpu
