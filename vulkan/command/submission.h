// Command buffers recorded on the fly and submitted together: one pool, reset as a whole before each submission.
#pragma once

#include <optional>
#include <vector>

#include "vulkan/core/device.h"

namespace tandem {

class Submission {
public:
    explicit Submission(const Device& device);

    // Forgets what was recorded; the last submission must have finished.
    void begin();
    // The next command buffer, begun; it stays valid until begin(). Command buffers run in this order.
    const vk::raii::CommandBuffer& next_command_buffer();
    // Ends all command buffers, submits them in one go and waits. Returns the seconds that the device spent between its
    // first and last command, where it has a clock.
    std::optional<double> run();

private:
    const Device& device_;
    vk::raii::CommandPool pool_;
    std::vector<vk::raii::CommandBuffer> buffers_;
    std::size_t used_ = 0;
    vk::raii::Fence fence_;
    vk::raii::QueryPool stamps_;
};

}  // namespace tandem
