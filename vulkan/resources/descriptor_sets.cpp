#include "vulkan/resources/descriptor_sets.h"

#include <map>

namespace tandem {

namespace {

vk::raii::DescriptorPool make_pool(const Device& device, std::span<const DescriptorSets::Request> requests) {
    std::map<vk::DescriptorType, std::uint32_t> counts;
    for (const DescriptorSets::Request& request : requests)
        for (const SetBinding& binding : request.bindings) counts[binding.type] += binding.count;
    std::vector<vk::DescriptorPoolSize> sizes;
    for (const auto& [type, count] : counts) sizes.emplace_back(type, count);
    return vk::raii::DescriptorPool(
        device.handle(), vk::DescriptorPoolCreateInfo({}, static_cast<std::uint32_t>(requests.size()), sizes));
}

}  // namespace

std::vector<vk::WriteDescriptorSet> writes_of(
    vk::DescriptorSet set, const SetBindings& bindings, const std::vector<vk::DescriptorBufferInfo>& buffers) {
    std::vector<vk::WriteDescriptorSet> writes;
    std::size_t first = 0;
    for (std::uint32_t binding = 0; binding < bindings.size(); ++binding) {
        if (bindings[binding].count == 0) continue;
        writes.emplace_back(set, binding, 0, bindings[binding].count, bindings[binding].type, nullptr, &buffers[first]);
        first += bindings[binding].count;
    }
    return writes;
}

DescriptorSets::DescriptorSets(const Device& device, std::span<const Request> requests)
    : pool_(make_pool(device, requests)) {
    std::vector<vk::DescriptorSetLayout> layouts;
    for (const Request& request : requests) layouts.push_back(request.layout);
    sets_ =
        (*device.handle())
            .allocateDescriptorSets(vk::DescriptorSetAllocateInfo(*pool_, layouts), *device.handle().getDispatcher());
    for (std::size_t set = 0; set < requests.size(); ++set)
        if (!requests[set].buffers.empty())
            device.handle().updateDescriptorSets(
                writes_of(sets_[set], requests[set].bindings, requests[set].buffers), {});
}

}  // namespace tandem
