// The intersection tests that settings may choose instead of the defaults (MODEL.md section 5.3), one ray at a time.
// They show what the textbooks' tests cost and lose, and are not made for speed.
#pragma once

#include "cpu_ref/path_tracer/tables.h"

namespace tandem::cpu {

// As `intersect` of kernels.h. Triangles given to Embree's own tests never come here.
template <class Real>
[[nodiscard]] Candidate<Real> intersect_as_chosen(
    const Tables<Real>& tables, const PrimitiveRef& ref, const Ray<Real>& ray, bool departing, bool inside);

extern template Candidate<float> intersect_as_chosen<float>(
    const Tables<float>&, const PrimitiveRef&, const Ray<float>&, bool, bool);
extern template Candidate<double> intersect_as_chosen<double>(
    const Tables<double>&, const PrimitiveRef&, const Ray<double>&, bool, bool);

}  // namespace tandem::cpu
