// Planted bugs of several lines (common/render/planted_bugs.h), so that the path tracer has one line for each place.
#pragma once

#include <array>
#include <cstddef>

#include "cpu_ref/path_tracer/arithmetic/lanes.h"
#include "cpu_ref/planted.h"

namespace tandem::cpu {

// In the counter of MODEL.md section 3.
template <class Real>
TANDEM_INLINE void plant_in_counter(std::array<Ints<Real>, 4>& c) {
    using U = UnsignedOf<Real>;
    if (planted(PlantedBug::seed_repeated)) c[0] = c[0] & Ints<Real>(~U{4096});
    if (planted(PlantedBug::numbers_reused))
        c[2] = select(c[2] >> 2 == Ints<Real>(U{10}), c[2] - Ints<Real>(U{16}), c[2]);
}

// What a next event is weighed with (9.2): densities of both ways, and the cosine at the vertex.
template <class Shade>
struct WeighedLight {
    Lanes<Shade> density, scattered, cosine;
    std::size_t lights = 0;
};
template <class Shade>
TANDEM_INLINE void plant_in_next_event(const WeighedLight<Shade>& at, Lanes<Shade>& weight, Lanes<Shade>& transfer) {
    using S = Lanes<Shade>;
    constexpr double inverse_of_pi = 0.318309886183790671538;
    if (planted(PlantedBug::balance_on_one_side)) weight = at.density / (at.density + at.scattered);
    if (planted(PlantedBug::mis_weights_unequal) && at.lights > 1) weight = weight * S(Shade(0.5));
    if (planted(PlantedBug::cosine_dropped)) transfer = S(static_cast<Shade>(inverse_of_pi));
    if (planted(PlantedBug::inverse_pi_dropped)) transfer = at.cosine;
    transfer = transfer * S(static_cast<Shade>(planted_scale(PlantedBug::next_event_scaled)));
    if (planted(PlantedBug::reciprocal_short))
        for (int i = 0; i < lane_count<Shade>; ++i)
            transfer.v[i] *= at.density[i] * static_cast<Shade>(short_reciprocal(at.density[i]));
}

}  // namespace tandem::cpu
