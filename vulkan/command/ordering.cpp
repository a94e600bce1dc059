#include "vulkan/command/ordering.h"

#include <algorithm>

#include "common/error.h"
#include "vulkan/core/device_selection.h"

namespace tandem {

namespace {

// In one submission: a frame of 64 samples and 12 bounces has 1728 barriers.
constexpr std::uint32_t most_events = 4096;

constexpr StageAccess everything{
    vk::PipelineStageFlagBits::eAllCommands, vk::AccessFlagBits::eMemoryRead | vk::AccessFlagBits::eMemoryWrite};

std::vector<vk::BufferMemoryBarrier> buffer_barriers(
    const std::vector<vk::DescriptorBufferInfo>& written, vk::AccessFlags to) {
    std::vector<vk::BufferMemoryBarrier> barriers;
    for (const vk::DescriptorBufferInfo& buffer : written)
        barriers.emplace_back(compute_write.access, to, VK_QUEUE_FAMILY_IGNORED, VK_QUEUE_FAMILY_IGNORED, buffer.buffer,
            buffer.offset, buffer.range);
    return barriers;
}

// The flags of 1.0 have the same values in synchronization2.
vk::PipelineStageFlags2 wide(vk::PipelineStageFlags flags) {
    return vk::PipelineStageFlags2(static_cast<VkPipelineStageFlags>(flags));
}
vk::AccessFlags2 wide(vk::AccessFlags flags) { return vk::AccessFlags2(static_cast<VkAccessFlags>(flags)); }

void memory_v2(const vk::raii::CommandBuffer& commands, StageAccess to) {
    const vk::MemoryBarrier2 barrier(
        wide(compute_write.stage), wide(compute_write.access), wide(to.stage), wide(to.access));
    commands.pipelineBarrier2KHR(vk::DependencyInfo({}, barrier));
}

void buffer_v2(
    const vk::raii::CommandBuffer& commands, StageAccess to, const std::vector<vk::DescriptorBufferInfo>& written) {
    std::vector<vk::BufferMemoryBarrier2> barriers;
    for (const vk::DescriptorBufferInfo& buffer : written)
        barriers.emplace_back(wide(compute_write.stage), wide(compute_write.access), wide(to.stage), wide(to.access),
            VK_QUEUE_FAMILY_IGNORED, VK_QUEUE_FAMILY_IGNORED, buffer.buffer, buffer.offset, buffer.range);
    commands.pipelineBarrier2KHR(vk::DependencyInfo({}, {}, barriers));
}

void check(const Device& device, const VulkanPatterns& patterns) {
    const bool second =
        patterns.barriers == BarrierPattern::memory_v2 || patterns.barriers == BarrierPattern::buffer_v2;
    if (second && !device.features().synchronization2)
        throw UnsupportedError(device.description().name + " has no VK_KHR_synchronization2");
    if (patterns.barriers == BarrierPattern::event && patterns.recording == RecordingPattern::pre_recorded)
        throw UnsupportedError("events are handed out when commands are recorded: they cannot be pre-recorded");
}

}  // namespace

Ordering::Ordering(const Device& device, const VulkanPatterns& patterns, std::vector<vk::DescriptorBufferInfo> written)
    : device_(device),
      pattern_(patterns.barriers),
      orders_all_(merges_storage_buffers(device.description().abilities)),
      written_(std::move(written)) {
    check(device, patterns);
    if (pattern_ != BarrierPattern::event) return;
    for (std::uint32_t i = 0; i < most_events; ++i) events_.emplace_back(device.handle(), vk::EventCreateInfo());
}

bool Ordering::leaves_out_others() const {
    return pattern_ == BarrierPattern::buffer || pattern_ == BarrierPattern::buffer_apart ||
           pattern_ == BarrierPattern::buffer_v2;
}

void Ordering::begin_submission() {
    const std::uint32_t used = std::min(used_.exchange(0), most_events);
    for (std::uint32_t i = 0; i < used && !events_.empty(); ++i) events_[i].reset();
}

// Set and waited for at once: between the two would stand what needs no order.
void Ordering::wait_for_event(const vk::raii::CommandBuffer& commands, StageAccess to) const {
    const std::uint32_t i = used_.fetch_add(1);
    if (i >= most_events)
        throw UnsupportedError("a submission has more barriers than there are events; use fewer samples");
    const vk::Event event = *events_[i];
    commands.setEvent(event, compute_write.stage);
    commands.waitEvents(
        event, compute_write.stage, to.stage, vk::MemoryBarrier(compute_write.access, to.access), {}, {});
}

void Ordering::after_dispatches(const vk::raii::CommandBuffer& commands, StageAccess to) const {
    if (orders_all_) to = {to.stage | dispatch_access.stage, to.access | dispatch_access.access};
    switch (pattern_) {
        case BarrierPattern::memory:
            barrier(commands, compute_write, to);
            break;
        case BarrierPattern::full:
            barrier(commands, everything, everything);
            break;
        case BarrierPattern::buffer:
            commands.pipelineBarrier(compute_write.stage, to.stage, {}, {}, buffer_barriers(written_, to.access), {});
            break;
        case BarrierPattern::buffer_apart:
            for (const vk::BufferMemoryBarrier& one : buffer_barriers(written_, to.access))
                commands.pipelineBarrier(compute_write.stage, to.stage, {}, {}, one, {});
            break;
        case BarrierPattern::execution:
            commands.pipelineBarrier(compute_write.stage, to.stage, {}, {}, {}, {});
            break;
        case BarrierPattern::memory_v2:
            memory_v2(commands, to);
            break;
        case BarrierPattern::buffer_v2:
            buffer_v2(commands, to, written_);
            break;
        case BarrierPattern::event:
            wait_for_event(commands, to);
            break;
    }
}

}  // namespace tandem
