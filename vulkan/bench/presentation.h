// The window of the family `presentation`. It is made with the family's first arm, so that no window opens for other
// families.
#pragma once

#include "vulkan/bench/bench_device.h"
#include "vulkan/resources/show_place.h"
#include "vulkan/resources/swapchain.h"

namespace tandem {

// A window of so many pixels, or without a display a surface without one (VK_EXT_headless_surface). Throws
// UnsupportedError, with the reason, where neither is to be had.
[[nodiscard]] std::shared_ptr<ShowPlace> open_place(
    const MakeShowPlace& make_window, std::uint32_t width, std::uint32_t height);

// The mode that makes frames wait least, of those that there are.
[[nodiscard]] PresentMode fastest_mode(const SurfaceAbilities& abilities);

class PresentRun;

class PresentationStage {
public:
    // Throws UnsupportedError, with the reason, where no place is to be had or the device cannot present.
    PresentationStage(const BenchRequest& request, const MakeShowPlace& make_place);

    [[nodiscard]] const SharedDevice& device() const { return device_; }
    [[nodiscard]] const vk::raii::SurfaceKHR& surface() const { return surface_; }
    [[nodiscard]] const SurfaceAbilities& abilities() const { return *abilities_; }
    // A surface has one swapchain at a time: whoever held it before drops its own. Throws UnsupportedError where the
    // window does not take that size.
    void take(PresentRun* run, vk::Extent2D size);
    void leave(const PresentRun* run);
    void poll() { place_->poll(); }

private:
    std::shared_ptr<ShowPlace> place_;
    SharedDevice device_;
    vk::raii::SurfaceKHR surface_ = nullptr;
    std::optional<SurfaceAbilities> abilities_;
    PresentRun* holder_ = nullptr;
};

}  // namespace tandem
