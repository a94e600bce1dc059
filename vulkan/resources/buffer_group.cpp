#include "vulkan/resources/buffer_group.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

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
        case MemoryDomain::mapped:
            return {Flag::eHostVisible | Flag::eHostCoherent, Flag::eDeviceLocal};
        case MemoryDomain::readback:
            return {Flag::eHostVisible | Flag::eHostCoherent, Flag::eHostCached};
        case MemoryDomain::device:
            break;
    }
    return {Flag::eDeviceLocal, {}};
}

constexpr vk::DeviceSize least_bytes = 16;

vk::DeviceSize aligned(vk::DeviceSize offset, vk::DeviceSize alignment) {
    return (offset + alignment - 1) / alignment * alignment;
}

}  // namespace

void SharedMemory::reserve(MemoryDomain domain, std::span<const BufferSpec> specs) {
    // Before the buffers exist nothing is known of their alignment; no driver is known to ask for more.
    constexpr vk::DeviceSize most_alignment = 65536;
    for (const BufferSpec& spec : specs) blocks_[domain].bytes += aligned(spec.bytes + 1, most_alignment);
}

BufferGroup::BufferGroup(const Device& device, MemoryDomain domain, std::span<const BufferSpec> specs,
    MemoryLayout layout, SharedMemory* shared)
    : device_(device), domain_(domain), addressed_(std::ranges::any_of(specs, [](const BufferSpec& spec) {
          return static_cast<bool>(spec.usage & vk::BufferUsageFlagBits::eShaderDeviceAddress);
      })) {
    if (layout == MemoryLayout::one_buffer)
        make_one_buffer(specs);
    else
        make_buffers(specs);
    switch (layout) {
        case MemoryLayout::per_set:
        case MemoryLayout::one_buffer:
        case MemoryLayout::rays_per_set:
        case MemoryLayout::others_per_set:
            bind_together();
            break;
        case MemoryLayout::per_buffer:
        case MemoryLayout::dedicated:
            bind_apart(layout == MemoryLayout::dedicated);
            break;
        case MemoryLayout::one_block:
            if (shared == nullptr) throw Error("buffers in one block need the block");
            bind_shared(*shared);
            break;
    }
}

void BufferGroup::make_buffers(std::span<const BufferSpec> specs) {
    for (const BufferSpec& spec : specs) {
        const vk::DeviceSize bytes = std::max(spec.bytes, least_bytes);
        places_.push_back({buffers_.size(), 0, bytes});
        vk::BufferCreateInfo info({}, bytes, spec.usage, vk::SharingMode::eExclusive);
        if (spec.families.size() > 1)
            info.setSharingMode(vk::SharingMode::eConcurrent).setQueueFamilyIndices(spec.families);
        buffers_.emplace_back(device_.handle(), info);
    }
}

void BufferGroup::make_one_buffer(std::span<const BufferSpec> specs) {
    const vk::PhysicalDeviceLimits& limits = device_.limits();
    const vk::DeviceSize alignment =
        std::max({limits.minStorageBufferOffsetAlignment, limits.minUniformBufferOffsetAlignment, least_bytes});
    vk::DeviceSize total = 0;
    vk::BufferUsageFlags usage;
    for (const BufferSpec& spec : specs) {
        total = aligned(total, std::lcm(alignment, spec.element));
        places_.push_back({0, total, std::max(spec.bytes, least_bytes)});
        total += places_.back().bytes;
        usage |= spec.usage;
    }
    buffers_.emplace_back(device_.handle(), vk::BufferCreateInfo({}, total, usage, vk::SharingMode::eExclusive));
}

std::uint32_t BufferGroup::memory_type(std::uint32_t allowed) const {
    const auto [needed, preferred] = properties_of(domain_);
    return device_.memory_type(allowed, needed, preferred);
}

vk::raii::DeviceMemory BufferGroup::allocate(vk::DeviceSize bytes, std::uint32_t type, const void* next) const {
    try {
        const vk::MemoryAllocateFlagsInfo addressed(vk::MemoryAllocateFlagBits::eDeviceAddress, 0, next);
        vk::MemoryAllocateInfo info(bytes, type);
        info.setPNext(addressed_ ? &addressed : next);
        return vk::raii::DeviceMemory(device_.handle(), info);
    } catch (const vk::SystemError& failure) {
        throw Error(fmt::format("{} cannot allocate {} MiB ({}); render a smaller image", device_.description().name,
            (bytes >> 20) + 1, failure.what()));
    }
}

std::byte* BufferGroup::map(const vk::raii::DeviceMemory& memory) const {
    return domain_ == MemoryDomain::device ? nullptr : static_cast<std::byte*>(memory.mapMemory(0, VK_WHOLE_SIZE));
}

void BufferGroup::bind_together() {
    vk::DeviceSize total = 0;
    std::uint32_t allowed = ~0u;
    std::vector<vk::DeviceSize> offsets;
    for (const vk::raii::Buffer& buffer : buffers_) {
        const vk::MemoryRequirements needs = buffer.getMemoryRequirements();
        offsets.push_back(aligned(total, needs.alignment));
        total = offsets.back() + needs.size;
        allowed &= needs.memoryTypeBits;
    }
    memory_.push_back(allocate(total, memory_type(allowed), nullptr));
    for (std::size_t i = 0; i < buffers_.size(); ++i) buffers_[i].bindMemory(*memory_[0], offsets[i]);
    if (std::byte* mapped = map(memory_[0]))
        for (Place& place : places_) place.mapped = mapped + offsets[place.buffer] + place.offset;
}

void BufferGroup::bind_apart(bool dedicated) {
    for (std::size_t i = 0; i < buffers_.size(); ++i) {
        const vk::MemoryRequirements needs = buffers_[i].getMemoryRequirements();
        const vk::MemoryDedicatedAllocateInfo whole({}, *buffers_[i]);
        memory_.push_back(allocate(needs.size, memory_type(needs.memoryTypeBits), dedicated ? &whole : nullptr));
        buffers_[i].bindMemory(*memory_[i], 0);
        places_[i].mapped = map(memory_[i]);
    }
}

void BufferGroup::bind_shared(SharedMemory& shared) {
    SharedMemory::Block& block = shared.blocks_.at(domain_);
    for (std::size_t i = 0; i < buffers_.size(); ++i) {
        const vk::MemoryRequirements needs = buffers_[i].getMemoryRequirements();
        if (!*block.memory) {
            block.type = memory_type(needs.memoryTypeBits);
            block.memory = allocate(block.bytes, block.type, nullptr);
            block.mapped = map(block.memory);
        }
        const vk::DeviceSize offset = aligned(block.used, needs.alignment);
        block.used = offset + needs.size;
        if (block.used > block.bytes || (needs.memoryTypeBits >> block.type & 1) == 0)
            throw UnsupportedError(device_.description().name + " has no one memory block that takes all buffers");
        buffers_[i].bindMemory(*block.memory, offset);
        if (block.mapped != nullptr) places_[i].mapped = block.mapped + offset;
    }
}

}  // namespace tandem
