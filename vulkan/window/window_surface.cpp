#include "vulkan/window/window_surface.h"

#include "vulkan/core/surface_source.h"
#include "vulkan/window/glfw_window.h"

namespace tandem {

namespace {

class WindowSurface : public SurfaceSource {
public:
    WindowSurface(std::uint32_t width, std::uint32_t height) : window_("tandem bench", width, height) {}
    [[nodiscard]] std::vector<const char*> instance_extensions() const override {
        return window_.instance_extensions();
    }
    [[nodiscard]] vk::raii::SurfaceKHR surface(const vk::raii::Instance& instance) const override {
        return window_.surface(instance);
    }
    void poll() override { window_.poll(0.0); }

private:
    GlfwWindow window_;
};

}  // namespace

std::shared_ptr<SurfaceSource> window_surface(std::uint32_t width, std::uint32_t height) {
    return std::make_shared<WindowSurface>(width, height);
}

}  // namespace tandem
