// A scene made ready for the Embree path tracer in one precision (common/render/renderer.h, RenderJob).
#pragma once

#include <memory>

#include "common/render/renderer.h"
#include "cpu_ref/path_tracer/geometry/embree.h"

namespace tandem::cpu {

struct JobParts {
    RTCDevice device;  // must outlive the job
    const Scene& scene;
    const RenderSettings& settings;  // settings.effects: what to simulate (effects_to_simulate)
    unsigned threads;                // 0 is all
};

// By the smallest variant of the path tracer that simulates settings.effects.
[[nodiscard]] std::unique_ptr<RenderJob> make_render_job(const JobParts& parts, Precision precision);

// One variant (variants.h), defined in a file of its own, as each takes long to compile (variant.cpp.in).
// Real: of geometry; Shade: of shading.
template <class Real, std::uint64_t effects, class Shade = Real>
[[nodiscard]] std::unique_ptr<RenderJob> make_embree_job(const JobParts& parts);

}  // namespace tandem::cpu
