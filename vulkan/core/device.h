// The logical device, its queues, and what it offers beyond what every device must.
#pragma once

#include <vulkan/vulkan_raii.hpp>

#include "vulkan/core/instance.h"

namespace tandem {

// Enabled wherever the device has them.
struct DeviceFeatures {
    bool timeline_semaphores = false;
    bool doubles = false;  // in shaders
    bool synchronization2 = false;
    bool push_descriptors = false;
    bool buffer_addresses = false;
    bool storage_arrays = false;             // of storage buffers, by indices that all invocations share
    bool storage_arrays_nonuniform = false;  // by any index
    bool fragment_stores = false;            // fragments may write to buffers
    bool stores_any_format = false;          // kernels may store to images whose format they do not name
    bool calibrated_timestamps = false;      // beside the host's clock (device_clock.h)
    bool ray_tracing = false;                // pipelines of it, and the acceleration structures that they take
    bool ray_queries = false;                // of acceleration structures, by any kernel
    bool present_waits = false;              // the host may wait until an image is shown, of devices with a swapchain
};

// Features of a device with Vulkan 1.2.
[[nodiscard]] DeviceFeatures features_of(const vk::raii::PhysicalDevice& device);
// Those that there are, as users read them: "doubles", "ray tracing".
[[nodiscard]] std::vector<std::string> names_of(const DeviceFeatures& features);

// Queues cost memory and time: one is what a renderer needs.
enum class Queues { one, all };

class Device {
public:
    // Takes the device that `wanted` names (select_device), with these extensions besides its own. Throws DeviceError.
    Device(const Instance& instance, const std::string& wanted, Queues queues = Queues::one,
        const std::vector<const char*>& extensions = {});

    [[nodiscard]] const vk::raii::Device& handle() const { return device_; }
    [[nodiscard]] const vk::raii::PhysicalDevice& physical() const { return physical_; }
    [[nodiscard]] const vk::raii::Queue& queue() const { return queues_[family_].front(); }
    [[nodiscard]] std::uint32_t queue_family() const { return family_; }
    [[nodiscard]] const DeviceDescription& description() const { return description_; }
    [[nodiscard]] const vk::PhysicalDeviceLimits& limits() const { return limits_; }
    [[nodiscard]] const DeviceFeatures& features() const { return features_; }
    // The queues of a family that were made.
    [[nodiscard]] const std::vector<vk::raii::Queue>& queues(std::uint32_t family) const { return queues_[family]; }
    // The first family with all of these and none of those.
    [[nodiscard]] std::optional<std::uint32_t> family_with(vk::QueueFlags wanted, vk::QueueFlags unwanted) const;
    // The first memory type among the bits of `allowed` with all `properties`; preferring those with `preferred` too.
    [[nodiscard]] std::uint32_t memory_type(
        std::uint32_t allowed, vk::MemoryPropertyFlags properties, vk::MemoryPropertyFlags preferred) const;

private:
    struct Choice;
    Device(Choice choice, Queues queues, const std::vector<const char*>& extensions);

    DeviceDescription description_;
    vk::raii::PhysicalDevice physical_;
    vk::PhysicalDeviceLimits limits_;
    vk::PhysicalDeviceMemoryProperties memory_;
    std::uint32_t family_;
    DeviceFeatures features_;
    vk::raii::Device device_;
    std::vector<std::vector<vk::raii::Queue>> queues_;  // by family
};

}  // namespace tandem
