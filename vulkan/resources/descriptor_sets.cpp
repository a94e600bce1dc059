#include "vulkan/resources/descriptor_sets.h"

#include <map>

namespace tandem {

namespace {

vk::raii::DescriptorPool make_pool(const Device& device, std::span<const DescriptorSets::Request> requests) {
    std::map<vk::DescriptorType, std::uint32_t> counts;
    for (const DescriptorSets::Request& request : requests)
        for (const vk::DescriptorType type : request.bindings) ++counts[type];
    std::vector<vk::DescriptorPoolSize> sizes;
    for (const auto& [type, count] : counts) sizes.emplace_back(type, count);
    return vk::raii::DescriptorPool(
        device.handle(), vk::DescriptorPoolCreateInfo({}, static_cast<std::uint32_t>(requests.size()), sizes));
}

}  // namespace

DescriptorSets::DescriptorSets(const Device& device, std::span<const Request> requests)
    : pool_(make_pool(device, requests)) {
    std::vector<vk::DescriptorSetLayout> layouts;
    for (const Request& request : requests) layouts.push_back(request.layout);
    sets_ =
        (*device.handle())
            .allocateDescriptorSets(vk::DescriptorSetAllocateInfo(*pool_, layouts), *device.handle().getDispatcher());
    std::vector<vk::DescriptorBufferInfo> infos;
    for (const Request& request : requests) infos.insert(infos.end(), request.buffers.begin(), request.buffers.end());
    std::vector<vk::WriteDescriptorSet> writes;
    for (std::size_t set = 0; set < requests.size(); ++set)
        for (std::uint32_t binding = 0; binding < requests[set].bindings.size(); ++binding)
            writes.emplace_back(
                sets_[set], binding, 0, 1, requests[set].bindings[binding], nullptr, &infos[writes.size()]);
    device.handle().updateDescriptorSets(writes, {});
}

}  // namespace tandem
