#include "vulkan/core/device.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "common/error.h"
#include "vulkan/core/device_selection.h"
#include "vulkan/core/driver_remedy.h"

namespace tandem {

struct Device::Choice {
    DeviceDescription description;
    vk::raii::PhysicalDevice physical;

    static Choice make(const Instance& instance, const std::string& wanted) {
        vk::raii::PhysicalDevices devices = enumerate(instance);
        const std::vector<DeviceDescription> descriptions = describe_devices(devices);
        const std::size_t chosen = select_device(descriptions, wanted);
        return {descriptions[chosen], std::move(devices[chosen])};
    }

    static vk::raii::PhysicalDevices enumerate(const Instance& instance) {
        try {
            return vk::raii::PhysicalDevices(instance.handle());
        } catch (const vk::SystemError& failure) {
            throw DeviceError(std::string("no Vulkan device: ") + failure.what() + "; " + driver_remedy());
        }
    }
};

namespace {

bool offers(const vk::raii::PhysicalDevice& physical, std::string_view extension) {
    const auto extensions = physical.enumerateDeviceExtensionProperties();
    return std::ranges::any_of(
        extensions, [&](const vk::ExtensionProperties& one) { return one.extensionName == extension; });
}

// The latter for the former's sake.
constexpr std::array acceleration_extensions{
    VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME, VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME};

}  // namespace

DeviceFeatures features_of(const vk::raii::PhysicalDevice& physical) {
    const auto chain = physical.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features,
        vk::PhysicalDeviceSynchronization2FeaturesKHR, vk::PhysicalDeviceAccelerationStructureFeaturesKHR,
        vk::PhysicalDeviceRayTracingPipelineFeaturesKHR, vk::PhysicalDeviceRayQueryFeaturesKHR,
        vk::PhysicalDevicePresentIdFeaturesKHR, vk::PhysicalDevicePresentWaitFeaturesKHR>();
    const auto& plain = chain.get<vk::PhysicalDeviceFeatures2>().features;
    const auto& newer = chain.get<vk::PhysicalDeviceVulkan12Features>();
    DeviceFeatures features;
    features.timeline_semaphores = newer.timelineSemaphore;
    features.synchronization2 = offers(physical, VK_KHR_SYNCHRONIZATION_2_EXTENSION_NAME) &&
                                chain.get<vk::PhysicalDeviceSynchronization2FeaturesKHR>().synchronization2;
    features.push_descriptors = offers(physical, VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME);
    features.calibrated_timestamps = offers(physical, VK_EXT_CALIBRATED_TIMESTAMPS_EXTENSION_NAME);
    features.doubles = plain.shaderFloat64;
    features.fragment_stores = plain.fragmentStoresAndAtomics;
    features.stores_any_format = plain.shaderStorageImageWriteWithoutFormat;
    features.buffer_addresses = newer.bufferDeviceAddress;
    const bool structures =
        features.buffer_addresses &&
        std::ranges::all_of(acceleration_extensions, [&](const char* name) { return offers(physical, name); }) &&
        chain.get<vk::PhysicalDeviceAccelerationStructureFeaturesKHR>().accelerationStructure;
    features.ray_tracing = structures && offers(physical, VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME) &&
                           chain.get<vk::PhysicalDeviceRayTracingPipelineFeaturesKHR>().rayTracingPipeline;
    features.ray_queries = structures && offers(physical, VK_KHR_RAY_QUERY_EXTENSION_NAME) &&
                           chain.get<vk::PhysicalDeviceRayQueryFeaturesKHR>().rayQuery;
    features.present_waits = offers(physical, VK_KHR_PRESENT_ID_EXTENSION_NAME) &&
                             offers(physical, VK_KHR_PRESENT_WAIT_EXTENSION_NAME) &&
                             chain.get<vk::PhysicalDevicePresentIdFeaturesKHR>().presentId &&
                             chain.get<vk::PhysicalDevicePresentWaitFeaturesKHR>().presentWait;
    features.storage_arrays = plain.shaderStorageBufferArrayDynamicIndexing;
    features.storage_arrays_nonuniform = features.storage_arrays && newer.shaderStorageBufferArrayNonUniformIndexing;
    return features;
}

std::vector<std::string> names_of(const DeviceFeatures& features) {
    std::vector<std::string> names;
    const auto add = [&](bool there, const char* name) {
        if (there) names.emplace_back(name);
    };
    add(features.doubles, "doubles");
    add(features.timeline_semaphores, "timeline semaphores");
    add(features.synchronization2, "synchronization2");
    add(features.push_descriptors, "push descriptors");
    add(features.buffer_addresses, "buffer addresses");
    add(features.storage_arrays, "arrays of storage buffers");
    add(features.storage_arrays_nonuniform, "arrays of storage buffers, indexed non-uniformly");
    add(features.fragment_stores, "stores of fragments");
    add(features.stores_any_format, "stores to images of any format");
    add(features.calibrated_timestamps, "calibrated timestamps");
    add(features.ray_tracing, "ray tracing");
    add(features.ray_queries, "ray queries");
    add(features.present_waits, "waits for presentation");
    return names;
}

namespace {

std::vector<std::uint32_t> queue_counts(const vk::raii::PhysicalDevice& physical, std::uint32_t family, Queues queues) {
    std::vector<std::uint32_t> counts;
    for (const vk::QueueFamilyProperties& properties : physical.getQueueFamilyProperties())
        counts.push_back(queues == Queues::all ? properties.queueCount : 0);
    counts[family] = std::max(counts[family], 1u);
    return counts;
}

vk::raii::Device make_device(const vk::raii::PhysicalDevice& physical, const DeviceFeatures& has,
    const std::vector<std::uint32_t>& queue_counts, std::vector<const char*> extensions) {
    for (const char* extension : extensions)
        if (!offers(physical, extension))
            throw DeviceError(std::string(physical.getProperties().deviceName.data()) + " has no " + extension);
    const std::vector<float> priorities(*std::ranges::max_element(queue_counts), 1.0f);
    std::vector<vk::DeviceQueueCreateInfo> queues;
    for (std::uint32_t family = 0; family < queue_counts.size(); ++family)
        if (queue_counts[family] > 0)
            queues.push_back(vk::DeviceQueueCreateInfo({}, family, queue_counts[family], priorities.data()));
    constexpr const char* portability = "VK_KHR_portability_subset";  // Vulkan's headers call it provisional
    if (offers(physical, portability)) extensions.push_back(portability);
    if (has.synchronization2) extensions.push_back(VK_KHR_SYNCHRONIZATION_2_EXTENSION_NAME);
    if (has.push_descriptors) extensions.push_back(VK_KHR_PUSH_DESCRIPTOR_EXTENSION_NAME);
    if (has.calibrated_timestamps) extensions.push_back(VK_EXT_CALIBRATED_TIMESTAMPS_EXTENSION_NAME);
    if (has.ray_tracing || has.ray_queries)
        for (const char* extension : acceleration_extensions) extensions.push_back(extension);
    if (has.ray_tracing) extensions.push_back(VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME);
    if (has.ray_queries) extensions.push_back(VK_KHR_RAY_QUERY_EXTENSION_NAME);
    const bool presents =
        std::ranges::find(extensions, std::string_view(VK_KHR_SWAPCHAIN_EXTENSION_NAME)) != extensions.end();
    if (has.present_waits && presents)
        for (const char* extension : {VK_KHR_PRESENT_ID_EXTENSION_NAME, VK_KHR_PRESENT_WAIT_EXTENSION_NAME})
            extensions.push_back(extension);
    vk::PhysicalDeviceFeatures plain;
    plain.shaderFloat64 = has.doubles;
    plain.shaderStorageBufferArrayDynamicIndexing = has.storage_arrays;
    plain.fragmentStoresAndAtomics = has.fragment_stores;
    plain.shaderStorageImageWriteWithoutFormat = has.stores_any_format;
    vk::PhysicalDeviceVulkan12Features newer;
    newer.timelineSemaphore = has.timeline_semaphores;
    newer.bufferDeviceAddress = has.buffer_addresses;
    newer.shaderStorageBufferArrayNonUniformIndexing = has.storage_arrays_nonuniform;
    vk::StructureChain info(vk::DeviceCreateInfo({}, queues, {}, extensions, &plain), newer,
        vk::PhysicalDeviceSynchronization2FeaturesKHR(true), vk::PhysicalDeviceAccelerationStructureFeaturesKHR(true),
        vk::PhysicalDeviceRayTracingPipelineFeaturesKHR(true), vk::PhysicalDeviceRayQueryFeaturesKHR(true),
        vk::PhysicalDevicePresentIdFeaturesKHR(true), vk::PhysicalDevicePresentWaitFeaturesKHR(true));
    if (!has.synchronization2) info.unlink<vk::PhysicalDeviceSynchronization2FeaturesKHR>();
    if (!has.ray_tracing && !has.ray_queries) info.unlink<vk::PhysicalDeviceAccelerationStructureFeaturesKHR>();
    if (!has.ray_tracing) info.unlink<vk::PhysicalDeviceRayTracingPipelineFeaturesKHR>();
    if (!has.ray_queries) info.unlink<vk::PhysicalDeviceRayQueryFeaturesKHR>();
    if (!has.present_waits || !presents) {
        info.unlink<vk::PhysicalDevicePresentIdFeaturesKHR>();
        info.unlink<vk::PhysicalDevicePresentWaitFeaturesKHR>();
    }
    try {
        return vk::raii::Device(physical, info.get<vk::DeviceCreateInfo>());
    } catch (const vk::SystemError& failure) {
        throw DeviceError(std::string(physical.getProperties().deviceName.data()) +
                          " cannot be used: " + failure.what() + "; " + driver_remedy());
    }
}

std::vector<std::vector<vk::raii::Queue>> get_queues(
    const vk::raii::Device& device, const std::vector<std::uint32_t>& counts) {
    std::vector<std::vector<vk::raii::Queue>> queues(counts.size());
    for (std::uint32_t family = 0; family < counts.size(); ++family)
        for (std::uint32_t i = 0; i < counts[family]; ++i) queues[family].emplace_back(device, family, i);
    return queues;
}

}  // namespace

Device::Device(
    const Instance& instance, const std::string& wanted, Queues queues, const std::vector<const char*>& extensions)
    : Device(Choice::make(instance, wanted), queues, extensions) {}

Device::Device(Choice choice, Queues queues, const std::vector<const char*>& extensions)
    : description_(std::move(choice.description)),
      physical_(std::move(choice.physical)),
      limits_(physical_.getProperties().limits),
      memory_(physical_.getMemoryProperties()),
      family_(compute_queue_family(physical_).value()),
      features_(features_of(physical_)),
      device_(make_device(physical_, features_, queue_counts(physical_, family_, queues), extensions)),
      queues_(get_queues(device_, queue_counts(physical_, family_, queues))) {}

std::optional<std::uint32_t> Device::family_with(vk::QueueFlags wanted, vk::QueueFlags unwanted) const {
    const auto families = physical_.getQueueFamilyProperties();
    for (std::uint32_t i = 0; i < families.size(); ++i)
        if ((families[i].queueFlags & wanted) == wanted && !(families[i].queueFlags & unwanted)) return i;
    return std::nullopt;
}

std::uint32_t Device::memory_type(
    std::uint32_t allowed, vk::MemoryPropertyFlags properties, vk::MemoryPropertyFlags preferred) const {
    for (const vk::MemoryPropertyFlags wanted : {properties | preferred, properties})
        for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i)
            if ((allowed >> i & 1) != 0 && (memory_.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
    throw DeviceError(description_.name + " has no memory that is " + vk::to_string(properties));
}

}  // namespace tandem
