// Rays of the caller through the tracer's own accelerator and surfaces (common/render/ray_batch.h).
#pragma once

#include <memory>

#include "common/render/renderer.h"
#include "cpu_ref/path_tracer/geometry/embree.h"

namespace tandem::cpu {

// `threads` 0 is all. The device must outlive it. Throws UnsupportedError for kernels that the precision lacks.
[[nodiscard]] std::unique_ptr<RayIntersector> make_intersector(
    RTCDevice device, const Scene& scene, const RenderSettings& settings, Precision precision, unsigned threads);

// Throws UnsupportedError for kernels that the precision lacks.
void check_kernels(const IntersectionSettings& chosen, Precision precision);

}  // namespace tandem::cpu
