// The Vulkan instance, with the validation layer when asked for, and the description of its devices.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vulkan/vulkan_raii.hpp>

#include "vulkan/core/validation.h"
#include "vulkan/devices.h"

namespace tandem {

class Instance {
public:
    // Throws DeviceError if there is no Vulkan loader, no such extension, or no validation layer where it is wanted.
    explicit Instance(bool validation, const std::vector<const char*>& extensions = {});

    [[nodiscard]] const vk::raii::Instance& handle() const { return instance_; }
    [[nodiscard]] ValidationLog& log() const { return *log_; }

private:
    vk::raii::Context context_;
    std::unique_ptr<ValidationLog> log_;  // its address is the messenger's user data
    vk::raii::Instance instance_;
    vk::raii::DebugUtilsMessengerEXT messenger_;
};

[[nodiscard]] DeviceDescription describe(const vk::raii::PhysicalDevice& device, std::uint32_t index);
[[nodiscard]] std::vector<DeviceDescription> describe_devices(const vk::raii::PhysicalDevices& devices);
// The first family with compute, if any.
[[nodiscard]] std::optional<std::uint32_t> compute_queue_family(const vk::raii::PhysicalDevice& device);

}  // namespace tandem
