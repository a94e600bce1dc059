// Compute pipelines and their layouts.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vulkan/resources/descriptor_sets.h"

namespace tandem {

// Set layouts (all buffers) and the pipeline layout made of them.
class PipelineLayout {
public:
    static constexpr std::size_t no_set = ~std::size_t{0};

    // `pushed`: the set, if any, whose descriptors are pushed into command buffers (VK_KHR_push_descriptor).
    PipelineLayout(const Device& device, std::span<const SetBindings> sets, std::uint32_t push_constant_bytes,
        std::size_t pushed = no_set, vk::ShaderStageFlags visible = vk::ShaderStageFlagBits::eCompute);

    [[nodiscard]] vk::PipelineLayout handle() const { return *layout_; }
    [[nodiscard]] vk::DescriptorSetLayout set(std::size_t i) const { return *sets_[i]; }
    [[nodiscard]] const SetBindings& bindings(std::size_t i) const { return bindings_[i]; }
    [[nodiscard]] vk::ShaderStageFlags visible() const { return visible_; }

private:
    std::vector<SetBindings> bindings_;
    vk::ShaderStageFlags visible_;
    std::vector<vk::raii::DescriptorSetLayout> sets_;
    vk::raii::PipelineLayout layout_;
};

// A 32-bit specialisation constant: bool (0 or 1) or uint.
struct SpecialisationConstant {
    std::uint32_t id = 0;
    std::uint32_t value = 0;
};

// Where each constant's value stands among them.
[[nodiscard]] std::vector<vk::SpecializationMapEntry> map_entries(std::span<const SpecialisationConstant> constants);

// A pipeline of entry point `main`; `cache` may be null. `base`: one of the same code that it is derived from.
[[nodiscard]] vk::raii::Pipeline make_compute_pipeline(const Device& device, const vk::raii::PipelineCache& cache,
    vk::PipelineLayout layout, std::span<const std::uint32_t> code, std::span<const SpecialisationConstant> constants,
    vk::PipelineCreateFlags flags = {}, vk::Pipeline base = {});

}  // namespace tandem
