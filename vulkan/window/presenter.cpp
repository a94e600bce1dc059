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

// The blits of frames before are done with the image before it changes.
constexpr ImageUse blitted_before{Stage::eTransfer, Access::eTransferRead, Layout::eUndefined};

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
    if (!make_swapchain(size)) throw DeviceError("the window has no size; make it larger");
}

// A lost device cannot be waited for, and need not be.
void Presenter::wait() const {
    try {
        device_.handle().waitIdle();
    } catch (const vk::SystemError&) {
    }
}

bool Presenter::make_swapchain(vk::Extent2D size) {
    const vk::Extent2D given = swapchain_size(device_, surface_, size);
    if (given.width == 0 || given.height == 0) return false;
    device_.handle().waitIdle();
    targets_.clear();
    swapchain_.emplace([&] {
        const SwapchainSpec spec{.format = abilities_.format(), .mode = mode_};
        return Swapchain(device_, surface_, spec, size, swapchain_ ? &*swapchain_ : nullptr);
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
    return true;
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
    if (picture_image_) device_.handle().waitIdle();  // frames may still read the old one
    picture_image_.reset();
    using Usage = vk::ImageUsageFlagBits;
    picture_image_.emplace(device_, ImageSpec{.size = size, .usage = Usage::eTransferDst | Usage::eTransferSrc});
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
    const vk::raii::CommandBuffer& commands = frame.commands;
    const vk::Image image = picture_image_->handle();
    const vk::Extent2D size = picture_size();
    transition(commands, image, blitted_before, copied_to);
    commands.copyBufferToImage((*frame.staging)[0], image, copied_to.layout,
        vk::BufferImageCopy(frame.staging->offset(0), 0, 0, first_layer, {}, {size.width, size.height, 1}));
    transition(commands, image, copied_to, copied_from);
    picture_changed_ = false;
}

void Presenter::record_picture(const Frame& frame, vk::Image target) const {
    const vk::raii::CommandBuffer& commands = frame.commands;
    transition(commands, target, acquired_image(Stage::eTransfer), copied_to);
    constexpr float grey = 0.1f;
    commands.clearColorImage(target, Layout::eTransferDstOptimal,
        vk::ClearColorValue(std::array<float, 4>{grey, grey, grey, 1.0f}), whole_image);
    if (!picture_image_) return;
    transition(commands, target, copied_to, copied_to);
    const vk::Rect2D place = picture_place();
    const vk::Rect2D whole({0, 0}, picture_size());
    const bool larger = place.extent.width >= whole.extent.width;  // pixels stay square and sharp
    commands.blitImage(picture_image_->handle(), Layout::eTransferSrcOptimal, target, Layout::eTransferDstOptimal,
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
    if ((outdated_ || size != swapchain_->size()) && !make_swapchain(size)) return false;
    if (const vk::Extent2D wanted{picture_.width, picture_.height}; wanted != picture_size()) make_picture(wanted);
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
