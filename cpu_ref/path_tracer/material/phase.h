// The phase function of Henyey and Greenstein (MODEL.md section 10), a lane a path.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/sampling.h"

namespace tandem::cpu {

inline constexpr double inverse_four_pi = 0.07957747154594766788;

// p at unit d (the way of the light before) and w (after). With s = sign g, 1 + g^2 - 2 g mu = (1 - |g|)^2 +
// |g| |d - s w|^2, which does not cancel at the peak.
template <class V>
TANDEM_INLINE V phase_density(Vec3<V> d, Vec3<V> w, V g) {
    using Real = RealOf<V>;
    const V one(Real(1)), magnitude = absolute(g);
    const Vec3<V> apart = select(BoolOf<V>(g < V(Real(0))), d + w, d - w);
    const V gap = one - magnitude, x = gap * gap + magnitude * dot(apart, apart);
    return V(static_cast<Real>(inverse_four_pi)) * (one - g * g) / (x * sqrt(x));
}

template <class V>
TANDEM_INLINE Vec3<V> sample_phase(Vec3<V> d, V g, V u1, V u2) {
    using Real = RealOf<V>;
    const V one(Real(1)), two(Real(2)), zero(Real(0));
    const BoolOf<V> even = g == zero;
    const V divisor = select(even, one, g);
    const V s = (one - g * g) / (one - g + two * g * u1);
    const V bent = (one + g * g - s * s) / (two * divisor);
    const V mu = select(even, V(one - two * u1), least(greatest(bent, V(-one)), one));
    const V rho = sqrt(greatest(V(one - mu * mu), zero));
    const auto [c, sine] = cosine_sine_turns(u2);
    return frame_about(d).to_world({rho * c, rho * sine, mu});
}

}  // namespace tandem::cpu
