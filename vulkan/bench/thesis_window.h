// A device with a window of its own, whose images frames end in one after the other.
#pragma once

#include "vulkan/bench/bench_device.h"
#include "vulkan/resources/show_place.h"
#include "vulkan/resources/swapchain.h"

namespace tandem {

class ThesisWindow {
public:
    // Throws DeviceError or UnsupportedError, with the reason, where kernels cannot write to the images of a window of
    // this size.
    ThesisWindow(const BenchRequest& request, const MakeShowPlace& make_window, ImageSize size);
    ThesisWindow(const ThesisWindow&) = delete;
    ThesisWindow& operator=(const ThesisWindow&) = delete;
    // Waits until nothing is presented any more.
    ~ThesisWindow();

    [[nodiscard]] const SharedDevice& device() const { return device_; }
    // The present mode and the number of images.
    [[nodiscard]] std::string text() const;

    // Handles what has happened on the desktop: outside of what is timed.
    void poll() { place_->poll(); }
    // Acquires the next image. Throws Error where the window has changed its size.
    [[nodiscard]] FrameTarget acquire();
    // Presents the image acquired last once the commands are done that signal FrameTarget::rendered.
    void present();

private:
    std::shared_ptr<ShowPlace> place_;
    SharedDevice device_;
    vk::raii::SurfaceKHR surface_;
    std::optional<Swapchain> swapchain_;
    vk::raii::Semaphore acquired_;
    std::vector<vk::raii::Semaphore> rendered_;  // by image: an earlier presentation may still wait for another's
    std::uint32_t image_ = 0;                    // acquired last
};

}  // namespace tandem
