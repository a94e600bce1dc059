// Whole paths in the fragment shader of a render pass.
#pragma once

#include "vulkan/renderer/recorders/whole_path_recorder.h"

namespace tandem {

class FragmentRecorder : public WholePathRecorder {
public:
    // Throws UnsupportedError where patterns or settings want what render passes have not.
    explicit FragmentRecorder(const RecorderInput& input);

private:
    void record_paths(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const override;

    std::uint32_t width_;
    const FullscreenPass& pass_;
    vk::raii::Framebuffer framebuffer_;
};

}  // namespace tandem
