// Frames of a window: the picture is copied to the device, blitted into a swapchain image, the panel drawn over it.
#pragma once

#include <array>
#include <functional>
#include <optional>

#include "common/view/session.h"
#include "vulkan/resources/buffer_group.h"
#include "vulkan/resources/image.h"
#include "vulkan/resources/swapchain.h"
#include "vulkan/window/glfw_window.h"

namespace tandem {

class Presenter {
public:
    // All must outlive it. Throws DeviceError where the device cannot show on the surface, or not in that mode.
    Presenter(const Device& device, const vk::raii::SurfaceKHR& surface, vk::Extent2D size, PresentMode mode);
    ~Presenter() { wait(); }
    Presenter(const Presenter&) = delete;
    Presenter& operator=(const Presenter&) = delete;

    [[nodiscard]] const SurfaceAbilities& abilities() const { return abilities_; }
    [[nodiscard]] const Swapchain& swapchain() const { return *swapchain_; }
    [[nodiscard]] std::uint64_t swapchains_made() const { return made_; }
    [[nodiscard]] vk::RenderPass render_pass() const { return *render_pass_; }
    [[nodiscard]] PresentMode mode() const { return mode_; }  // of the frames to come
    void set_mode(PresentMode mode);
    void wait() const;  // until the device has done all frames, or is lost

    // The picture of the frames to come. Throws Error where the device holds no image of that size.
    void set_picture(const ViewSession::Shown& picture);
    // Where it lies in the window, scaled as a whole, in the middle.
    [[nodiscard]] vk::Rect2D picture_place() const;

    // Draws and presents. `panel` records into the render pass. False: not shown, as the window has no size, or has
    // another one by now. Waits for the frame before the last.
    [[nodiscard]] bool draw(vk::Extent2D size, const std::function<void(vk::CommandBuffer)>& panel);

private:
    static constexpr std::size_t frames_in_flight = 2;
    struct Frame {
        vk::raii::CommandBuffer commands = nullptr;
        vk::raii::Fence done = nullptr;
        vk::raii::Semaphore acquired = nullptr;
        std::optional<BufferGroup> staging;
        vk::DeviceSize staging_bytes = 0;
    };
    struct Target {  // of a swapchain image
        vk::raii::Framebuffer framebuffer = nullptr;
        vk::raii::Semaphore drawn = nullptr;
    };

    // False: the surface has no size now.
    [[nodiscard]] bool make_swapchain(vk::Extent2D size);
    void make_picture(vk::Extent2D size);
    [[nodiscard]] vk::Extent2D picture_size() const {
        return picture_image_ ? picture_image_->spec().size : vk::Extent2D();
    }
    void record_upload(Frame& frame);
    void record(Frame& frame, std::uint32_t image, const std::function<void(vk::CommandBuffer)>& panel);
    void record_picture(const Frame& frame, vk::Image target) const;
    [[nodiscard]] bool present(std::uint32_t image);

    const Device& device_;
    const vk::raii::SurfaceKHR& surface_;
    SurfaceAbilities abilities_;
    PresentMode mode_;
    vk::raii::RenderPass render_pass_;
    vk::raii::CommandPool pool_;
    std::array<Frame, frames_in_flight> frames_;
    std::uint64_t frame_count_ = 0, made_ = 0;
    std::optional<Swapchain> swapchain_;
    std::vector<Target> targets_;
    bool outdated_ = false;

    ViewSession::Shown picture_;
    bool picture_changed_ = false;
    std::optional<DeviceImage> picture_image_;
};

}  // namespace tandem
