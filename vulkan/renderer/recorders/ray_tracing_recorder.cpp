#include "vulkan/renderer/recorders/ray_tracing_recorder.h"

#include "common/error.h"
#include "vulkan/renderer/kernels/kernel_shape.h"

namespace tandem {

namespace {

// The acceleration structure's: in place of the set of settings, which are pushed.
constexpr auto traced_set = static_cast<std::uint32_t>(SetIndex::settings);

TracedGeometry geometry_of(const RecorderInput& input) {
    const KernelShape shape = input.patterns.tracer.kernel;
    if (const std::string reason = untraceable(shape, input.settings); !reason.empty()) throw UnsupportedError(reason);
    if (input.patterns.vulkan.queue.kind != QueueKind::rendering)
        throw UnsupportedError("acceleration structures belong to the queues that build them, which render");
    return traced_geometry(input.scene, input.data, input.specialisation.effects, has_device_triangles(shape));
}

Stage stage_of(const RecorderInput& input) {
    return has_ray_pipeline(input.patterns.tracer.kernel) ? Stage::rt_paths : Stage::rq_paths;
}

}  // namespace

RayTracingRecorder::RayTracingRecorder(const RecorderInput& input)
    : WholePathRecorder(input, stage_of(input)),
      world_(input.device, geometry_of(input), input.kernels.layout().set(traced_set)) {}

void RayTracingRecorder::record_paths(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const {
    const bool queries = dispatch.stage == Stage::rq_paths;
    const auto point = queries ? vk::PipelineBindPoint::eCompute : vk::PipelineBindPoint::eRayTracingKHR;
    commands.bindDescriptorSets(point, kernels().layout().handle(), traced_set, world_.descriptors(), {});
    if (queries) {
        kernels().dispatch(commands, dispatch, dispatch.settings.invocations);
        return;
    }
    // The pipeline comes after and before compute, to which all other barriers speak.
    const RayPipeline& pipeline = *kernels().pipelines().rays;
    barrier(commands, compute_write, tracing_access);
    commands.bindPipeline(point, pipeline.handle());
    kernels().bind_data(commands, dispatch, point);
    pipeline.trace(commands, dispatch.settings.invocations);
    barrier(commands, tracing_write, compute_access);
}

}  // namespace tandem
