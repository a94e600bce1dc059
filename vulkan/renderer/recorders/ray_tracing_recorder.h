// Whole paths whose hits the device's traversal of acceleration structures finds: in a ray-tracing pipeline, or in a
// compute kernel of ray queries.
#pragma once

#include "vulkan/renderer/recorders/whole_path_recorder.h"
#include "vulkan/renderer/scene/traced_world.h"

namespace tandem {

class RayTracingRecorder : public WholePathRecorder {
public:
    // Throws UnsupportedError where the device's own test cannot do what was asked for or the queue builds no
    // structures.
    explicit RayTracingRecorder(const RecorderInput& input);

private:
    void record_paths(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const override;

    TracedWorld world_;
};

}  // namespace tandem
