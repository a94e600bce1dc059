#include "vulkan/renderer/recorders/fragment_recorder.h"

#include "common/error.h"

namespace tandem {

namespace {

const FullscreenPass& pass_of(const RecorderInput& input) {
    if (input.patterns.vulkan.recording == RecordingPattern::secondary ||
        input.patterns.vulkan.queue.kind != QueueKind::rendering)
        throw UnsupportedError("render passes begin in primary command buffers, on queues with graphics");
    if (input.specialisation.lists_pixels)
        throw UnsupportedError(
            "fragments cover runs of pixels, no lists of them; use another --kernel or --sampling uniform");
    return input.stages.fullscreen_pass();
}

}  // namespace

FragmentRecorder::FragmentRecorder(const RecorderInput& input)
    : WholePathRecorder(input, Stage::fragment),
      width_(input.settings.width),
      pass_(pass_of(input)),
      framebuffer_(pass_.make_framebuffer(width_, input.settings.height)) {}

// Fragments come after and before compute, to which all other barriers speak.
void FragmentRecorder::record_paths(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const {
    barrier(commands, compute_write, fragment_access);
    kernels().bind(commands, dispatch, vk::PipelineBindPoint::eGraphics);
    const std::uint32_t first = dispatch.settings.first_pixel + dispatch.settings.first_invocation;
    const std::uint32_t last = first + dispatch.settings.invocations - 1;
    pass_.draw(commands, *framebuffer_, width_, first / width_, last / width_ + 1);
    barrier(commands, fragment_write, compute_access);
}

}  // namespace tandem
