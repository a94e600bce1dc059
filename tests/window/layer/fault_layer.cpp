// A Vulkan layer that lets chosen calls fail as a window system or a device in trouble would, so that tests need
// neither. TANDEM_FAULTS="acquire 5 out-of-date, present 7 suboptimal, submit 9 lost": which call of the kind, and its
// answer. A lost device answers so ever after.
//
// TANDEM_PRESENT_WAIT=1: the device has VK_KHR_present_wait. A wait is answered at once if that image was presented, by
// VK_TIMEOUT if not.
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#define LAYER_EXPORT extern "C" __attribute__((visibility("default")))

namespace {

struct Faults {
    std::map<std::pair<std::string, std::uint64_t>, VkResult> wanted;  // by call and its number, from 1 on
    std::map<std::string, std::uint64_t> calls;
    bool lost = false;
};

VkResult result_named(const std::string& name) {
    if (name == "out-of-date") return VK_ERROR_OUT_OF_DATE_KHR;
    if (name == "suboptimal") return VK_SUBOPTIMAL_KHR;
    if (name == "surface-lost") return VK_ERROR_SURFACE_LOST_KHR;
    if (name == "lost") return VK_ERROR_DEVICE_LOST;
    std::abort();  // a test with a wrong name must not pass
}

Faults read_faults() {
    Faults faults;
    const char* text = std::getenv("TANDEM_FAULTS");
    std::stringstream list(text != nullptr ? text : "");
    for (std::string one; std::getline(list, one, ',');) {
        std::stringstream words(one);
        std::string call, answer;
        std::uint64_t number = 0;
        words >> call >> number >> answer;
        faults.wanted[{call, number}] = result_named(answer);
    }
    return faults;
}

std::mutex mutex;
Faults faults = read_faults();
std::map<void*, PFN_vkGetDeviceProcAddr> devices;                            // the next layer's, by dispatch table
std::map<void*, PFN_vkGetInstanceProcAddr> instances;                        // likewise
std::map<void*, PFN_vkEnumerateDeviceExtensionProperties> extensions_below;  // by that of the instance
std::map<void*, PFN_vkGetPhysicalDeviceFeatures2> features_below;  // physical devices share their instance's table

void* key(const void* handle) { return *static_cast<void* const*>(handle); }

// What the call is to answer; VK_SUCCESS: what it does.
VkResult fault_of(const char* call) {
    const std::scoped_lock lock(mutex);
    if (faults.lost) return VK_ERROR_DEVICE_LOST;
    const auto found = faults.wanted.find({call, ++faults.calls[call]});
    if (found == faults.wanted.end()) return VK_SUCCESS;
    faults.lost = found->second == VK_ERROR_DEVICE_LOST;
    return found->second;
}

template <class Function>
Function next_of(const void* handle, VkDevice device, const char* name) {
    const std::scoped_lock lock(mutex);
    return reinterpret_cast<Function>(devices.at(key(handle))(device, name));
}

std::map<void*, VkDevice> device_of_queue;          // they share a dispatch table with their device
std::map<VkSwapchainKHR, std::uint64_t> presented;  // the greatest identity of an image

bool waits_for_present() { return std::getenv("TANDEM_PRESENT_WAIT") != nullptr; }

// The structure of that type in a chain; null: there is none.
template <class Structure>
Structure* in_chain(const void* chain, VkStructureType type) {
    for (auto* one = static_cast<const VkBaseInStructure*>(chain); one != nullptr; one = one->pNext)
        if (one->sType == type) return reinterpret_cast<Structure*>(const_cast<VkBaseInStructure*>(one));
    return nullptr;
}

VKAPI_ATTR VkResult VKAPI_CALL acquire(VkDevice device, VkSwapchainKHR swapchain, std::uint64_t timeout,
    VkSemaphore semaphore, VkFence fence, std::uint32_t* image) {
    const VkResult fault = fault_of("acquire");
    if (fault < 0) return fault;
    const VkResult result = next_of<PFN_vkAcquireNextImageKHR>(device, device, "vkAcquireNextImageKHR")(
        device, swapchain, timeout, semaphore, fence, image);
    return result == VK_SUCCESS ? fault : result;
}

// An image that is out of date is handed over all the same, and its semaphores are waited for.
VKAPI_ATTR VkResult VKAPI_CALL present(VkQueue queue, const VkPresentInfoKHR* info) {
    const VkResult fault = fault_of("present");
    if (fault == VK_ERROR_DEVICE_LOST) return fault;
    const VkResult result =
        next_of<PFN_vkQueuePresentKHR>(queue, device_of_queue.at(key(queue)), "vkQueuePresentKHR")(queue, info);
    const auto* identities = in_chain<VkPresentIdKHR>(info->pNext, VK_STRUCTURE_TYPE_PRESENT_ID_KHR);
    const std::scoped_lock lock(mutex);
    for (std::uint32_t i = 0; identities != nullptr && i < info->swapchainCount; ++i)
        presented[info->pSwapchains[i]] = identities->pPresentIds[i];
    return result == VK_SUCCESS ? fault : result;
}

VKAPI_ATTR VkResult VKAPI_CALL wait_for_present(
    VkDevice, VkSwapchainKHR swapchain, std::uint64_t identity, std::uint64_t) {
    const std::scoped_lock lock(mutex);
    return presented[swapchain] >= identity ? VK_SUCCESS : VK_TIMEOUT;
}

VKAPI_ATTR void VKAPI_CALL features(VkPhysicalDevice physical, VkPhysicalDeviceFeatures2* wanted) {
    PFN_vkGetPhysicalDeviceFeatures2 next = nullptr;
    {
        const std::scoped_lock lock(mutex);
        next = features_below.at(key(physical));
    }
    next(physical, wanted);
    if (!waits_for_present()) return;
    if (auto* identity = in_chain<VkPhysicalDevicePresentIdFeaturesKHR>(
            wanted->pNext, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PRESENT_ID_FEATURES_KHR))
        identity->presentId = VK_TRUE;
    if (auto* wait = in_chain<VkPhysicalDevicePresentWaitFeaturesKHR>(
            wanted->pNext, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PRESENT_WAIT_FEATURES_KHR))
        wait->presentWait = VK_TRUE;
}

VKAPI_ATTR VkResult VKAPI_CALL extensions(
    VkPhysicalDevice physical, const char* layer, std::uint32_t* count, VkExtensionProperties* list) {
    PFN_vkEnumerateDeviceExtensionProperties next = nullptr;
    {
        const std::scoped_lock lock(mutex);
        next = extensions_below.at(key(physical));
    }
    if (layer != nullptr || !waits_for_present()) return next(physical, layer, count, list);
    std::uint32_t below = 0;
    if (const VkResult result = next(physical, layer, &below, nullptr); result != VK_SUCCESS) return result;
    std::vector<VkExtensionProperties> all(below);
    if (const VkResult result = next(physical, layer, &below, all.data()); result != VK_SUCCESS) return result;
    for (const char* name : {VK_KHR_PRESENT_ID_EXTENSION_NAME, VK_KHR_PRESENT_WAIT_EXTENSION_NAME}) {
        std::strncpy(all.emplace_back().extensionName, name, VK_MAX_EXTENSION_NAME_SIZE - 1);
        all.back().specVersion = 1;
    }
    const auto wanted = static_cast<std::uint32_t>(all.size());
    if (list == nullptr) {
        *count = wanted;
        return VK_SUCCESS;
    }
    *count = std::min(*count, wanted);
    std::copy_n(all.begin(), *count, list);
    return *count < wanted ? VK_INCOMPLETE : VK_SUCCESS;
}

VKAPI_ATTR VkResult VKAPI_CALL submit(VkQueue queue, std::uint32_t count, const VkSubmitInfo* infos, VkFence fence) {
    const VkResult fault = fault_of("submit");
    if (fault < 0) return fault;
    return next_of<PFN_vkQueueSubmit>(queue, device_of_queue.at(key(queue)), "vkQueueSubmit")(
        queue, count, infos, fence);
}

VKAPI_ATTR VkResult VKAPI_CALL wait_for_fences(
    VkDevice device, std::uint32_t count, const VkFence* fences, VkBool32 all, std::uint64_t timeout) {
    const VkResult fault = fault_of("wait");
    // As in wait_idle: what a lost device does no more may be destroyed.
    const VkResult result =
        next_of<PFN_vkWaitForFences>(device, device, "vkWaitForFences")(device, count, fences, all, timeout);
    return fault < 0 ? fault : result;
}

VKAPI_ATTR VkResult VKAPI_CALL wait_idle(VkDevice device) {
    const VkResult fault = fault_of("idle");
    // The device is sound in truth: what it was given must end before it goes.
    const VkResult result = next_of<PFN_vkDeviceWaitIdle>(device, device, "vkDeviceWaitIdle")(device);
    return fault < 0 ? fault : result;
}

// The link to the layer below, taken off the chain.
template <class Link, class Info>
Link* take_link(const Info* info, VkStructureType type) {
    for (auto* one = static_cast<const VkBaseInStructure*>(info->pNext); one != nullptr; one = one->pNext) {
        auto* link = reinterpret_cast<Link*>(const_cast<VkBaseInStructure*>(one));
        if (one->sType == type && link->function == VK_LAYER_LINK_INFO) return link;
    }
    std::abort();
}

VKAPI_ATTR VkResult VKAPI_CALL create_instance(
    const VkInstanceCreateInfo* info, const VkAllocationCallbacks* allocator, VkInstance* instance) {
    auto* link = take_link<VkLayerInstanceCreateInfo>(info, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
    const PFN_vkGetInstanceProcAddr next = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    const auto create = reinterpret_cast<PFN_vkCreateInstance>(next(nullptr, "vkCreateInstance"));
    const VkResult result = create(info, allocator, instance);
    const std::scoped_lock lock(mutex);
    if (result == VK_SUCCESS) {
        instances[key(*instance)] = next;
        // Asked for now: later the loader would answer with this layer's own.
        features_below[key(*instance)] =
            reinterpret_cast<PFN_vkGetPhysicalDeviceFeatures2>(next(*instance, "vkGetPhysicalDeviceFeatures2"));
        extensions_below[key(*instance)] = reinterpret_cast<PFN_vkEnumerateDeviceExtensionProperties>(
            next(*instance, "vkEnumerateDeviceExtensionProperties"));
    }
    return result;
}

VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
    const VkAllocationCallbacks* allocator, VkDevice* device) {
    auto* link = take_link<VkLayerDeviceCreateInfo>(info, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
    const PFN_vkGetInstanceProcAddr next_instance = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    const PFN_vkGetDeviceProcAddr next = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    const auto create = reinterpret_cast<PFN_vkCreateDevice>(next_instance(nullptr, "vkCreateDevice"));
    // The driver below does not know what this layer adds.
    std::vector<const char*> names;
    for (std::uint32_t i = 0; i < info->enabledExtensionCount; ++i) {
        const std::string_view name = info->ppEnabledExtensionNames[i];
        if (name != VK_KHR_PRESENT_ID_EXTENSION_NAME && name != VK_KHR_PRESENT_WAIT_EXTENSION_NAME)
            names.push_back(info->ppEnabledExtensionNames[i]);
    }
    auto* last = reinterpret_cast<VkBaseInStructure*>(const_cast<VkDeviceCreateInfo*>(info));
    while (last->pNext != nullptr)
        if (last->pNext->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PRESENT_ID_FEATURES_KHR ||
            last->pNext->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PRESENT_WAIT_FEATURES_KHR)
            last->pNext = last->pNext->pNext;
        else
            last = const_cast<VkBaseInStructure*>(last->pNext);
    VkDeviceCreateInfo known = *info;
    known.enabledExtensionCount = static_cast<std::uint32_t>(names.size());
    known.ppEnabledExtensionNames = names.data();
    const VkResult result = create(physical, &known, allocator, device);
    const std::scoped_lock lock(mutex);
    if (result == VK_SUCCESS) {
        devices[key(*device)] = next;
        device_of_queue[key(*device)] = *device;
    }
    return result;
}

PFN_vkVoidFunction own(const char* name);

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL device_function(VkDevice device, const char* name) {
    if (const PFN_vkVoidFunction function = own(name)) return function;
    const std::scoped_lock lock(mutex);
    return devices.at(key(device))(device, name);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL instance_function(VkInstance instance, const char* name) {
    if (const PFN_vkVoidFunction function = own(name)) return function;
    if (instance == nullptr) return nullptr;
    const std::scoped_lock lock(mutex);
    return instances.at(key(instance))(instance, name);
}

PFN_vkVoidFunction own(const char* name) {
    const auto is = [&](const char* other) { return std::strcmp(name, other) == 0; };
    const auto plain = [](auto function) { return reinterpret_cast<PFN_vkVoidFunction>(function); };
    if (is("vkCreateInstance")) return plain(create_instance);
    if (is("vkCreateDevice")) return plain(create_device);
    if (is("vkGetInstanceProcAddr")) return plain(instance_function);
    if (is("vkGetDeviceProcAddr")) return plain(device_function);
    if (is("vkAcquireNextImageKHR")) return plain(acquire);
    if (is("vkQueuePresentKHR")) return plain(present);
    if (is("vkWaitForPresentKHR")) return plain(wait_for_present);
    if (is("vkGetPhysicalDeviceFeatures2")) return plain(features);
    if (is("vkEnumerateDeviceExtensionProperties")) return plain(extensions);
    if (is("vkQueueSubmit")) return plain(submit);
    if (is("vkWaitForFences")) return plain(wait_for_fences);
    if (is("vkDeviceWaitIdle")) return plain(wait_idle);
    return nullptr;
}

}  // namespace

LAYER_EXPORT VKAPI_ATTR VkResult VKAPI_CALL vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* version) {
    constexpr std::uint32_t known = 2;
    if (version->loaderLayerInterfaceVersion < known) return VK_ERROR_INITIALIZATION_FAILED;
    version->loaderLayerInterfaceVersion = known;
    version->pfnGetInstanceProcAddr = instance_function;
    version->pfnGetDeviceProcAddr = device_function;
    version->pfnGetPhysicalDeviceProcAddr = nullptr;
    return VK_SUCCESS;
}
