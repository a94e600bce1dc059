// Chooses the device of a renderer, by pure functions of descriptions. So tests can choose among invented devices.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <string>

#include "vulkan/devices.h"

namespace tandem {

// Storage buffers that the renderer's pipeline layout holds, all visible to every stage. Also how many it holds where
// those of a set are parts of one.
inline constexpr std::uint32_t storage_buffers_in_scene_set = 13;
inline constexpr std::uint32_t storage_buffers_in_ray_set = 16;
inline constexpr std::uint32_t storage_buffers_in_image_set = 3;
inline constexpr std::uint32_t separate_storage_buffers =
    storage_buffers_in_scene_set + storage_buffers_in_ray_set + storage_buffers_in_image_set;
inline constexpr std::uint32_t merged_storage_buffers = 3;
inline constexpr std::uint32_t workgroup_size = 128;  // invocations; every Vulkan device allows 128

// Whether the storage buffers of a set are to be parts of one: the device lets a stage, or all sets, have too few.
[[nodiscard]] bool merges_storage_buffers(const DeviceAbilities& abilities);

// Sets and what else they hold where buffers are merged, and what the kernels are told.
inline constexpr std::uint32_t bound_sets_needed = 4;
inline constexpr std::uint32_t merged_uniform_buffers = 8;
inline constexpr std::uint32_t uniform_block_bytes = 16384;
inline constexpr std::uint32_t settings_bytes = 100;

// A limit without which a device cannot be used, what Tandem needs and what Vulkan 1.2 guarantees everywhere.
struct NeededLimit {
    const char* name;
    std::uint32_t needed, guaranteed;
    std::uint32_t DeviceAbilities::*has;
};
inline constexpr std::array needed_limits{
    NeededLimit{
        "maxPerStageDescriptorStorageBuffers", merged_storage_buffers, 4, &DeviceAbilities::storage_buffers_per_stage},
    NeededLimit{
        "maxDescriptorSetStorageBuffers", merged_storage_buffers, 24, &DeviceAbilities::storage_buffers_per_set},
    NeededLimit{
        "maxPerStageDescriptorUniformBuffers", merged_uniform_buffers, 12, &DeviceAbilities::uniform_buffers_per_stage},
    NeededLimit{
        "maxDescriptorSetUniformBuffers", merged_uniform_buffers, 72, &DeviceAbilities::uniform_buffers_per_set},
    NeededLimit{"maxUniformBufferRange", uniform_block_bytes, 16384, &DeviceAbilities::uniform_buffer_bytes},
    NeededLimit{"maxBoundDescriptorSets", bound_sets_needed, 4, &DeviceAbilities::bound_sets},
    NeededLimit{"maxPushConstantsSize", settings_bytes, 128, &DeviceAbilities::push_constant_bytes},
    NeededLimit{"maxComputeWorkGroupInvocations", workgroup_size, 128, &DeviceAbilities::workgroup_invocations},
};
static_assert(
    std::ranges::all_of(needed_limits, [](const NeededLimit& limit) { return limit.needed <= limit.guaranteed; }));

// Why Tandem cannot use the device, naming the feature or limit; empty if it can.
[[nodiscard]] std::string unsuitability(const DeviceDescription& device);

// The position in `devices` of the one wanted: by index, by UUID, by PCI address, or by a part of its name in any case.
// For an empty `wanted` it is the best suitable one: discrete, integrated, virtual, CPU, other, the first of equals.
// Throws DeviceError, listing what there is, if none matches, and naming what is lacking if the match is not suitable.
[[nodiscard]] std::size_t select_device(std::span<const DeviceDescription> devices, const std::string& wanted);

}  // namespace tandem
