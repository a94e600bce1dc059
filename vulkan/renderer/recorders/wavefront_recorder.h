// The stages as a wavefront: each segment over the rays in its queue, dispatched indirectly.
#pragma once

#include "vulkan/renderer/recorders/stage_recorder.h"

namespace tandem {

class WavefrontRecorder : public StageRecorder {
public:
    using StageRecorder::StageRecorder;

private:
    void order_segment(const vk::raii::CommandBuffer& commands) const override;
    void record_segment(
        const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t places) const override;
    [[nodiscard]] bool counts_rays() const override { return true; }
};

}  // namespace tandem
