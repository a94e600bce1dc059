// How materials scatter (MODEL.md section 7), a lane a path. Each has a file of its own.
#pragma once

#include "cpu_ref/path_tracer/material/conductor.h"
#include "cpu_ref/path_tracer/material/dielectric.h"
#include "cpu_ref/path_tracer/material/diffuse.h"
#include "cpu_ref/path_tracer/material/rough_diffuse.h"
#include "cpu_ref/path_tracer/material/specular.h"

namespace tandem::cpu {

// Section 7.1.
template <class Real>
TANDEM_INLINE Vec3<Lanes<Real>> absorption(
    const Tables<Real>& tables, Ints<Real> material, Ints<Real> bits, const Vec3<Lanes<Real>>& colour) {
    using V = Lanes<Real>;
    const Mask<Real> translucent = has_bit(bits, UnsignedOf<Real>{material_bits::translucent});
    if (none(translucent)) return colour;
    const V one(Real(1)), alpha = tables.materials.alpha[material];
    const Vec3<V> clear{one - alpha * (one - colour.x), one - alpha * (one - colour.y), one - alpha * (one - colour.z)};
    return select(translucent, clear, colour);
}

}  // namespace tandem::cpu
