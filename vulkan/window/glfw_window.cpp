#include "vulkan/window/glfw_window.h"

#include <vulkan/vulkan.h>
// Before GLFW: it declares its functions of Vulkan only where these types are known.
#include <GLFW/glfw3.h>

#include <span>

#include "common/error.h"

namespace tandem {

namespace {

std::string last_error() {
    const char* text = nullptr;
    return glfwGetError(&text) == GLFW_NO_ERROR || text == nullptr ? "no reason is given" : text;
}

}  // namespace

GlfwWindow::Library::Library() {
    if (glfwInit() != GLFW_TRUE)
        throw DeviceError("no display to open a window on (" + last_error() +
                          "); set DISPLAY, or run under xvfb-run; tandem render needs none");
    if (glfwVulkanSupported() != GLFW_TRUE) {
        const std::string why = last_error();
        glfwTerminate();
        throw DeviceError("Vulkan cannot show images on this display: " + why);
    }
}

GlfwWindow::Library::~Library() { glfwTerminate(); }

void GlfwWindow::Destroy::operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }

GlfwWindow::GlfwWindow(const std::string& title, std::uint32_t width, std::uint32_t height) {
    glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    window_.reset(glfwCreateWindow(static_cast<int>(width), static_cast<int>(height), title.c_str(), nullptr, nullptr));
    if (!window_) throw DeviceError("no window can be opened: " + last_error());
    glfwSetWindowUserPointer(window_.get(), this);
    glfwSetKeyCallback(window_.get(), note_key);  // the panel's own, made later, calls it first
}

void GlfwWindow::note_key(GLFWwindow* window, int key, int, int action, int) {
    if (action == GLFW_PRESS) static_cast<GlfwWindow*>(glfwGetWindowUserPointer(window))->pressed_.push_back(key);
}

std::vector<const char*> GlfwWindow::instance_extensions() const {
    std::uint32_t count = 0;
    const char** names = glfwGetRequiredInstanceExtensions(&count);
    if (names == nullptr) throw DeviceError("Vulkan cannot show images on this display: " + last_error());
    const std::span list(names, count);
    return {list.begin(), list.end()};
}

vk::raii::SurfaceKHR GlfwWindow::surface(const vk::raii::Instance& instance) const {
    VkSurfaceKHR surface = VK_NULL_HANDLE;
    if (glfwCreateWindowSurface(*instance, window_.get(), nullptr, &surface) != VK_SUCCESS)
        throw DeviceError("the window gives no surface to Vulkan: " + last_error());
    return {instance, surface};
}

vk::Extent2D GlfwWindow::size() const {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_.get(), &width, &height);
    if (glfwGetWindowAttrib(window_.get(), GLFW_ICONIFIED) == GLFW_TRUE) return {};
    return {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

void GlfwWindow::set_size(vk::Extent2D size) {
    glfwSetWindowSize(window_.get(), static_cast<int>(size.width), static_cast<int>(size.height));
}

bool GlfwWindow::closing() const { return glfwWindowShouldClose(window_.get()) == GLFW_TRUE; }

void GlfwWindow::close() { glfwSetWindowShouldClose(window_.get(), GLFW_TRUE); }

bool GlfwWindow::key(int glfw_key) const { return glfwGetKey(window_.get(), glfw_key) == GLFW_PRESS; }

bool GlfwWindow::full_screen() const { return glfwGetWindowMonitor(window_.get()) != nullptr; }

void GlfwWindow::set_full_screen(bool wanted) {
    if (wanted == full_screen()) return;
    if (!wanted) {
        const Place& old = before_full_screen_;
        glfwSetWindowMonitor(window_.get(), nullptr, old.x, old.y, old.width, old.height, GLFW_DONT_CARE);
        return;
    }
    GLFWmonitor* monitor = glfwGetPrimaryMonitor();
    const GLFWvidmode* mode = monitor != nullptr ? glfwGetVideoMode(monitor) : nullptr;
    if (mode == nullptr) throw DeviceError("there is no monitor to fill: " + last_error());
    Place& place = before_full_screen_;
    glfwGetWindowPos(window_.get(), &place.x, &place.y);
    glfwGetWindowSize(window_.get(), &place.width, &place.height);
    glfwSetWindowMonitor(window_.get(), monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

void GlfwWindow::poll(double seconds) {
    if (seconds > 0.0)
        glfwWaitEventsTimeout(seconds);
    else
        glfwPollEvents();
}

}  // namespace tandem
