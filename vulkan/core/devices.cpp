#include "vulkan/devices.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "vulkan/core/device.h"
#include "vulkan/core/device_selection.h"
#include "vulkan/core/instance.h"

namespace tandem {

std::string to_string(DeviceType type) {
    switch (type) {
        case DeviceType::integrated:
            return "integrated GPU";
        case DeviceType::discrete:
            return "discrete GPU";
        case DeviceType::virtual_gpu:
            return "virtual GPU";
        case DeviceType::cpu:
            return "CPU";
        case DeviceType::other:
            break;
    }
    return "other";
}

std::vector<DeviceDescription> describe_devices(const vk::raii::PhysicalDevices& devices) {
    std::vector<DeviceDescription> descriptions;
    for (std::uint32_t i = 0; i < devices.size(); ++i) {
        DeviceDescription& description = descriptions.emplace_back(describe(devices[i], i));
        description.reason = unsuitability(description);
        description.suitable = description.reason.empty();
        if (!description.suitable) continue;
        for (std::string& name : names_of(features_of(devices[i])))
            description.features_used.push_back(std::move(name));
    }
    return descriptions;
}

std::vector<DeviceDescription> list_devices() {
    const Instance instance(false);
    try {
        return describe_devices(vk::raii::PhysicalDevices(instance.handle()));
    } catch (const vk::InitializationFailedError&) {
        return {};  // a loader without any driver
    }
}

nlohmann::json to_json(const std::vector<DeviceDescription>& devices) {
    nlohmann::json list = nlohmann::json::array();
    for (const DeviceDescription& device : devices) {
        const DeviceAbilities& has = device.abilities;
        nlohmann::json entry{{"index", device.index}, {"name", device.name}, {"type", to_string(device.type)},
            {"driver", device.driver_name + " " + device.driver_version}, {"driver_name", device.driver_name},
            {"driver_version", device.driver_version},
            {"api", fmt::format("{}.{}.{}", device.api_major, device.api_minor, device.api_patch)},
            {"uuid", device.uuid}, {"pci", device.pci}, {"features_used", device.features_used},
            {"suitable", device.suitable}};
        entry["abilities"] = {{"compute_queue", has.compute_queue},
            {"storage_buffers_per_stage", has.storage_buffers_per_stage},
            {"storage_buffers_per_set", has.storage_buffers_per_set},
            {"merges_storage_buffers", merges_storage_buffers(has)},
            {"uniform_buffers_per_stage", has.uniform_buffers_per_stage},
            {"uniform_buffers_per_set", has.uniform_buffers_per_set},
            {"uniform_buffer_bytes", has.uniform_buffer_bytes}, {"bound_sets", has.bound_sets},
            {"push_constant_bytes", has.push_constant_bytes}, {"workgroup_invocations", has.workgroup_invocations},
            {"storage_buffer_bytes", has.storage_buffer_bytes}, {"allocation_bytes", has.allocation_bytes},
            {"device_memory_bytes", has.device_memory_bytes}, {"timestamp_bits", has.timestamp_bits},
            {"resident_invocations", has.resident_invocations}};
        if (!device.suitable) entry["reason"] = device.reason;
        list.push_back(std::move(entry));
    }
    return {{"devices", std::move(list)}};
}

nlohmann::json devices_as_json() { return to_json(list_devices()); }

}  // namespace tandem
