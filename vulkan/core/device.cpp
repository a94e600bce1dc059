#include "vulkan/core/device.h"

#include "common/error.h"
#include "vulkan/core/device_selection.h"

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
            throw DeviceError(std::string("no Vulkan device: ") + failure.what() +
                              "; install a driver (Mesa's lavapipe runs on any CPU)");
        }
    }
};

namespace {

bool offers_timeline_semaphores(const vk::raii::PhysicalDevice& physical) {
    const auto features =
        physical.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceTimelineSemaphoreFeatures>();
    return features.get<vk::PhysicalDeviceTimelineSemaphoreFeatures>().timelineSemaphore != 0;
}

vk::raii::Device make_device(const vk::raii::PhysicalDevice& physical, std::uint32_t family, bool timeline_semaphores) {
    const float priority = 1.0f;
    const vk::DeviceQueueCreateInfo queue({}, family, 1, &priority);
    vk::PhysicalDeviceFeatures features;
    features.shaderFloat64 = physical.getFeatures().shaderFloat64;
    const vk::StructureChain info(vk::DeviceCreateInfo({}, queue, {}, {}, &features),
        vk::PhysicalDeviceTimelineSemaphoreFeatures(timeline_semaphores));
    return vk::raii::Device(physical, info.get<vk::DeviceCreateInfo>());
}

}  // namespace

Device::Device(const Instance& instance, const std::string& wanted) : Device(Choice::make(instance, wanted)) {}

Device::Device(Choice choice)
    : description_(std::move(choice.description)),
      physical_(std::move(choice.physical)),
      limits_(physical_.getProperties().limits),
      memory_(physical_.getMemoryProperties()),
      family_(compute_queue_family(physical_).value()),
      timeline_semaphores_(offers_timeline_semaphores(physical_)),
      doubles_(physical_.getFeatures().shaderFloat64 == VK_TRUE),
      device_(make_device(physical_, family_, timeline_semaphores_)),
      queue_(device_, family_, 0) {}

std::uint32_t Device::memory_type(
    std::uint32_t allowed, vk::MemoryPropertyFlags properties, vk::MemoryPropertyFlags preferred) const {
    for (const vk::MemoryPropertyFlags wanted : {properties | preferred, properties})
        for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i)
            if ((allowed >> i & 1) != 0 && (memory_.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
    throw DeviceError(description_.name + " has no memory that is " + vk::to_string(properties));
}

}  // namespace tandem
