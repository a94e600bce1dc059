// Something of the desktop that frames can be presented on. The window room has one; others take it as it comes, so
// that they need no library of windows.
#pragma once

#include <functional>
#include <memory>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

namespace tandem {

class SurfaceSource {
public:
    SurfaceSource() = default;
    virtual ~SurfaceSource() = default;
    SurfaceSource(const SurfaceSource&) = delete;
    SurfaceSource& operator=(const SurfaceSource&) = delete;

    // That an instance needs for the surface.
    [[nodiscard]] virtual std::vector<const char*> instance_extensions() const = 0;
    [[nodiscard]] virtual vk::raii::SurfaceKHR surface(const vk::raii::Instance& instance) const = 0;
    // Handles what has happened on the desktop.
    virtual void poll() = 0;
};
// Of so many pixels. Throws DeviceError, with the reason, where there is no desktop.
using MakeSurfaceSource = std::function<std::shared_ptr<SurfaceSource>(std::uint32_t width, std::uint32_t height)>;

}  // namespace tandem
