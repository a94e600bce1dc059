// A two-dimensional image of one level and layer with its memory and its view, and the transitions between its layouts.
#pragma once

#include "vulkan/core/device.h"

namespace tandem {

struct ImageSpec {
    vk::Extent2D size;
    vk::Format format = vk::Format::eR8G8B8A8Unorm;
    vk::ImageUsageFlags usage;
    vk::ImageTiling tiling = vk::ImageTiling::eOptimal;
    // For linear tiling: the host may map it (DeviceImage::mapped). Else it is for the device alone.
    bool host_visible = false;
};

// The whole of an image as transitions and views name it.
inline constexpr vk::ImageSubresourceRange whole_image{vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1};
inline constexpr vk::ImageSubresourceLayers first_layer{vk::ImageAspectFlagBits::eColor, 0, 0, 1};

class DeviceImage {
public:
    // Throws UnsupportedError, with the reason, where the device has no such images; Error where it cannot hold one.
    DeviceImage(const Device& device, const ImageSpec& spec);

    [[nodiscard]] vk::Image handle() const { return *image_; }
    // Null where no usage takes one: of what is only copied from and to.
    [[nodiscard]] vk::ImageView view() const { return *view_; }
    [[nodiscard]] const ImageSpec& spec() const { return spec_; }
    // Host memory of a host-visible image and the bytes from a row to the next: coherent, no flush is needed.
    [[nodiscard]] std::byte* mapped() const { return mapped_; }
    [[nodiscard]] vk::DeviceSize row_bytes() const { return row_bytes_; }

private:
    ImageSpec spec_;
    vk::raii::DeviceMemory memory_ = nullptr;  // outlives the image that is bound to it
    vk::raii::Image image_ = nullptr;
    vk::raii::ImageView view_ = nullptr;
    std::byte* mapped_ = nullptr;
    vk::DeviceSize row_bytes_ = 0;
};

// Why the device has no such images; empty: it has.
[[nodiscard]] std::string unsupported_image(const Device& device, const ImageSpec& spec);

// How an image is used at a place among commands: by which stages, with which access, in which layout.
struct ImageUse {
    vk::PipelineStageFlags stage;
    vk::AccessFlags access;
    vk::ImageLayout layout;
};
// Whatever it held may be lost; nothing that was submitted before uses it.
inline constexpr ImageUse unused_image{vk::PipelineStageFlagBits::eTopOfPipe, {}, vk::ImageLayout::eUndefined};
// The same of a swapchain's image for whose acquisition a semaphore was waited at this stage.
[[nodiscard]] constexpr ImageUse acquired_image(vk::PipelineStageFlags waited_at) {
    return {waited_at, {}, vk::ImageLayout::eUndefined};
}
inline constexpr ImageUse written_by_compute{
    vk::PipelineStageFlagBits::eComputeShader, vk::AccessFlagBits::eShaderWrite, vk::ImageLayout::eGeneral};
inline constexpr ImageUse copied_from{
    vk::PipelineStageFlagBits::eTransfer, vk::AccessFlagBits::eTransferRead, vk::ImageLayout::eTransferSrcOptimal};
inline constexpr ImageUse copied_to{
    vk::PipelineStageFlagBits::eTransfer, vk::AccessFlagBits::eTransferWrite, vk::ImageLayout::eTransferDstOptimal};
// A semaphore orders the presentation after the commands.
inline constexpr ImageUse presented{vk::PipelineStageFlagBits::eBottomOfPipe, {}, vk::ImageLayout::ePresentSrcKHR};

// What follows with use `to` comes after what came before with use `from`.
void transition(const vk::raii::CommandBuffer& commands, vk::Image image, const ImageUse& from, const ImageUse& to);

}  // namespace tandem
