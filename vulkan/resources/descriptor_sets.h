// Descriptor sets and their contents.
#pragma once

#include <span>
#include <vector>

#include "vulkan/core/device.h"

namespace tandem {

// A binding of buffers: one, or an array of them.
struct SetBinding {
    SetBinding(vk::DescriptorType type_, std::uint32_t count_ = 1) : type(type_), count(count_) {}
    vk::DescriptorType type;
    std::uint32_t count;
};

// A descriptor set's bindings 0, 1, 2, …
using SetBindings = std::vector<SetBinding>;

// What writes these bindings: `buffers` has the buffers of all of them in order, and must outlive it.
[[nodiscard]] std::vector<vk::WriteDescriptorSet> writes_of(
    vk::DescriptorSet set, const SetBindings& bindings, const std::vector<vk::DescriptorBufferInfo>& buffers);

// Sets that live and die together, in one pool.
class DescriptorSets {
public:
    struct Request {
        vk::DescriptorSetLayout layout;
        SetBindings bindings;
        std::vector<vk::DescriptorBufferInfo> buffers;  // by binding; none: the set is written later
    };
    DescriptorSets(const Device& device, std::span<const Request> requests);

    [[nodiscard]] vk::DescriptorSet operator[](std::size_t i) const { return sets_[i]; }

private:
    vk::raii::DescriptorPool pool_;
    std::vector<vk::DescriptorSet> sets_;  // freed with the pool
};

}  // namespace tandem
