// Specular surfaces (MODEL.md section 7.3): mirrors and smooth dielectrics, and the effect of fuzz on their directions.
#pragma once

#include "cpu_ref/path_tracer/material/dielectric.h"

namespace tandem::cpu {

template <class Real>
struct Scattered {
    Vec3<Lanes<Real>> direction;
    Mask<Real> alive;
};

// Section 7.3 and 7.4: mirror or refracted direction, then fuzz. `normal` is the front one, `facing` that of the side
// which the ray comes from, `c` its cosine. `outside`: the index outside of the surface, where it is not 1.
template <class Real>
TANDEM_INLINE Scattered<Real> scatter_specular(const Tables<Real>& tables, Ints<Real> material, Ints<Real> bits,
    Mask<Real> lanes, const Vec3<Lanes<Real>>& direction, const Vec3<Lanes<Real>>& normal,
    const Vec3<Lanes<Real>>& facing, Lanes<Real> c, Mask<Real> front, const RandomLanes<Real>& u,
    const Lanes<Real>* outside = nullptr) {
    using V = Lanes<Real>;
    const V one(Real(1)), zero(Real(0));
    Vec3<V> w = along(direction, V(c + c), facing);
    Mask<Real> alive = lanes;
    const Mask<Real> translucent = has_bit(bits, UnsignedOf<Real>{material_bits::translucent}) & lanes;
    if (any(translucent)) {
        const V eta = relative_index(tables, material, front, outside);
        const auto [reflectance, ct, total] =
            dielectric(c, eta, has_bit(bits, UnsignedOf<Real>{material_bits::schlick}));
        const Mask<Real> refracts = translucent & !total & !(u[2] < reflectance);
        w = select(refracts, along(direction * eta, V(eta * c - ct), facing), w);
        if (planted(PlantedBug::total_reflection_lost)) alive = alive & !(translucent & total);
    }
    w = unit(w);
    const Mask<Real> fuzzy = has_bit(bits, UnsignedOf<Real>{material_bits::fuzzy}) & lanes;
    if (any(fuzzy)) {
        const Vec3<V> spread = along(w, tables.materials.fuzz[material], sample_sphere(u[0], u[1]));
        const V square = dot(spread, spread);
        const Vec3<V> perturbed = spread * V(one / sqrt(square));
        const Mask<Real> absorbed =
            (!(dot(perturbed, normal) * dot(w, normal) > zero)) | (square < V(static_cast<Real>(0x1p-40)));
        w = select(fuzzy, perturbed, w);
        alive = alive & !(fuzzy & absorbed);
    }
    return {w, alive};
}

}  // namespace tandem::cpu
