#include "vulkan/renderer/recorders/ray_tracing_recorder.h"

#include "common/error.h"

namespace tandem {

namespace {

// The acceleration structure's: in place of the set of settings, which the ray-tracing pipeline has pushed.
constexpr auto traced_set = static_cast<std::uint32_t>(SetIndex::settings);

KindBoxes boxes_of(const RecorderInput& input) {
    if (const std::string reason = untraceable(input.scene, input.settings); !reason.empty())
        throw UnsupportedError(reason);
    if (input.patterns.vulkan.queue.kind != QueueKind::rendering)
        throw UnsupportedError("acceleration structures belong to the queues that build them, which render");
    return traced_boxes(input.scene, input.data);
}

}  // namespace

RayTracingRecorder::RayTracingRecorder(const RecorderInput& input)
    : WholePathRecorder(input, Stage::rt_paths),
      world_(input.device, boxes_of(input), input.kernels.layout().set(traced_set)) {}

// The pipeline comes after and before compute, to which all other barriers speak.
void RayTracingRecorder::record_paths(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const {
    constexpr vk::PipelineBindPoint point = vk::PipelineBindPoint::eRayTracingKHR;
    const RayPipeline& pipeline = *kernels().pipelines().rays;
    barrier(commands, compute_write, tracing_access);
    commands.bindPipeline(point, pipeline.handle());
    kernels().bind_data(commands, dispatch, point);
    commands.bindDescriptorSets(point, kernels().layout().handle(), traced_set, world_.descriptors(), {});
    pipeline.trace(commands, dispatch.settings.invocations);
    barrier(commands, tracing_write, compute_access);
}

}  // namespace tandem
