// Whole paths in a ray-tracing pipeline, whose traversal finds hits.
#pragma once

#include "vulkan/renderer/recorders/whole_path_recorder.h"
#include "vulkan/renderer/scene/traced_world.h"

namespace tandem {

class RayTracingRecorder : public WholePathRecorder {
public:
    // Throws UnsupportedError where intersection shaders cannot do the scene or the queue builds no structures.
    explicit RayTracingRecorder(const RecorderInput& input);

private:
    void record_paths(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const override;

    TracedWorld world_;
};

}  // namespace tandem
