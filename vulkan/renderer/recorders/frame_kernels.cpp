#include "vulkan/renderer/recorders/frame_kernels.h"

namespace tandem {

FrameKernels::FrameKernels(const Device& device, const PipelineLayout& layout, const Stages::Pipelines& pipelines,
    const FrameResources& resources, const SceneData& scene, const gpu::Settings& told, std::uint32_t workgroup,
    const VulkanPatterns& patterns)
    : layout_(layout),
      pipelines_(pipelines),
      resources_(resources),
      primitives_(scene.triangle_count + scene.sphere_count + scene.cuboid_count),
      placed_by_host_(scene.in_double.has_value()),
      told_(told),
      workgroup_(workgroup),
      bindings_(device, layout, resources, patterns),
      ordering_(device, patterns, resources.written_by_dispatches()) {}

bool FrameKernels::has(Stage stage) const {
    return *pipelines_.stages[static_cast<std::size_t>(stage)] != vk::Pipeline();
}

gpu::Settings FrameKernels::settings(const Tile& tile, std::uint64_t sample) const {
    gpu::Settings result = told_;
    result.sample_index = {static_cast<std::uint32_t>(sample), static_cast<std::uint32_t>(sample >> 32)};
    result.first_pixel = tile.first_pixel;
    result.pixel_count = tile.pixel_count;
    result.listed = tile.listed;
    return result;
}

void FrameKernels::bind_data(
    const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, vk::PipelineBindPoint point) const {
    bindings_.bind(commands, dispatch.settings, dispatch.ray_parity, dispatch.sum_parity,
        pipelines_.plain[static_cast<std::size_t>(dispatch.stage)], point);
}

void FrameKernels::bind(
    const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, vk::PipelineBindPoint point) const {
    commands.bindPipeline(point, *pipelines_.stages[static_cast<std::size_t>(dispatch.stage)]);
    bind_data(commands, dispatch, point);
}

void FrameKernels::dispatch(
    const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t invocations) const {
    if (invocations == 0) return;
    bind(commands, dispatch);
    commands.dispatch((invocations + workgroup_ - 1) / workgroup_, 1, 1);
}

void FrameKernels::dispatch_queue(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const {
    bind(commands, dispatch);
    commands.dispatchIndirect(resources_.queues(), resources_.queue_offset(dispatch.settings.segment));
}

void FrameKernels::place_scene(
    const vk::raii::CommandBuffer& commands, const gpu::Settings& settings, std::uint32_t sum_parity) const {
    resources_.record_upload(commands);
    resources_.record_clear_counters(commands);
    barrier(commands, transfer_write, compute_access);
    if (placed_by_host_) return;
    dispatch(commands, {Stage::vertex, settings, 0, sum_parity}, primitives_);
    // Later barriers order all that was written before; those of single buffers leave out what is written but once.
    if (ordering_.leaves_out_others()) barrier(commands, compute_write, compute_access);
}

void FrameKernels::begin_submission() {
    bindings_.begin_submission();
    ordering_.begin_submission();
}

}  // namespace tandem
