// Storage buffers of a descriptor set as parts of one, for devices that let a shader stage see few of them. A uniform
// block beside it says where the parts begin; shaders are rewritten to look there (framework/spirv_merging.h).
#pragma once

#include <cstdint>
#include <vector>

#include "vulkan/resources/descriptor_sets.h"

namespace tandem {

// Storage buffers that a shader sees of these sets.
[[nodiscard]] std::uint32_t storage_buffers(const std::vector<SetBindings>& sets);

// Bindings of the set with its storage buffers merged. The first storage binding has them all. A uniform block after
// the last binding says where each begins. A set with one storage buffer or none stays as it is.
[[nodiscard]] SetBindings merged(const SetBindings& separate);
[[nodiscard]] bool is_merged(const SetBindings& separate);
// Which binding has them all.
[[nodiscard]] std::uint32_t whole_binding(const SetBindings& separate);
[[nodiscard]] inline std::uint32_t places_binding(const SetBindings& separate) {
    return static_cast<std::uint32_t>(separate.size());
}

// How many places the uniform block has, of each set.
[[nodiscard]] std::uint32_t most_bindings(const std::vector<SetBindings>& sets);

// By binding, the byte of the merged buffer at which its part begins; 0 for what is no storage buffer. `buffers` are
// those of the separate bindings, as are the next function's.
[[nodiscard]] std::vector<std::uint32_t> places_of(
    const SetBindings& separate, const std::vector<vk::DescriptorBufferInfo>& buffers);
// What merged bindings point to.
[[nodiscard]] std::vector<vk::DescriptorBufferInfo> merged(const SetBindings& separate,
    const std::vector<vk::DescriptorBufferInfo>& buffers, const vk::DescriptorBufferInfo& whole,
    const vk::DescriptorBufferInfo& places);

}  // namespace tandem
