// The Vulkan devices of this machine, as plain data, and which of them Tandem can use.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace tandem {

enum class DeviceType : std::uint32_t { other, integrated, discrete, virtual_gpu, cpu };

// Limits and abilities that the renderer depends on, as the device states them.
struct DeviceAbilities {
    bool compute_queue = false;
    std::uint32_t storage_buffers_per_stage = 0;  // maxPerStageDescriptorStorageBuffers
    std::uint32_t storage_buffers_per_set = 0;    // maxDescriptorSetStorageBuffers
    std::uint32_t workgroup_invocations = 0;      // maxComputeWorkGroupInvocations
    std::uint64_t storage_buffer_bytes = 0;       // maxStorageBufferRange
    std::uint64_t allocation_bytes = 0;           // maxMemoryAllocationSize
    std::uint64_t device_memory_bytes = 0;        // the largest device-local heap
    std::uint32_t timestamp_bits = 0;             // of the compute queue; 0: no device clock
    std::uint32_t resident_invocations = 0;       // that the device holds at once; 0: its driver does not tell
    std::uint32_t uniform_buffers_per_stage = 0;  // maxPerStageDescriptorUniformBuffers
    std::uint32_t uniform_buffers_per_set = 0;    // maxDescriptorSetUniformBuffers
    std::uint32_t uniform_buffer_bytes = 0;       // maxUniformBufferRange
    std::uint32_t bound_sets = 0;                 // maxBoundDescriptorSets
    std::uint32_t push_constant_bytes = 0;        // maxPushConstantsSize
};

struct DeviceDescription {
    std::uint32_t index = 0;  // as BackendOptions::device counts
    std::string name;
    DeviceType type = DeviceType::other;
    std::string driver_name;
    std::string driver_version;
    std::uint32_t api_major = 0, api_minor = 0, api_patch = 0;
    std::string uuid;  // 32 hexadecimal digits
    std::string pci;   // domain:bus:device.function, as 0000:3b:00.0; empty where the driver does not tell
    DeviceAbilities abilities;
    std::vector<std::string> features_used;  // optional ones that Tandem makes use of here
    bool suitable = false;
    std::string reason;  // why it is not suitable
};

// All devices, in the loader's order; none if there is no Vulkan on this machine. Throws DeviceError if the loader
// fails.
[[nodiscard]] std::vector<DeviceDescription> list_devices();

// {"devices": [{"index", "name", "type", "driver", "api", "uuid", "pci", "suitable", "reason", …}]}
[[nodiscard]] nlohmann::json to_json(const std::vector<DeviceDescription>& devices);
[[nodiscard]] nlohmann::json devices_as_json();  // of list_devices()
[[nodiscard]] std::string to_string(DeviceType type);

}  // namespace tandem
