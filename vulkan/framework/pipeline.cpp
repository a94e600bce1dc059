#include "vulkan/framework/pipeline.h"

namespace tandem {

namespace {

std::vector<vk::raii::DescriptorSetLayout> make_sets(
    const Device& device, std::span<const SetBindings> sets, std::size_t pushed, vk::ShaderStageFlags visible) {
    std::vector<vk::raii::DescriptorSetLayout> layouts;
    for (const SetBindings& set : sets) {
        std::vector<vk::DescriptorSetLayoutBinding> bindings;
        for (std::uint32_t i = 0; i < set.size(); ++i) bindings.emplace_back(i, set[i].type, set[i].count, visible);
        vk::DescriptorSetLayoutCreateFlags flags;
        if (layouts.size() == pushed) flags = vk::DescriptorSetLayoutCreateFlagBits::ePushDescriptorKHR;
        layouts.emplace_back(device.handle(), vk::DescriptorSetLayoutCreateInfo(flags, bindings));
    }
    return layouts;
}

vk::raii::PipelineLayout make_layout(const Device& device, const std::vector<vk::raii::DescriptorSetLayout>& sets,
    std::uint32_t push_constant_bytes, vk::ShaderStageFlags visible) {
    std::vector<vk::DescriptorSetLayout> handles;
    for (const vk::raii::DescriptorSetLayout& set : sets) handles.push_back(*set);
    std::vector<vk::PushConstantRange> ranges;
    if (push_constant_bytes > 0) ranges.emplace_back(visible, 0, push_constant_bytes);
    return vk::raii::PipelineLayout(device.handle(), vk::PipelineLayoutCreateInfo({}, handles, ranges));
}

}  // namespace

PipelineLayout::PipelineLayout(const Device& device, std::span<const SetBindings> sets,
    std::uint32_t push_constant_bytes, std::size_t pushed, vk::ShaderStageFlags visible)
    : bindings_(sets.begin(), sets.end()),
      visible_(visible),
      sets_(make_sets(device, sets, pushed, visible)),
      layout_(make_layout(device, sets_, push_constant_bytes, visible)) {}

std::vector<vk::SpecializationMapEntry> map_entries(std::span<const SpecialisationConstant> constants) {
    std::vector<vk::SpecializationMapEntry> entries;
    for (const SpecialisationConstant& constant : constants)
        entries.emplace_back(constant.id,
            static_cast<std::uint32_t>(
                entries.size() * sizeof(SpecialisationConstant) + offsetof(SpecialisationConstant, value)),
            sizeof constant.value);
    return entries;
}

vk::raii::Pipeline make_compute_pipeline(const Device& device, const vk::raii::PipelineCache& cache,
    vk::PipelineLayout layout, std::span<const std::uint32_t> code, std::span<const SpecialisationConstant> constants,
    vk::PipelineCreateFlags flags, vk::Pipeline base) {
    const vk::raii::ShaderModule module(
        device.handle(), vk::ShaderModuleCreateInfo({}, code.size_bytes(), code.data()));
    const std::vector<vk::SpecializationMapEntry> entries = map_entries(constants);
    const vk::SpecializationInfo specialisation(
        static_cast<std::uint32_t>(entries.size()), entries.data(), constants.size_bytes(), constants.data());
    const vk::PipelineShaderStageCreateInfo stage(
        {}, vk::ShaderStageFlagBits::eCompute, *module, "main", &specialisation);
    return vk::raii::Pipeline(device.handle(), cache, vk::ComputePipelineCreateInfo(flags, stage, layout, base, -1));
}

}  // namespace tandem
