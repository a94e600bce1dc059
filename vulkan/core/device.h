// The logical device and its one compute queue.
#pragma once

#include <vulkan/vulkan_raii.hpp>

#include "vulkan/core/instance.h"

namespace tandem {

class Device {
public:
    // Takes the device that `wanted` names (select_device). Throws DeviceError.
    Device(const Instance& instance, const std::string& wanted);

    [[nodiscard]] const vk::raii::Device& handle() const { return device_; }
    [[nodiscard]] const vk::raii::PhysicalDevice& physical() const { return physical_; }
    [[nodiscard]] const vk::raii::Queue& queue() const { return queue_; }
    [[nodiscard]] std::uint32_t queue_family() const { return family_; }
    [[nodiscard]] const DeviceDescription& description() const { return description_; }
    [[nodiscard]] const vk::PhysicalDeviceLimits& limits() const { return limits_; }
    // Enabled wherever the device has them.
    [[nodiscard]] bool has_timeline_semaphores() const { return timeline_semaphores_; }
    [[nodiscard]] bool has_doubles() const { return doubles_; }  // in shaders
    // The first memory type among the bits of `allowed` with all `properties`; preferring those with `preferred` too.
    [[nodiscard]] std::uint32_t memory_type(
        std::uint32_t allowed, vk::MemoryPropertyFlags properties, vk::MemoryPropertyFlags preferred) const;

private:
    struct Choice;
    Device(Choice choice);

    DeviceDescription description_;
    vk::raii::PhysicalDevice physical_;
    vk::PhysicalDeviceLimits limits_;
    vk::PhysicalDeviceMemoryProperties memory_;
    std::uint32_t family_;
    bool timeline_semaphores_, doubles_;
    vk::raii::Device device_;
    vk::raii::Queue queue_;
};

}  // namespace tandem
