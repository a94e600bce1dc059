// Orders dispatches after one another, by the kind of barrier that VulkanPatterns choose.
#pragma once

#include <atomic>

#include "vulkan/command/barrier.h"
#include "vulkan/core/device.h"
#include "vulkan/patterns.h"

namespace tandem {

class Ordering {
public:
    // `written`: what dispatches write and others read. Throws UnsupportedError where the device lacks what the pattern
    // needs.
    Ordering(const Device& device, const VulkanPatterns& patterns, std::vector<vk::DescriptorBufferInfo> written);

    // Orders what follows after the writes of the dispatches before. From any thread.
    void after_dispatches(const vk::raii::CommandBuffer& commands, StageAccess to) const;
    // Buffers besides those that were named are left out of the barriers.
    [[nodiscard]] bool leaves_out_others() const;
    // Storage buffers are parts of one: dispatches are ordered that share no part, and indirect ones too. Vulkan would
    // not ask for it, but the validation layer follows whole descriptors.
    [[nodiscard]] bool orders_all() const { return orders_all_; }
    // Whatever was recorded before has run.
    void begin_submission();

private:
    void wait_for_event(const vk::raii::CommandBuffer& commands, StageAccess to) const;

    const Device& device_;
    BarrierPattern pattern_;
    bool orders_all_;
    std::vector<vk::DescriptorBufferInfo> written_;
    std::vector<vk::raii::Event> events_;
    mutable std::atomic<std::uint32_t> used_ = 0;  // of the events
};

}  // namespace tandem
