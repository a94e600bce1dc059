// Descriptor sets and what they point to.
#pragma once

#include <span>
#include <vector>

#include "vulkan/core/device.h"

namespace tandem {

// A descriptor set's bindings 0, 1, 2, … are buffers of these types.
using SetBindings = std::vector<vk::DescriptorType>;

// Sets that live and die together, in one pool.
class DescriptorSets {
public:
    struct Request {
        vk::DescriptorSetLayout layout;
        SetBindings bindings;
        std::vector<vk::DescriptorBufferInfo> buffers;  // by binding
    };
    DescriptorSets(const Device& device, std::span<const Request> requests);

    [[nodiscard]] vk::DescriptorSet operator[](std::size_t i) const { return sets_[i]; }

private:
    vk::raii::DescriptorPool pool_;
    std::vector<vk::DescriptorSet> sets_;  // freed with the pool
};

}  // namespace tandem
