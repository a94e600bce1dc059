// Which device a renderer takes: pure functions over descriptions, so that tests can choose among invented ones.
#pragma once

#include <span>
#include <string>

#include "vulkan/devices.h"

namespace tandem {

// Storage buffers that the renderer's pipeline layout holds, all visible to every stage.
inline constexpr std::uint32_t storage_buffers_in_scene_set = 13;
inline constexpr std::uint32_t storage_buffers_in_ray_set = 16;
inline constexpr std::uint32_t storage_buffers_in_image_set = 3;
inline constexpr std::uint32_t storage_buffers_needed =
    storage_buffers_in_scene_set + storage_buffers_in_ray_set + storage_buffers_in_image_set;
inline constexpr std::uint32_t workgroup_size = 128;  // invocations; every Vulkan device allows 128

// Why Tandem cannot use the device, naming the feature or limit; empty if it can.
[[nodiscard]] std::string unsuitability(const DeviceDescription& device);

// The position in `devices` of the one wanted: by index, by UUID, by a part of its name in any case, or, for an empty
// `wanted`, the best suitable one: discrete, integrated, virtual, CPU, other, the first of equals. Throws DeviceError,
// listing what there is, if none matches, and naming what is lacking if the match is not suitable.
[[nodiscard]] std::size_t select_device(std::span<const DeviceDescription> devices, const std::string& wanted);

}  // namespace tandem
