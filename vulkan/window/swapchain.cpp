#include "vulkan/window/swapchain.h"

#include <algorithm>
#include <array>
#include <limits>

#include "common/error.h"

namespace tandem {

namespace {

// Values are encoded as sRGB before they come here: the format must not encode them again.
constexpr std::array formats{vk::Format::eB8G8R8A8Unorm, vk::Format::eR8G8B8A8Unorm};

vk::Extent2D within(vk::Extent2D size, const vk::SurfaceCapabilitiesKHR& limits) {
    constexpr std::uint32_t free_choice = std::numeric_limits<std::uint32_t>::max();
    if (limits.currentExtent.width != free_choice) return limits.currentExtent;
    return {std::clamp(size.width, limits.minImageExtent.width, limits.maxImageExtent.width),
        std::clamp(size.height, limits.minImageExtent.height, limits.maxImageExtent.height)};
}

}  // namespace

vk::PresentModeKHR vulkan_mode(PresentMode mode) {
    switch (mode) {
        case PresentMode::fifo_relaxed:
            return vk::PresentModeKHR::eFifoRelaxed;
        case PresentMode::mailbox:
            return vk::PresentModeKHR::eMailbox;
        case PresentMode::immediate:
            return vk::PresentModeKHR::eImmediate;
        case PresentMode::fifo:
            break;
    }
    return vk::PresentModeKHR::eFifo;
}

SurfaceAbilities::SurfaceAbilities(const Device& device, const vk::raii::SurfaceKHR& surface) {
    const std::string& name = device.description().name;
    const vk::raii::PhysicalDevice& physical = device.physical();
    const auto families = physical.getQueueFamilyProperties();
    if (!(families[device.queue_family()].queueFlags & vk::QueueFlagBits::eGraphics))
        throw DeviceError(name + " draws no triangles on the queue that computes; choose another --device");
    if (physical.getSurfaceSupportKHR(device.queue_family(), *surface) == VK_FALSE)
        throw DeviceError(name + " cannot show images on this display; choose another --device");
    if (!(physical.getSurfaceCapabilitiesKHR(*surface).supportedUsageFlags & vk::ImageUsageFlagBits::eTransferDst))
        throw DeviceError(name + " takes no copies to this display's images; choose another --device");
    const auto offered = physical.getSurfaceFormatsKHR(*surface);
    const auto found = std::ranges::find_if(offered,
        [](const vk::SurfaceFormatKHR& one) { return std::ranges::find(formats, one.format) != formats.end(); });
    if (found == offered.end())
        throw DeviceError(name + " has no images of 8 bits a channel for this display; choose another --device");
    format_ = *found;
    modes_ = physical.getSurfacePresentModesKHR(*surface);
}

bool SurfaceAbilities::has(PresentMode mode) const {
    return std::ranges::find(modes_, vulkan_mode(mode)) != modes_.end();
}

Swapchain::Swapchain(const Device& device, const vk::raii::SurfaceKHR& surface, vk::SurfaceFormatKHR format,
    vk::Extent2D size, PresentMode mode, const Swapchain* old)
    : mode_(mode) {
    const vk::SurfaceCapabilitiesKHR limits = device.physical().getSurfaceCapabilitiesKHR(*surface);
    size_ = within(size, limits);
    // One more than the surface keeps, so that one can be drawn while it does.
    least_images_ = std::max(limits.minImageCount, 2u);
    const std::uint32_t most =
        limits.maxImageCount == 0 ? std::numeric_limits<std::uint32_t>::max() : limits.maxImageCount;
    vk::SwapchainCreateInfoKHR info;
    info.surface = *surface;
    info.minImageCount = std::min(least_images_ + 1, most);
    info.imageFormat = format.format;
    info.imageColorSpace = format.colorSpace;
    info.imageExtent = size_;
    info.imageArrayLayers = 1;
    info.imageUsage = vk::ImageUsageFlagBits::eColorAttachment | vk::ImageUsageFlagBits::eTransferDst;
    info.preTransform = limits.currentTransform;
    const bool opaque = static_cast<bool>(limits.supportedCompositeAlpha & vk::CompositeAlphaFlagBitsKHR::eOpaque);
    info.compositeAlpha = opaque ? vk::CompositeAlphaFlagBitsKHR::eOpaque : vk::CompositeAlphaFlagBitsKHR::eInherit;
    info.presentMode = vulkan_mode(mode);
    info.clipped = true;
    if (old != nullptr) info.oldSwapchain = *old->swapchain_;
    swapchain_ = vk::raii::SwapchainKHR(device.handle(), info);
    for (const VkImage image : swapchain_.getImages()) {
        images_.emplace_back(image);
        views_.emplace_back(device.handle(), vk::ImageViewCreateInfo({}, images_.back(), vk::ImageViewType::e2D,
                                                 format.format, {}, {vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1}));
    }
}

}  // namespace tandem
