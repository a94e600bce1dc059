#include "vulkan/resources/buffer_group.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"

namespace tandem {

namespace {

struct Properties {
    vk::MemoryPropertyFlags needed, preferred;
};

Properties properties_of(MemoryDomain domain) {
    using Flag = vk::MemoryPropertyFlagBits;
    switch (domain) {
        case MemoryDomain::upload:
            return {Flag::eHostVisible | Flag::eHostCoherent, {}};
        case MemoryDomain::readback:
            return {Flag::eHostVisible | Flag::eHostCoherent, Flag::eHostCached};
        case MemoryDomain::device:
            break;
    }
    return {Flag::eDeviceLocal, {}};
}

}  // namespace

BufferGroup::BufferGroup(const Device& device, MemoryDomain domain, std::span<const BufferSpec> specs) {
    vk::DeviceSize total = 0;
    std::uint32_t allowed = ~0u;
    for (const BufferSpec& spec : specs) {
        bytes_.push_back(std::max<vk::DeviceSize>(spec.bytes, 16));
        buffers_.emplace_back(
            device.handle(), vk::BufferCreateInfo({}, bytes_.back(), spec.usage, vk::SharingMode::eExclusive));
        const vk::MemoryRequirements needs = buffers_.back().getMemoryRequirements();
        total = (total + needs.alignment - 1) / needs.alignment * needs.alignment;
        offsets_.push_back(total);
        total += needs.size;
        allowed &= needs.memoryTypeBits;
    }
    const auto [needed, preferred] = properties_of(domain);
    try {
        memory_ = vk::raii::DeviceMemory(
            device.handle(), vk::MemoryAllocateInfo(total, device.memory_type(allowed, needed, preferred)));
    } catch (const vk::SystemError& failure) {
        throw Error(fmt::format("{} cannot allocate {} MiB ({}); render a smaller image", device.description().name,
            (total >> 20) + 1, failure.what()));
    }
    for (std::size_t i = 0; i < buffers_.size(); ++i) buffers_[i].bindMemory(*memory_, offsets_[i]);
    if (domain != MemoryDomain::device) mapped_ = static_cast<std::byte*>(memory_.mapMemory(0, VK_WHOLE_SIZE));
}

}  // namespace tandem
