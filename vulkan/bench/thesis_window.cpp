#include "vulkan/bench/thesis_window.h"

#include <fmt/format.h>

#include <limits>

#include "common/error.h"
#include "vulkan/bench/presentation.h"

namespace tandem {

namespace {

constexpr ImageUse acquired_for_compute = acquired_image(vk::PipelineStageFlagBits::eComputeShader);

Swapchain make_swapchain(const Device& device, const vk::raii::SurfaceKHR& surface, ImageSize size) {
    const SurfaceAbilities abilities(device, surface);
    const std::string& name = device.description().name;
    SwapchainSpec spec{.format = abilities.format(), .mode = fastest_mode(abilities)};
    spec.usage = vk::ImageUsageFlagBits::eStorage;
    if (!device.features().stores_any_format || !(abilities.usage() & spec.usage))
        throw UnsupportedError(name + " lets no kernel write to a window's images");
    if (const std::string reason = unsupported_image(
            device, {.size = {size.width, size.height}, .format = spec.format.format, .usage = spec.usage});
        !reason.empty())
        throw UnsupportedError(reason);
    Swapchain swapchain(device, surface, spec, {size.width, size.height}, nullptr);
    const vk::Extent2D made = swapchain.size();
    if (made.width != size.width || made.height != size.height)
        throw UnsupportedError(fmt::format(
            "a window of {}x{} pixels was opened as one of {}x{}", size.width, size.height, made.width, made.height));
    return swapchain;
}

}  // namespace

ThesisWindow::ThesisWindow(const BenchRequest& request, const MakeShowPlace& make_window, ImageSize size)
    : place_(open_place(make_window, size.width, size.height)),
      device_(std::make_shared<BenchDevice>(
          request, place_->instance_extensions(), std::vector<const char*>{VK_KHR_SWAPCHAIN_EXTENSION_NAME})),
      surface_(place_->surface(device_->instance().handle())),
      swapchain_(make_swapchain(device_->device(), surface_, size)),
      acquired_(device_->device().handle(), vk::SemaphoreCreateInfo()) {
    for (std::size_t i = 0; i < swapchain_->image_count(); ++i)
        rendered_.emplace_back(device_->device().handle(), vk::SemaphoreCreateInfo());
}

ThesisWindow::~ThesisWindow() {
    try {
        device_->device().handle().waitIdle();
    } catch (const vk::SystemError&) {  // a lost device has nothing left to wait for
    }
}

std::string ThesisWindow::text() const {
    return fmt::format("present mode {}, {} images", present_mode_names[static_cast<std::size_t>(swapchain_->mode())],
        swapchain_->image_count());
}

FrameTarget ThesisWindow::acquire() {
    try {
        image_ = swapchain_->handle().acquireNextImage(std::numeric_limits<std::uint64_t>::max(), *acquired_).second;
    } catch (const vk::OutOfDateKHRError&) {
        throw Error("the window changed while its frames were timed; leave it alone");
    }
    return {swapchain_->image(image_), swapchain_->view(image_), acquired_for_compute, presented, *acquired_,
        *rendered_[image_]};
}

void ThesisWindow::present() {
    const vk::Semaphore rendered = *rendered_[image_];
    const vk::SwapchainKHR swapchain = *swapchain_->handle();
    try {
        (void)device_->device().queue().presentKHR(vk::PresentInfoKHR(rendered, swapchain, image_));
    } catch (const vk::OutOfDateKHRError&) {
        throw Error("the window changed while its frames were timed; leave it alone");
    }
}

}  // namespace tandem
