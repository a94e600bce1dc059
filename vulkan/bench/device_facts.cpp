#include "vulkan/bench/device_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "vulkan/core/device_clock.h"
#include "vulkan/framework/shader_library.h"

namespace tandem {

namespace {

template <class Bytes>
std::string hexadecimal(const Bytes& bytes) {
    std::string text;
    for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
    return text;
}

// FNV-1a over the words of all stages.
std::string spirv_hash() {
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (std::size_t stage = 0; stage < stage_count; ++stage)
        for (const std::uint32_t word : shader_code(static_cast<Stage>(stage))) hash = (hash ^ word) * 0x100000001b3u;
    return fmt::format("{:016x}", hash);
}

nlohmann::json queue_families(const vk::raii::PhysicalDevice& device) {
    nlohmann::json list = nlohmann::json::array();
    for (const vk::QueueFamilyProperties& family : device.getQueueFamilyProperties())
        list.push_back({{"flags", vk::to_string(family.queueFlags)}, {"queues", family.queueCount},
            {"timestamp_bits", family.timestampValidBits}});
    return list;
}

// How well the device's clock is known beside the host's, or why not.
nlohmann::json calibrated_clocks(const Device& device) {
    try {
        constexpr std::size_t readings = 50;
        const DeviceClock clock(device);
        std::vector<double> deviations;
        for (std::size_t i = 0; i < readings; ++i) deviations.push_back(1e9 * clock.now().deviation);
        std::ranges::sort(deviations);
        return {{"deviation_nanoseconds_median", deviations[readings / 2]},
            {"deviation_nanoseconds_greatest", deviations.back()}};
    } catch (const UnsupportedError& refusal) {
        return {{"not_applicable", refusal.what()}};
    }
}

nlohmann::json memory_types(const vk::raii::PhysicalDevice& device) {
    nlohmann::json list = nlohmann::json::array();
    const vk::PhysicalDeviceMemoryProperties memory = device.getMemoryProperties();
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
        const vk::MemoryType& type = memory.memoryTypes[i];
        list.push_back({{"flags", vk::to_string(type.propertyFlags)},
            {"heap_bytes", std::uint64_t{memory.memoryHeaps[type.heapIndex].size}}});
    }
    return list;
}

}  // namespace

nlohmann::json facts_of(const Device& device) {
    const DeviceDescription& description = device.description();
    const auto chain =
        device.physical().getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceIDProperties>();
    const auto& ids = chain.get<vk::PhysicalDeviceIDProperties>();
    std::vector<std::string> extensions;
    for (const vk::ExtensionProperties& extension : device.physical().enumerateDeviceExtensionProperties())
        extensions.emplace_back(extension.extensionName.data());
    std::ranges::sort(extensions);
    return {{"name", description.name}, {"type", to_string(description.type)}, {"driver_name", description.driver_name},
        {"driver_version", description.driver_version},
        {"api", fmt::format("{}.{}.{}", description.api_major, description.api_minor, description.api_patch)},
        {"device_uuid", hexadecimal(ids.deviceUUID)}, {"driver_uuid", hexadecimal(ids.driverUUID)},
        {"extensions", extensions}, {"queue_families", queue_families(device.physical())},
        {"memory_types", memory_types(device.physical())}, {"timestamp_bits", description.abilities.timestamp_bits},
        {"timestamp_period_nanoseconds", device.limits().timestampPeriod},
        {"storage_buffer_offset_alignment", std::uint64_t{device.limits().minStorageBufferOffsetAlignment}},
        {"calibrated_clocks", calibrated_clocks(device)}, {"allocations", device.limits().maxMemoryAllocationCount},
        {"spirv_hash", spirv_hash()}};
}

}  // namespace tandem
