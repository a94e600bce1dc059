#include "vulkan/resources/image.h"

#include <fmt/format.h>

#include "common/error.h"

namespace tandem {

namespace {

using Usage = vk::ImageUsageFlagBits;

constexpr vk::ImageUsageFlags viewed =
    Usage::eSampled | Usage::eStorage | Usage::eColorAttachment | Usage::eInputAttachment;

vk::ImageCreateInfo info_of(const ImageSpec& spec) {
    return {{}, vk::ImageType::e2D, spec.format, {spec.size.width, spec.size.height, 1}, 1, 1,
        vk::SampleCountFlagBits::e1, spec.tiling, spec.usage};
}

// Features of a format that usages stand for.
vk::FormatFeatureFlags features_for(vk::ImageUsageFlags usage) {
    using Feature = vk::FormatFeatureFlagBits;
    vk::FormatFeatureFlags features;
    if (usage & Usage::eTransferSrc) features |= Feature::eTransferSrc;
    if (usage & Usage::eTransferDst) features |= Feature::eTransferDst;
    if (usage & Usage::eSampled) features |= Feature::eSampledImage;
    if (usage & Usage::eStorage) features |= Feature::eStorageImage;
    if (usage & Usage::eColorAttachment) features |= Feature::eColorAttachment;
    return features;
}

vk::raii::DeviceMemory allocate(const Device& device, const vk::MemoryRequirements& needs, bool host_visible) {
    using Flag = vk::MemoryPropertyFlagBits;
    const std::uint32_t type =
        host_visible ? device.memory_type(needs.memoryTypeBits, Flag::eHostVisible | Flag::eHostCoherent, {})
                     : device.memory_type(needs.memoryTypeBits, {}, Flag::eDeviceLocal);
    try {
        return {device.handle(), vk::MemoryAllocateInfo(needs.size, type)};
    } catch (const vk::SystemError& failure) {
        throw Error(fmt::format("{} cannot allocate {} MiB ({}); render a smaller image", device.description().name,
            (needs.size >> 20) + 1, failure.what()));
    }
}

}  // namespace

std::string unsupported_image(const Device& device, const ImageSpec& spec) {
    const std::string& name = device.description().name;
    if (spec.host_visible && spec.tiling != vk::ImageTiling::eLinear)
        return "only images of linear tiling have a place for each pixel that the host knows";
    const vk::FormatProperties has = device.physical().getFormatProperties(spec.format);
    const bool linear = spec.tiling == vk::ImageTiling::eLinear;
    const vk::FormatFeatureFlags wanted = features_for(spec.usage);
    const vk::FormatFeatureFlags lacks = wanted & ~(linear ? has.linearTilingFeatures : has.optimalTilingFeatures);
    if (lacks)
        return fmt::format("{} has no {} images of {} tiling with {}", name, vk::to_string(spec.format),
            linear ? "linear" : "optimal", vk::to_string(lacks));
    try {
        const vk::ImageFormatProperties most =
            device.physical().getImageFormatProperties(spec.format, vk::ImageType::e2D, spec.tiling, spec.usage, {});
        if (spec.size.width > most.maxExtent.width || spec.size.height > most.maxExtent.height)
            return fmt::format(
                "{} has such images of {}x{} pixels at most", name, most.maxExtent.width, most.maxExtent.height);
    } catch (const vk::FormatNotSupportedError&) {
        return fmt::format("{} has no {} images of {} tiling for {}", name, vk::to_string(spec.format),
            linear ? "linear" : "optimal", vk::to_string(spec.usage));
    }
    return {};
}

DeviceImage::DeviceImage(const Device& device, const ImageSpec& spec) : spec_(spec) {
    if (const std::string reason = unsupported_image(device, spec); !reason.empty()) throw UnsupportedError(reason);
    image_ = vk::raii::Image(device.handle(), info_of(spec));
    memory_ = allocate(device, image_.getMemoryRequirements(), spec.host_visible);
    image_.bindMemory(*memory_, 0);
    if (spec.usage & viewed)
        view_ = vk::raii::ImageView(device.handle(),
            vk::ImageViewCreateInfo({}, *image_, vk::ImageViewType::e2D, spec.format, {}, whole_image));
    if (!spec.host_visible) return;
    const vk::SubresourceLayout layout =
        image_.getSubresourceLayout(vk::ImageSubresource(vk::ImageAspectFlagBits::eColor, 0, 0));
    mapped_ = static_cast<std::byte*>(memory_.mapMemory(0, VK_WHOLE_SIZE)) + layout.offset;
    row_bytes_ = layout.rowPitch;
}

void transition(const vk::raii::CommandBuffer& commands, vk::Image image, const ImageUse& from, const ImageUse& to) {
    const vk::ImageMemoryBarrier barrier(from.access, to.access, from.layout, to.layout, VK_QUEUE_FAMILY_IGNORED,
        VK_QUEUE_FAMILY_IGNORED, image, whole_image);
    commands.pipelineBarrier(from.stage, to.stage, {}, {}, {}, barrier);
}

}  // namespace tandem
