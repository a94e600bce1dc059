// The images of a surface that are drawn to and presented in turn.
#pragma once

#include <vector>

#include "common/view/window.h"
#include "vulkan/core/device.h"

namespace tandem {

// What a device can do with a surface.
class SurfaceAbilities {
public:
    // Throws DeviceError, with the reason, where the device's queue cannot draw to the surface.
    SurfaceAbilities(const Device& device, const vk::raii::SurfaceKHR& surface);

    [[nodiscard]] bool has(PresentMode mode) const;
    [[nodiscard]] vk::SurfaceFormatKHR format() const { return format_; }

private:
    std::vector<vk::PresentModeKHR> modes_;
    vk::SurfaceFormatKHR format_;
};

[[nodiscard]] vk::PresentModeKHR vulkan_mode(PresentMode mode);

// It has one size and mode. A change makes another one, from the old: Vulkan may then hand images over.
class Swapchain {
public:
    // `size` is a wish where the surface lets the swapchain decide; of the surface otherwise. `old` is retired.
    Swapchain(const Device& device, const vk::raii::SurfaceKHR& surface, vk::SurfaceFormatKHR format, vk::Extent2D size,
        PresentMode mode, const Swapchain* old);

    [[nodiscard]] const vk::raii::SwapchainKHR& handle() const { return swapchain_; }
    [[nodiscard]] vk::Extent2D size() const { return size_; }
    [[nodiscard]] PresentMode mode() const { return mode_; }
    [[nodiscard]] std::uint32_t least_images() const { return least_images_; }
    [[nodiscard]] std::size_t image_count() const { return images_.size(); }
    [[nodiscard]] vk::Image image(std::size_t i) const { return images_[i]; }
    [[nodiscard]] vk::ImageView view(std::size_t i) const { return *views_[i]; }

private:
    PresentMode mode_;
    vk::Extent2D size_;
    std::uint32_t least_images_ = 0;
    vk::raii::SwapchainKHR swapchain_ = nullptr;
    std::vector<vk::Image> images_;
    std::vector<vk::raii::ImageView> views_;
};

}  // namespace tandem
