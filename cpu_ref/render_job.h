// A scene made ready for the Embree path tracer in one precision (common/renderer.h, RenderJob).
#pragma once

#include <memory>

#include "common/renderer.h"
#include "cpu_ref/embree.h"

namespace tandem::cpu {

// `device` must outlive the job. threads: 0 is all.
[[nodiscard]] std::unique_ptr<RenderJob> make_render_job(RTCDevice device, const Scene& scene,
    const RenderSettings& settings, Precision precision, unsigned threads, PlantedBug bug);

}  // namespace tandem::cpu
