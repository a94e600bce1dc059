// Memory barriers as (stage, access) -> (stage, access).
#pragma once

#include <vulkan/vulkan_raii.hpp>

namespace tandem {

struct StageAccess {
    vk::PipelineStageFlags stage;
    vk::AccessFlags access;
};

inline constexpr StageAccess compute_write{vk::PipelineStageFlagBits::eComputeShader, vk::AccessFlagBits::eShaderWrite};
// Orders after reads too: a write that follows waits for them.
inline constexpr StageAccess compute_access{vk::PipelineStageFlagBits::eComputeShader,
    vk::AccessFlagBits::eShaderRead | vk::AccessFlagBits::eShaderWrite | vk::AccessFlagBits::eUniformRead};
inline constexpr StageAccess fragment_write{vk::PipelineStageFlagBits::eFragmentShader, compute_write.access};
inline constexpr StageAccess fragment_access{vk::PipelineStageFlagBits::eFragmentShader, compute_access.access};
// Access by the shaders of ray-tracing pipelines.
inline constexpr StageAccess tracing_write{vk::PipelineStageFlagBits::eRayTracingShaderKHR, compute_write.access};
inline constexpr StageAccess tracing_access{vk::PipelineStageFlagBits::eRayTracingShaderKHR,
    compute_access.access | vk::AccessFlagBits::eAccelerationStructureReadKHR};
inline constexpr StageAccess acceleration_write{
    vk::PipelineStageFlagBits::eAccelerationStructureBuildKHR, vk::AccessFlagBits::eAccelerationStructureWriteKHR};
inline constexpr StageAccess acceleration_read{
    vk::PipelineStageFlagBits::eAccelerationStructureBuildKHR, vk::AccessFlagBits::eAccelerationStructureReadKHR};
// With the arguments of indirect dispatches.
inline constexpr StageAccess dispatch_access{compute_access.stage | vk::PipelineStageFlagBits::eDrawIndirect,
    compute_access.access | vk::AccessFlagBits::eIndirectCommandRead};
inline constexpr StageAccess transfer_read{vk::PipelineStageFlagBits::eTransfer, vk::AccessFlagBits::eTransferRead};
inline constexpr StageAccess transfer_write{vk::PipelineStageFlagBits::eTransfer, vk::AccessFlagBits::eTransferWrite};
inline constexpr StageAccess host_read{vk::PipelineStageFlagBits::eHost, vk::AccessFlagBits::eHostRead};

inline void barrier(const vk::raii::CommandBuffer& commands, StageAccess from, StageAccess to) {
    commands.pipelineBarrier(from.stage, to.stage, {}, vk::MemoryBarrier(from.access, to.access), {}, {});
}

}  // namespace tandem
