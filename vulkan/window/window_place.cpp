#include "vulkan/window/window_place.h"

#include "vulkan/resources/show_place.h"
#include "vulkan/window/glfw_window.h"

namespace tandem {

namespace {

class WindowPlace : public ShowPlace {
public:
    WindowPlace(std::uint32_t width, std::uint32_t height) : window_("Tandem bench", width, height) {}
    [[nodiscard]] std::vector<const char*> instance_extensions() const override {
        return window_.instance_extensions();
    }
    [[nodiscard]] vk::raii::SurfaceKHR surface(const vk::raii::Instance& instance) const override {
        return window_.surface(instance);
    }
    void resize(vk::Extent2D size) override { window_.set_size(size); }
    void poll() override { window_.poll(0.0); }

private:
    GlfwWindow window_;
};

}  // namespace

std::shared_ptr<ShowPlace> make_window_place(std::uint32_t width, std::uint32_t height) {
    return std::make_shared<WindowPlace>(width, height);
}

}  // namespace tandem
