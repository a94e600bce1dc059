#include "vulkan/renderer/recorders/wavefront_recorder.h"

namespace tandem {

// With the queue's arguments, for scatter too.
void WavefrontRecorder::order_segment(const vk::raii::CommandBuffer& commands) const {
    kernels().ordering().after_dispatches(commands, dispatch_access);
}

void WavefrontRecorder::record_segment(
    const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t) const {
    kernels().dispatch_queue(commands, dispatch);
}

}  // namespace tandem
