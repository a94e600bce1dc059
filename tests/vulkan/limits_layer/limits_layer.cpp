// A Vulkan layer for tests alone: each device seems to have the least limits that Vulkan 1.2 guarantees, of those that
// Tandem depends on. TANDEM_STORAGE_BUFFERS is how many storage buffers a stage may see, TANDEM_STORAGE_BYTES what it
// may see of one. TANDEM_BOUND_SETS is how many descriptor sets are bound. Without them, Vulkan's 4, 2^27 and 4 hold.
// Below the validation layer it makes that hold Tandem to them.
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>

namespace {

// The next layer's functions, or the driver's, of an instance: asked for while it is made, as the loader wants it.
struct Below {
    PFN_vkGetInstanceProcAddr get_function;
    PFN_vkGetPhysicalDeviceProperties get_properties;
    PFN_vkGetPhysicalDeviceProperties2 get_properties2;
};

std::mutex mutex;
std::map<void*, Below> instances;  // by the dispatch table that an instance and its devices share

template <class Handle>
void* key_of(Handle handle) {
    return *reinterpret_cast<void**>(handle);
}

template <class Handle>
Below below(Handle handle) {
    const std::scoped_lock lock(mutex);
    return instances.at(key_of(handle));
}

std::uint32_t told(const char* variable, std::uint32_t otherwise) {
    const char* text = std::getenv(variable);
    return text == nullptr ? otherwise : static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10));
}

// Table "Required Limits" of the specification.
void lower(VkPhysicalDeviceLimits& limits) {
    const auto at_most = [](std::uint32_t& limit, std::uint32_t most) { limit = std::min(limit, most); };
    const std::uint32_t storage_buffers = told("TANDEM_STORAGE_BUFFERS", 4);
    at_most(limits.maxPerStageDescriptorStorageBuffers, storage_buffers);
    at_most(limits.maxDescriptorSetStorageBuffers, std::max(24u, storage_buffers));
    at_most(limits.maxStorageBufferRange, told("TANDEM_STORAGE_BYTES", 1u << 27));
    at_most(limits.maxPerStageDescriptorUniformBuffers, 12);
    at_most(limits.maxDescriptorSetUniformBuffers, 72);
    at_most(limits.maxDescriptorSetUniformBuffersDynamic, 8);
    at_most(limits.maxUniformBufferRange, 1u << 14);
    at_most(limits.maxPerStageResources, 128);
    at_most(limits.maxBoundDescriptorSets, told("TANDEM_BOUND_SETS", 4));
    at_most(limits.maxPushConstantsSize, 128);
    at_most(limits.maxComputeWorkGroupInvocations, 128);
    at_most(limits.maxComputeWorkGroupSize[0], 128);
    at_most(limits.maxComputeSharedMemorySize, 1u << 14);
    for (std::uint32_t& count : limits.maxComputeWorkGroupCount) at_most(count, (1u << 16) - 1);
    limits.minStorageBufferOffsetAlignment = std::max<VkDeviceSize>(limits.minStorageBufferOffsetAlignment, 256);
    limits.minUniformBufferOffsetAlignment = std::max<VkDeviceSize>(limits.minUniformBufferOffsetAlignment, 256);
}

VKAPI_ATTR void VKAPI_CALL get_properties(VkPhysicalDevice device, VkPhysicalDeviceProperties* properties) {
    below(device).get_properties(device, properties);
    lower(properties->limits);
}

VKAPI_ATTR void VKAPI_CALL get_properties2(VkPhysicalDevice device, VkPhysicalDeviceProperties2* properties) {
    below(device).get_properties2(device, properties);
    lower(properties->properties.limits);
}

VKAPI_ATTR VkResult VKAPI_CALL create_instance(
    const VkInstanceCreateInfo* info, const VkAllocationCallbacks* allocator, VkInstance* instance) {
    auto* link = static_cast<VkLayerInstanceCreateInfo*>(const_cast<void*>(info->pNext));
    while (link != nullptr &&
           (link->sType != VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO || link->function != VK_LAYER_LINK_INFO))
        link = static_cast<VkLayerInstanceCreateInfo*>(const_cast<void*>(link->pNext));
    if (link == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
    const PFN_vkGetInstanceProcAddr of_next = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    const auto create = reinterpret_cast<PFN_vkCreateInstance>(of_next(nullptr, "vkCreateInstance"));
    const VkResult result = create(info, allocator, instance);
    if (result != VK_SUCCESS) return result;
    const auto function = [&](const char* name) { return of_next(*instance, name); };
    const std::scoped_lock lock(mutex);
    instances[key_of(*instance)] = {of_next,
        reinterpret_cast<PFN_vkGetPhysicalDeviceProperties>(function("vkGetPhysicalDeviceProperties")),
        reinterpret_cast<PFN_vkGetPhysicalDeviceProperties2>(function("vkGetPhysicalDeviceProperties2"))};
    return result;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_instance_function(VkInstance instance, const char* name) {
    const auto is = [&](const char* other) { return std::strcmp(name, other) == 0; };
    if (is("vkCreateInstance")) return reinterpret_cast<PFN_vkVoidFunction>(create_instance);
    if (is("vkGetInstanceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(get_instance_function);
    if (is("vkGetPhysicalDeviceProperties")) return reinterpret_cast<PFN_vkVoidFunction>(get_properties);
    if (is("vkGetPhysicalDeviceProperties2") || is("vkGetPhysicalDeviceProperties2KHR"))
        return reinterpret_cast<PFN_vkVoidFunction>(get_properties2);
    return instance == nullptr ? nullptr : below(instance).get_function(instance, name);
}

}  // namespace

// Functions of devices are the next one's.
extern "C" __attribute__((visibility("default"))) VKAPI_ATTR VkResult VKAPI_CALL vkNegotiateLoaderLayerInterfaceVersion(
    VkNegotiateLayerInterface* interface) {
    interface->loaderLayerInterfaceVersion = 2;
    interface->pfnGetInstanceProcAddr = get_instance_function;
    interface->pfnGetDeviceProcAddr = nullptr;
    interface->pfnGetPhysicalDeviceProcAddr = nullptr;
    return VK_SUCCESS;
}
