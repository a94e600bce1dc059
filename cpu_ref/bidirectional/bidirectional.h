// The integrator `bidirectional` (MODEL.md section 9.6) as a job of the cpu backend.
#pragma once

#include <memory>

#include "common/render/effects.h"
#include "common/render/renderer.h"
#include "cpu_ref/path_tracer/geometry/embree.h"

namespace tandem::cpu {

// In double precision, whatever was asked for: it gives no bits to compare. `threads` 0 is all. Throws
// UnsupportedError, with the reason, for scenes that it does not simulate.
[[nodiscard]] std::unique_ptr<RenderJob> make_bidirectional_job(
    RTCDevice device, const Scene& scene, const RenderSettings& settings, unsigned threads);

}  // namespace tandem::cpu
