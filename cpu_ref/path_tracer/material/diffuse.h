// Diffuse surfaces (MODEL.md section 7.2), a lane a path.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/sampling.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

// With pdf_not_of_sampler directions are uniform and still weighted as cosine ones.
template <class Real>
TANDEM_INLINE Vec3<Lanes<Real>> scatter_diffuse(const Vec3<Lanes<Real>>& facing, const RandomLanes<Real>& u) {
    using V = Lanes<Real>;
    const V second = planted(PlantedBug::dimension_reused) ? u[0] : planted(PlantedBug::number_exchanged) ? u[3] : u[1];
    Vec3<V> local = sample_cosine_hemisphere(u[0], second);
    if (planted(PlantedBug::pdf_not_of_sampler)) {
        const V z = V(Real(1)) - u[0], rho = sqrt(V(greatest(V(Real(1)) - z * z, V(Real(0)))));
        const auto [c, s] = cosine_sine_turns(second);
        local = {rho * c, rho * s, z};
    }
    return frame_about(facing).to_world(local);
}

}  // namespace tandem::cpu
