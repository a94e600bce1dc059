// The images of a surface that are drawn to and presented in turn.
#pragma once

#include <vector>

#include "common/render/present_mode.h"
#include "vulkan/core/device.h"

namespace tandem {

// What a device can do with a surface.
class SurfaceAbilities {
public:
    // Throws DeviceError, with the reason, where the device's queue cannot draw to the surface.
    SurfaceAbilities(const Device& device, const vk::raii::SurfaceKHR& surface);

    [[nodiscard]] bool has(PresentMode mode) const;
    [[nodiscard]] vk::SurfaceFormatKHR format() const { return format_; }
    [[nodiscard]] vk::ImageUsageFlags usage() const { return usage_; }

private:
    std::vector<vk::PresentModeKHR> modes_;
    vk::SurfaceFormatKHR format_;
    vk::ImageUsageFlags usage_;  // that its images can have
};

[[nodiscard]] vk::PresentModeKHR vulkan_mode(PresentMode mode);

// The size of a swapchain for the surface now: `wish` where it leaves the choice. 0 while a window is minimised: then
// there can be none.
[[nodiscard]] vk::Extent2D swapchain_size(const Device& device, const vk::raii::SurfaceKHR& surface, vk::Extent2D wish);

struct SwapchainSpec {
    vk::SurfaceFormatKHR format;
    PresentMode mode = PresentMode::fifo;
    std::uint32_t images = 0;  // at least; 0: one more than the surface keeps, so that one can be drawn while it does
    vk::ImageUsageFlags usage = vk::ImageUsageFlagBits::eColorAttachment | vk::ImageUsageFlagBits::eTransferDst;
};

// It has one size and mode. A change makes another one, from the old: Vulkan may then hand images over.
class Swapchain {
public:
    // Its size is swapchain_size(…, `wish`), which must not be 0. `old` is retired. Throws UnsupportedError where the
    // surface cannot have so many images.
    Swapchain(const Device& device, const vk::raii::SurfaceKHR& surface, const SwapchainSpec& spec, vk::Extent2D wish,
        const Swapchain* old);

    [[nodiscard]] const vk::raii::SwapchainKHR& handle() const { return swapchain_; }
    [[nodiscard]] vk::Extent2D size() const { return size_; }
    [[nodiscard]] PresentMode mode() const { return mode_; }
    [[nodiscard]] std::uint32_t least_images() const { return least_images_; }
    [[nodiscard]] std::size_t image_count() const { return images_.size(); }
    [[nodiscard]] vk::Image image(std::size_t i) const { return images_[i]; }
    // Null where no usage takes one.
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
