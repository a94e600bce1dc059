#include "vulkan/resources/swapchain.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "common/error.h"

namespace tandem {

namespace {

// Values are encoded as sRGB before they come here: the format must not encode them again.
constexpr std::array formats{vk::Format::eB8G8R8A8Unorm, vk::Format::eR8G8B8A8Unorm};

constexpr vk::ImageUsageFlags image_viewed =
    vk::ImageUsageFlagBits::eStorage | vk::ImageUsageFlagBits::eColorAttachment;

vk::Extent2D within(vk::Extent2D size, const vk::SurfaceCapabilitiesKHR& limits) {
    constexpr std::uint32_t free_choice = std::numeric_limits<std::uint32_t>::max();
    if (limits.currentExtent.width != free_choice) return limits.currentExtent;
    return {std::clamp(size.width, limits.minImageExtent.width, limits.maxImageExtent.width),
        std::clamp(size.height, limits.minImageExtent.height, limits.maxImageExtent.height)};
}

std::uint32_t count_for(std::uint32_t wanted, const vk::SurfaceCapabilitiesKHR& limits) {
    const std::uint32_t least = limits.minImageCount;
    const std::uint32_t most =
        limits.maxImageCount == 0 ? std::numeric_limits<std::uint32_t>::max() : limits.maxImageCount;
    if (wanted == 0) return std::min(std::max(least, 2u) + 1, most);
    if (wanted < least)
        throw UnsupportedError(fmt::format("the surface keeps {} images at least, not {}", least, wanted));
    if (wanted > most) throw UnsupportedError(fmt::format("the surface has {} images at most, not {}", most, wanted));
    return wanted;
}

}  // namespace

vk::Extent2D swapchain_size(const Device& device, const vk::raii::SurfaceKHR& surface, vk::Extent2D wish) {
    return within(wish, device.physical().getSurfaceCapabilitiesKHR(*surface));
}

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
    usage_ = physical.getSurfaceCapabilitiesKHR(*surface).supportedUsageFlags;
    if (!(usage_ & vk::ImageUsageFlagBits::eTransferDst))
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

Swapchain::Swapchain(const Device& device, const vk::raii::SurfaceKHR& surface, const SwapchainSpec& spec,
    vk::Extent2D wish, const Swapchain* old)
    : mode_(spec.mode) {
    const vk::SurfaceCapabilitiesKHR limits = device.physical().getSurfaceCapabilitiesKHR(*surface);
    size_ = within(wish, limits);
    least_images_ = std::max(limits.minImageCount, 2u);
    vk::SwapchainCreateInfoKHR info;
    info.surface = *surface;
    info.minImageCount = count_for(spec.images, limits);
    info.imageFormat = spec.format.format;
    info.imageColorSpace = spec.format.colorSpace;
    info.imageExtent = size_;
    info.imageArrayLayers = 1;
    info.imageUsage = spec.usage;
    info.preTransform = limits.currentTransform;
    const bool opaque = static_cast<bool>(limits.supportedCompositeAlpha & vk::CompositeAlphaFlagBitsKHR::eOpaque);
    info.compositeAlpha = opaque ? vk::CompositeAlphaFlagBitsKHR::eOpaque : vk::CompositeAlphaFlagBitsKHR::eInherit;
    info.presentMode = vulkan_mode(spec.mode);
    info.clipped = true;
    if (old != nullptr) info.oldSwapchain = *old->swapchain_;
    swapchain_ = vk::raii::SwapchainKHR(device.handle(), info);
    for (const VkImage image : swapchain_.getImages()) {
        images_.emplace_back(image);
        views_.push_back(nullptr);
        if (!(spec.usage & image_viewed)) continue;
        views_.back() = vk::raii::ImageView(
            device.handle(), vk::ImageViewCreateInfo({}, images_.back(), vk::ImageViewType::e2D, spec.format.format, {},
                                 {vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1}));
    }
}

}  // namespace tandem
