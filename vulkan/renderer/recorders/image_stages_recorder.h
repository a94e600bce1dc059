// The stages as the thesis has them: each over the whole image, rays at their pixels' places.
#pragma once

#include "vulkan/renderer/recorders/stage_recorder.h"

namespace tandem {

class ImageStagesRecorder : public StageRecorder {
public:
    using StageRecorder::StageRecorder;

protected:
    void order_segment(const vk::raii::CommandBuffer& commands) const override;
    void record_segment(
        const vk::raii::CommandBuffer& commands, const Dispatch& dispatch, std::uint32_t places) const override;
    [[nodiscard]] bool counts_rays() const override { return false; }
};

}  // namespace tandem
