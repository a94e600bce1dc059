#include "vulkan/renderer/recorders/image_stages_recorder.h"

namespace tandem {

void ImageStagesRecorder::order_segment(const vk::raii::CommandBuffer& commands) const {
    kernels().ordering().after_dispatches(commands, compute_access);
}

void ImageStagesRecorder::record_segment(
    const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t places) const {
    kernels().dispatch(commands, dispatch, places);
}

}  // namespace tandem
