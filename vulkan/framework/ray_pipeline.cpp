#include "vulkan/framework/ray_pipeline.h"

#include <cstring>

namespace tandem {

namespace {

using Properties = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR;

Properties properties_of(const Device& device) {
    return device.physical().getProperties2<vk::PhysicalDeviceProperties2, Properties>().get<Properties>();
}

vk::DeviceSize aligned(vk::DeviceSize offset, vk::DeviceSize alignment) {
    return (offset + alignment - 1) / alignment * alignment;
}

// Groups in the order of the table: generation, miss, hits.
vk::raii::Pipeline make_pipeline(const Device& device, vk::PipelineLayout layout, const RayPipeline::Code& code,
    std::span<const SpecialisationConstant> constants) {
    using Bit = vk::ShaderStageFlagBits;
    using Group = vk::RayTracingShaderGroupTypeKHR;
    const std::vector<vk::SpecializationMapEntry> entries = map_entries(constants);
    const vk::SpecializationInfo specialisation(
        static_cast<std::uint32_t>(entries.size()), entries.data(), constants.size_bytes(), constants.data());
    std::vector<vk::raii::ShaderModule> modules;
    std::vector<vk::PipelineShaderStageCreateInfo> stages;
    const auto add = [&](Bit stage, std::span<const std::uint32_t> words) {
        modules.emplace_back(device.handle(), vk::ShaderModuleCreateInfo({}, words.size_bytes(), words.data()));
        stages.emplace_back(vk::PipelineShaderStageCreateFlags(), stage, *modules.back(), "main", &specialisation);
        return static_cast<std::uint32_t>(stages.size() - 1);
    };
    std::vector<vk::RayTracingShaderGroupCreateInfoKHR> groups;
    constexpr std::uint32_t none = VK_SHADER_UNUSED_KHR;
    groups.emplace_back(Group::eGeneral, add(Bit::eRaygenKHR, code.generation), none, none, none);
    groups.emplace_back(Group::eGeneral, add(Bit::eMissKHR, code.miss), none, none, none);
    const std::uint32_t any_hit = add(Bit::eAnyHitKHR, code.any_hit);
    for (const std::span<const std::uint32_t> words : code.intersections)
        groups.emplace_back(Group::eProceduralHitGroup, none, none, any_hit, add(Bit::eIntersectionKHR, words));
    if (!code.triangle_closest_hit.empty())
        groups.emplace_back(Group::eTrianglesHitGroup, none, add(Bit::eClosestHitKHR, code.triangle_closest_hit),
            add(Bit::eAnyHitKHR, code.triangle_any_hit), none);
    return vk::raii::Pipeline(device.handle(), nullptr, nullptr,
        vk::RayTracingPipelineCreateInfoKHR({}, stages, groups, 1, nullptr, nullptr, nullptr, layout));
}

// Bytes from one part of the table to the next, and from one hit group to the next.
vk::DeviceSize part_bytes(const Properties& has, std::size_t groups) {
    return aligned(
        groups * aligned(has.shaderGroupHandleSize, has.shaderGroupHandleAlignment), has.shaderGroupBaseAlignment);
}

// With room to begin at an aligned address.
BufferGroup make_table(const Device& device, std::size_t hit_groups) {
    const Properties has = properties_of(device);
    const vk::DeviceSize bytes = 2 * part_bytes(has, 1) + part_bytes(has, hit_groups) + has.shaderGroupBaseAlignment;
    return BufferGroup(device, MemoryDomain::mapped,
        std::array{BufferSpec{
            bytes, vk::BufferUsageFlagBits::eShaderBindingTableKHR | vk::BufferUsageFlagBits::eShaderDeviceAddress}});
}

}  // namespace

RayPipeline::RayPipeline(const Device& device, vk::PipelineLayout layout, const Code& code,
    std::span<const SpecialisationConstant> constants)
    : pipeline_(make_pipeline(device, layout, code, constants)), table_(make_table(device, code.hit_groups())) {
    const Properties has = properties_of(device);
    const std::size_t handle = has.shaderGroupHandleSize, hit_groups = code.hit_groups();
    const auto groups = static_cast<std::uint32_t>(2 + hit_groups);
    const std::vector<std::byte> handles =
        pipeline_.getRayTracingShaderGroupHandlesKHR<std::byte>(0, groups, groups * handle);
    const vk::DeviceSize stride = aligned(handle, has.shaderGroupHandleAlignment), part = part_bytes(has, 1);
    const vk::DeviceAddress begin = device.handle().getBufferAddress(vk::BufferDeviceAddressInfo(table_[0]));
    const vk::DeviceAddress first = aligned(begin, has.shaderGroupBaseAlignment);
    const auto place = [&](std::uint32_t group, vk::DeviceSize offset) {
        std::memcpy(table_.mapped(0) + (first - begin) + offset, handles.data() + group * handle, handle);
    };
    place(0, 0);
    place(1, part);
    for (std::uint32_t i = 0; i < hit_groups; ++i) place(2 + i, 2 * part + i * stride);
    generation_ = vk::StridedDeviceAddressRegionKHR(
        first, part, part);  // stride and size of the generation record are to be equal
    miss_ = vk::StridedDeviceAddressRegionKHR(first + part, stride, stride);
    hits_ = vk::StridedDeviceAddressRegionKHR(first + 2 * part, stride, hit_groups * stride);
}

void RayPipeline::trace(const vk::raii::CommandBuffer& commands, std::uint32_t invocations) const {
    commands.traceRaysKHR(generation_, miss_, hits_, {}, invocations, 1, 1);
}

}  // namespace tandem
