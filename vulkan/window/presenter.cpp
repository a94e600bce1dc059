#include "vulkan/window/presenter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "common/error.h"

namespace tandem {

namespace {

using Access = vk::AccessFlagBits;
using Layout = vk::ImageLayout;
using Stage = vk::PipelineStageFlagBits;

constexpr std::uint64_t forever = std::numeric_limits<std::uint64_t>::max();
constexpr vk::ImageSubresourceRange whole_image{vk::ImageAspectFlagBits::eColor, 0, 1, 0, 1};
constexpr vk::ImageSubresourceLayers first_layer{vk::ImageAspectFlagBits::eColor, 0, 0, 1};

// What was copied into the image stays; the panel is drawn over it, and the image is left ready to present.
vk::raii::RenderPass make_render_pass(const Device& device, vk::Format format) {
    const vk::AttachmentDescription colour({}, format, vk::SampleCountFlagBits::e1, vk::AttachmentLoadOp::eLoad,
        vk::AttachmentStoreOp::eStore, vk::AttachmentLoadOp::eDontCare, vk::AttachmentStoreOp::eDontCare,
        Layout::eTransferDstOptimal, Layout::ePresentSrcKHR);
    const vk::AttachmentReference reference(0, Layout::eColorAttachmentOptimal);
    const vk::SubpassDescription subpass({}, vk::PipelineBindPoint::eGraphics, {}, reference);
    const std::array dependencies{
        vk::SubpassDependency(VK_SUBPASS_EXTERNAL, 0, Stage::eTransfer, Stage::eColorAttachmentOutput,
            Access::eTransferWrite, Access::eColorAttachmentRead | Access::eColorAttachmentWrite),
        vk::SubpassDependency(0, VK_SUBPASS_EXTERNAL, Stage::eColorAttachmentOutput, Stage::eBottomOfPipe,
            Access::eColorAttachmentWrite, {})};
    return {device.handle(), vk::RenderPassCreateInfo({}, colour, subpass, dependencies)};
}

void change_layout(vk::CommandBuffer commands, vk::Image image, Layout from, Layout to, vk::AccessFlags before,
    vk::AccessFlags after, vk::PipelineStageFlags stage_before = Stage::eTransfer) {
    const vk::ImageMemoryBarrier barrier(
        before, after, from, to, VK_QUEUE_FAMILY_IGNORED, VK_QUEUE_FAMILY_IGNORED, image, whole_image);
    commands.pipelineBarrier(stage_before, Stage::eTransfer, {}, {}, {}, barrier);
}

std::array<vk::Offset3D, 2> corners(const vk::Rect2D& place) {
    return {vk::Offset3D(place.offset.x, place.offset.y, 0),
        vk::Offset3D(place.offset.x + static_cast<std::int32_t>(place.extent.width),
            place.offset.y + static_cast<std::int32_t>(place.extent.height), 1)};
}

}  // namespace

Presenter::Presenter(const Device& device, const vk::raii::SurfaceKHR& surface, vk::Extent2D size, PresentMode mode)
    : device_(device),
      surface_(surface),
      abilities_(device, surface),
      mode_(mode),
      render_pass_(make_render_pass(device, abilities_.format().format)),
      pool_(device.handle(),
          vk::CommandPoolCreateInfo(vk::CommandPoolCreateFlagBits::eResetCommandBuffer, device.queue_family())) {
    if (!abilities_.has(mode)) {
        std::string modes;
        for (std::size_t i = 0; i < present_mode_names.size(); ++i)
            if (abilities_.has(static_cast<PresentMode>(i)))
                modes += (modes.empty() ? "" : ", ") + std::string(present_mode_names[i]);
        throw DeviceError(fmt::format("{} does not present {} here; it has: {}", device.description().name,
            present_mode_names[static_cast<std::size_t>(mode)], modes));
    }
    vk::raii::CommandBuffers commands(
        device.handle(), vk::CommandBufferAllocateInfo(*pool_, vk::CommandBufferLevel::ePrimary, frames_in_flight));
    for (std::size_t i = 0; i < frames_in_flight; ++i) {
        frames_[i].commands = std::move(commands[i]);
        frames_[i].done = vk::raii::Fence(device.handle(), vk::FenceCreateInfo(vk::FenceCreateFlagBits::eSignaled));
        frames_[i].acquired = vk::raii::Semaphore(device.handle(), vk::SemaphoreCreateInfo());
    }
    make_swapchain(size);
}

// A lost device cannot be waited for, and need not be.
void Presenter::wait() const {
    try {
        device_.handle().waitIdle();
    } catch (const vk::SystemError&) {
    }
}

void Presenter::make_swapchain(vk::Extent2D size) {
    device_.handle().waitIdle();
    targets_.clear();
    swapchain_.emplace([&] {
        return Swapchain(device_, surface_, abilities_.format(), size, mode_, swapchain_ ? &*swapchain_ : nullptr);
    }());
    ++made_;
    outdated_ = false;
    for (std::size_t i = 0; i < swapchain_->image_count(); ++i) {
        const vk::ImageView view = swapchain_->view(i);
        targets_.push_back(
            {vk::raii::Framebuffer(device_.handle(), vk::FramebufferCreateInfo({}, *render_pass_, view,
                                                         swapchain_->size().width, swapchain_->size().height, 1)),
                vk::raii::Semaphore(device_.handle(), vk::SemaphoreCreateInfo())});
    }
}

void Presenter::set_mode(PresentMode mode) {
    outdated_ = outdated_ || mode != mode_;
    mode_ = mode;
}

void Presenter::set_picture(const ViewSession::Shown& picture) {
    const std::uint32_t most = device_.limits().maxImageDimension2D;
    if (picture.width > most || picture.height > most)
        throw Error(fmt::format(
            "{} shows images of {} pixels at most; choose a smaller --size", device_.description().name, most));
    picture_ = picture;
    picture_changed_ = true;
}

vk::Rect2D Presenter::picture_place() const {
    const vk::Extent2D window = swapchain_->size();
    if (picture_.width == 0) return {{0, 0}, window};
    const double scale = std::min(1.0 * window.width / picture_.width, 1.0 * window.height / picture_.height);
    const auto part = [&](std::uint32_t pixels, std::uint32_t most) {
        return std::clamp(static_cast<std::uint32_t>(scale * pixels + 0.5), 1u, most);
    };
    const vk::Extent2D size{part(picture_.width, window.width), part(picture_.height, window.height)};
    return {{static_cast<std::int32_t>((window.width - size.width) / 2),
                static_cast<std::int32_t>((window.height - size.height) / 2)},
        size};
}

void Presenter::make_picture(vk::Extent2D size) {
    if (picture_size_.width > 0) device_.handle().waitIdle();  // frames may still read the old one
    picture_image_ = nullptr;
    picture_memory_ = nullptr;
    vk::ImageCreateInfo info({}, vk::ImageType::e2D, vk::Format::eR8G8B8A8Unorm, {size.width, size.height, 1}, 1, 1);
    info.usage = vk::ImageUsageFlagBits::eTransferDst | vk::ImageUsageFlagBits::eTransferSrc;
    picture_image_ = vk::raii::Image(device_.handle(), info);
    const vk::MemoryRequirements needs = picture_image_.getMemoryRequirements();
    const std::uint32_t type = device_.memory_type(needs.memoryTypeBits, {}, vk::MemoryPropertyFlagBits::eDeviceLocal);
    picture_memory_ = vk::raii::DeviceMemory(device_.handle(), vk::MemoryAllocateInfo(needs.size, type));
    picture_image_.bindMemory(*picture_memory_, 0);
    picture_size_ = size;
}

// The frame's own staging memory, so that the device may still read that of the frame before.
void Presenter::record_upload(Frame& frame) {
    if (frame.staging_bytes != picture_.rgba.size()) {
        frame.staging_bytes = picture_.rgba.size();
        const BufferSpec spec{frame.staging_bytes, vk::BufferUsageFlagBits::eTransferSrc};
        frame.staging.reset();
        frame.staging.emplace(device_, MemoryDomain::upload, std::span(&spec, 1));
    }
    std::memcpy(frame.staging->mapped(0), picture_.rgba.data(), picture_.rgba.size());
    const vk::CommandBuffer commands = *frame.commands;
    // The blits of frames before are done with the image before it changes.
    change_layout(commands, *picture_image_, Layout::eUndefined, Layout::eTransferDstOptimal, Access::eTransferRead,
        Access::eTransferWrite);
    commands.copyBufferToImage((*frame.staging)[0], *picture_image_, Layout::eTransferDstOptimal,
        vk::BufferImageCopy(
            frame.staging->offset(0), 0, 0, first_layer, {}, {picture_size_.width, picture_size_.height, 1}));
    change_layout(commands, *picture_image_, Layout::eTransferDstOptimal, Layout::eTransferSrcOptimal,
        Access::eTransferWrite, Access::eTransferRead);
    picture_changed_ = false;
}

void Presenter::record_picture(const Frame& frame, vk::Image target) const {
    const vk::CommandBuffer commands = *frame.commands;
    // The image was waited for at this stage.
    change_layout(commands, target, Layout::eUndefined, Layout::eTransferDstOptimal, {}, Access::eTransferWrite);
    constexpr float grey = 0.1f;
    commands.clearColorImage(target, Layout::eTransferDstOptimal,
        vk::ClearColorValue(std::array<float, 4>{grey, grey, grey, 1.0f}), whole_image);
    if (picture_size_.width == 0) return;
    change_layout(commands, target, Layout::eTransferDstOptimal, Layout::eTransferDstOptimal, Access::eTransferWrite,
        Access::eTransferWrite);
    const vk::Rect2D place = picture_place();
    const vk::Rect2D whole({0, 0}, picture_size_);
    const bool larger = place.extent.width >= picture_size_.width;  // pixels stay square and sharp
    commands.blitImage(*picture_image_, Layout::eTransferSrcOptimal, target, Layout::eTransferDstOptimal,
        vk::ImageBlit(first_layer, corners(whole), first_layer, corners(place)),
        larger ? vk::Filter::eNearest : vk::Filter::eLinear);
}

void Presenter::record(Frame& frame, std::uint32_t image, const std::function<void(vk::CommandBuffer)>& panel) {
    frame.commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
    if (picture_changed_) record_upload(frame);
    record_picture(frame, swapchain_->image(image));
    frame.commands.beginRenderPass(
        vk::RenderPassBeginInfo(*render_pass_, *targets_[image].framebuffer, vk::Rect2D({0, 0}, swapchain_->size())),
        vk::SubpassContents::eInline);
    panel(*frame.commands);
    frame.commands.endRenderPass();
    frame.commands.end();
}

bool Presenter::draw(vk::Extent2D size, const std::function<void(vk::CommandBuffer)>& panel) {
    if (size.width == 0 || size.height == 0) return false;
    if (outdated_ || size != swapchain_->size()) make_swapchain(size);
    if (const vk::Extent2D wanted{picture_.width, picture_.height}; wanted != picture_size_) make_picture(wanted);
    Frame& frame = frames_[frame_count_ % frames_in_flight];
    (void)device_.handle().waitForFences(*frame.done, true, forever);
    std::uint32_t image = 0;
    try {
        const auto [result, acquired] = swapchain_->handle().acquireNextImage(forever, *frame.acquired);
        outdated_ = result == vk::Result::eSuboptimalKHR;
        image = acquired;
    } catch (const vk::OutOfDateKHRError&) {
        outdated_ = true;
        return false;
    }
    device_.handle().resetFences(*frame.done);
    record(frame, image, panel);
    const vk::PipelineStageFlags waits_at = Stage::eTransfer;
    device_.queue().submit(
        vk::SubmitInfo(*frame.acquired, waits_at, *frame.commands, *targets_[image].drawn), *frame.done);
    ++frame_count_;
    return present(image);
}

bool Presenter::present(std::uint32_t image) {
    try {
        const vk::Result result =
            device_.queue().presentKHR(vk::PresentInfoKHR(*targets_[image].drawn, *swapchain_->handle(), image));
        outdated_ = outdated_ || result == vk::Result::eSuboptimalKHR;
        return true;
    } catch (const vk::OutOfDateKHRError&) {
        outdated_ = true;
        return false;
    }
}

}  // namespace tandem
