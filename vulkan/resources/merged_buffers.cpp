#include "vulkan/resources/merged_buffers.h"

#include <algorithm>

namespace tandem {

namespace {

bool is_storage(const SetBinding& binding) { return binding.type == vk::DescriptorType::eStorageBuffer; }

}  // namespace

std::uint32_t storage_buffers(const std::vector<SetBindings>& sets) {
    std::uint32_t count = 0;
    for (const SetBindings& set : sets)
        for (const SetBinding& binding : set)
            if (is_storage(binding)) count += binding.count;
    return count;
}

bool is_merged(const SetBindings& separate) { return storage_buffers({separate}) > 1; }

std::uint32_t most_bindings(const std::vector<SetBindings>& sets) {
    return static_cast<std::uint32_t>(std::ranges::max(sets, {}, &SetBindings::size).size());
}

std::uint32_t whole_binding(const SetBindings& separate) {
    return static_cast<std::uint32_t>(std::ranges::find_if(separate, is_storage) - separate.begin());
}

SetBindings merged(const SetBindings& separate) {
    if (!is_merged(separate)) return separate;
    SetBindings bindings = separate;
    for (std::uint32_t i = 0; i < bindings.size(); ++i)
        if (is_storage(bindings[i])) bindings[i].count = i == whole_binding(separate) ? 1 : 0;
    bindings.emplace_back(vk::DescriptorType::eUniformBuffer);
    return bindings;
}

std::vector<std::uint32_t> places_of(
    const SetBindings& separate, const std::vector<vk::DescriptorBufferInfo>& buffers) {
    std::vector<std::uint32_t> places;
    for (std::size_t i = 0; i < separate.size(); ++i)
        places.push_back(is_storage(separate[i]) ? static_cast<std::uint32_t>(buffers[i].offset) : 0);
    return places;
}

std::vector<vk::DescriptorBufferInfo> merged(const SetBindings& separate,
    const std::vector<vk::DescriptorBufferInfo>& buffers, const vk::DescriptorBufferInfo& whole,
    const vk::DescriptorBufferInfo& places) {
    std::vector<vk::DescriptorBufferInfo> result;
    for (std::uint32_t i = 0; i < separate.size(); ++i)
        if (i == whole_binding(separate))
            result.push_back(whole);
        else if (!is_storage(separate[i]))
            result.push_back(buffers[i]);
    result.push_back(places);
    return result;
}

}  // namespace tandem
