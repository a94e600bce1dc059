// Numbers for samplers: a regular grid over the unit square, in lanes.
#pragma once

#include "cpu_ref/path_tracer/arithmetic/sampling.h"

namespace tandem::test {

// Calls visit(a, b) in lanes for the centres of an n x n grid over the unit square. The number n is a multiple of the
// lane count.
template <class Real, class Visit>
void for_grid(int n, Visit visit) {
    using cpu::lane_count, cpu::Lanes;
    for (int row = 0; row < n; ++row)
        for (int first = 0; first < n; first += lane_count<Real>) {
            Lanes<Real> a;
            for (int i = 0; i < lane_count<Real>; ++i)
                a.v[i] = (static_cast<Real>(first + i) + Real(0.5)) / static_cast<Real>(n);
            visit(a, Lanes<Real>((static_cast<Real>(row) + Real(0.5)) / static_cast<Real>(n)));
        }
}

}  // namespace tandem::test
