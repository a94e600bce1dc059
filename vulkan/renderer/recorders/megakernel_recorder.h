// Whole paths in one compute kernel, an invocation a pixel, or fewer that claim pixels one after the other.
#pragma once

#include "vulkan/renderer/recorders/whole_path_recorder.h"

namespace tandem {

class MegakernelRecorder : public WholePathRecorder {
public:
    // Throws UnsupportedError where pixels are to be claimed and the driver does not tell by how many invocations.
    explicit MegakernelRecorder(const RecorderInput& input);

private:
    void record_paths(const vk::raii::CommandBuffer& commands, const Dispatch& dispatch) const override;

    std::uint32_t claimants_;  // invocations of a dispatch at most; 0: one a place
};

}  // namespace tandem
