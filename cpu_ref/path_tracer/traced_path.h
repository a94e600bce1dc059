// Paths of the Embree path tracer, vertex by vertex (common/render/path_trace.h).
#pragma once

#include <functional>
#include <span>
#include <stop_token>

#include "common/render/path_trace.h"
#include "cpu_ref/path_tracer/geometry/accelerator.h"

namespace tandem::cpu {

struct Batch;  // path_tracer.h

// The paths of samples of pixel (x, y), by the general variant of the path tracer, whose bits are those of the others.
// Defined in a file a precision (traced_path.cpp.in), as it takes long to compile.
template <class Real, class Shade>
[[nodiscard]] std::vector<PathTrace> traced_paths(const Tables<Real>& tables, const Tables<Shade>& shading,
    const Accelerator<Real>& accelerator, std::uint32_t x, std::uint32_t y, SampleRange samples,
    ChangedNumber changed = {});

// One thread's: of the paths of a batch, each one's first vertex, by the number of the path (PathTracer::run). They
// last until the next call. After a stop they are unfinished. Defined likewise.
using FirstVertexTracer = std::function<std::span<TracedVertex>(const Batch& batch, const std::stop_token& stop)>;
template <class Real, class Shade>
[[nodiscard]] FirstVertexTracer first_vertex_tracer(
    const Tables<Real>& tables, const Tables<Shade>& shading, const Accelerator<Real>& accelerator);

}  // namespace tandem::cpu
