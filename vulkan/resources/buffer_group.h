// Buffers that belong together, as those of one descriptor set, and the memory that they lie in.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "vulkan/core/device.h"
#include "vulkan/patterns.h"

namespace tandem {

enum class MemoryDomain : std::uint32_t {
    device,    // for the device alone
    upload,    // the host's: written by it, read by the device
    mapped,    // written by the host, read by the device often: in its own memory if the host can reach that
    readback,  // written by the device, read by the host: cached where there is such a memory
};

struct BufferSpec {
    vk::DeviceSize bytes = 0;  // 0 is rounded up to one element of 16 bytes: an unused binding must still be valid
    vk::BufferUsageFlags usage;
    std::vector<std::uint32_t> families = {};  // of queues that share it; fewer than two: it is one's own
    vk::DeviceSize element = 32;  // in one buffer its part begins at a multiple of so many bytes: four doubles
};

// Memory for the buffers of several groups (MemoryLayout::one_block): one allocation a domain, of a size told before.
class SharedMemory {
public:
    // Announces buffers that a group will ask for.
    void reserve(MemoryDomain domain, std::span<const BufferSpec> specs);

private:
    friend class BufferGroup;
    struct Block {
        vk::raii::DeviceMemory memory = nullptr;
        vk::DeviceSize bytes = 0, used = 0;
        std::uint32_t type = 0;
        std::byte* mapped = nullptr;
    };
    std::map<MemoryDomain, Block> blocks_;
};

class BufferGroup {
public:
    // `shared` is needed for MemoryLayout::one_block alone and must outlive the group. Throws Error if the device
    // cannot hold so much.
    BufferGroup(const Device& device, MemoryDomain domain, std::span<const BufferSpec> specs,
        MemoryLayout layout = MemoryLayout::per_set, SharedMemory* shared = nullptr);

    [[nodiscard]] std::size_t size() const { return places_.size(); }
    // The buffer that holds part i, and where in it the part begins: 0 but for MemoryLayout::one_buffer.
    [[nodiscard]] vk::Buffer operator[](std::size_t i) const { return *buffers_[places_[i].buffer]; }
    [[nodiscard]] vk::DeviceSize offset(std::size_t i) const { return places_[i].offset; }
    // The whole of part i, or its first `bytes`, for a descriptor.
    [[nodiscard]] vk::DescriptorBufferInfo info(std::size_t i) const { return info(i, places_[i].bytes); }
    [[nodiscard]] vk::DescriptorBufferInfo info(std::size_t i, vk::DeviceSize bytes) const {
        return {(*this)[i], places_[i].offset, bytes};
    }
    // All parts of MemoryLayout::one_buffer.
    [[nodiscard]] vk::DescriptorBufferInfo whole() const {
        return {(*this)[0], 0, places_.back().offset + places_.back().bytes};
    }
    [[nodiscard]] vk::DeviceSize bytes(std::size_t i) const { return places_[i].bytes; }
    // Host memory of part i: coherent, no flush is needed. Not for MemoryDomain::device.
    [[nodiscard]] std::byte* mapped(std::size_t i) const { return places_[i].mapped; }

private:
    struct Place {
        std::size_t buffer = 0;
        vk::DeviceSize offset = 0, bytes = 0;
        std::byte* mapped = nullptr;
    };

    void make_buffers(std::span<const BufferSpec> specs);
    void make_one_buffer(std::span<const BufferSpec> specs);
    void bind_together();
    void bind_apart(bool dedicated);
    void bind_shared(SharedMemory& shared);
    [[nodiscard]] std::uint32_t memory_type(std::uint32_t allowed) const;
    [[nodiscard]] vk::raii::DeviceMemory allocate(vk::DeviceSize bytes, std::uint32_t type, const void* next) const;
    [[nodiscard]] std::byte* map(const vk::raii::DeviceMemory& memory) const;

    const Device& device_;
    MemoryDomain domain_;
    bool addressed_;  // shaders get addresses of buffers
    std::vector<vk::raii::DeviceMemory> memory_;
    std::vector<vk::raii::Buffer> buffers_;
    std::vector<Place> places_;
};

}  // namespace tandem
