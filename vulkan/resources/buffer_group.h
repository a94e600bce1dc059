// Buffers that share one memory allocation: the thesis's "cohesive" memory, one allocation a descriptor set.
#pragma once

#include <span>
#include <vector>

#include "vulkan/core/device.h"

namespace tandem {

enum class MemoryDomain {
    device,    // for the device alone
    upload,    // written by the host, read by the device once
    readback,  // written by the device, read by the host: cached where there is such a memory
};

struct BufferSpec {
    vk::DeviceSize bytes = 0;  // 0 is rounded up to one element of 16 bytes: an unused binding must still be valid
    vk::BufferUsageFlags usage;
};

class BufferGroup {
public:
    // Throws Error if the device cannot hold so much.
    BufferGroup(const Device& device, MemoryDomain domain, std::span<const BufferSpec> specs);

    [[nodiscard]] std::size_t size() const { return buffers_.size(); }
    [[nodiscard]] vk::Buffer operator[](std::size_t i) const { return *buffers_[i]; }
    // The whole of buffer i, or its first `bytes`, for a descriptor.
    [[nodiscard]] vk::DescriptorBufferInfo info(std::size_t i, vk::DeviceSize bytes = VK_WHOLE_SIZE) const {
        return {*buffers_[i], 0, bytes};
    }
    [[nodiscard]] vk::DeviceSize bytes(std::size_t i) const { return bytes_[i]; }
    // Host memory of buffer i: coherent, no flush is needed. Not for MemoryDomain::device.
    [[nodiscard]] std::byte* mapped(std::size_t i) const { return mapped_ + offsets_[i]; }

private:
    vk::raii::DeviceMemory memory_ = nullptr;
    std::vector<vk::raii::Buffer> buffers_;
    std::vector<vk::DeviceSize> bytes_, offsets_;
    std::byte* mapped_ = nullptr;
};

}  // namespace tandem
