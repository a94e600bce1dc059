// A window of the desktop, by GLFW. One thread only, and one window at a time.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

struct GLFWwindow;

namespace tandem {

class GlfwWindow {
public:
    // Throws DeviceError where there is no display, or none that Vulkan can show on.
    GlfwWindow(const std::string& title, std::uint32_t width, std::uint32_t height);
    GlfwWindow(const GlfwWindow&) = delete;  // its callbacks know its address
    GlfwWindow& operator=(const GlfwWindow&) = delete;

    // That an instance needs for a surface.
    [[nodiscard]] std::vector<const char*> instance_extensions() const;
    [[nodiscard]] vk::raii::SurfaceKHR surface(const vk::raii::Instance& instance) const;
    [[nodiscard]] GLFWwindow* handle() const { return window_.get(); }

    // What is drawn, in pixels; 0 while the window is minimised.
    [[nodiscard]] vk::Extent2D size() const;
    void set_size(vk::Extent2D size);  // a wish, in screen coordinates
    [[nodiscard]] bool closing() const;
    void close();
    [[nodiscard]] bool key(int glfw_key) const;  // whether it is down
    // Keys that went down since the last call, also those that are up again by now. Repeats do not count.
    [[nodiscard]] std::vector<int> take_pressed() { return std::exchange(pressed_, {}); }

    [[nodiscard]] bool full_screen() const;
    void set_full_screen(bool wanted);

    // Handles what has happened; waits for it at most so many seconds.
    void poll(double seconds);

private:
    struct Library {
        Library();
        ~Library();
        Library(const Library&) = delete;
        Library& operator=(const Library&) = delete;
    };
    struct Destroy {
        void operator()(GLFWwindow* window) const;
    };
    static void note_key(GLFWwindow* window, int key, int scancode, int action, int modifiers);

    struct Place {
        int x = 0, y = 0, width = 0, height = 0;
    };

    Library library_;
    std::unique_ptr<GLFWwindow, Destroy> window_;
    Place before_full_screen_;
    std::vector<int> pressed_;
};

}  // namespace tandem
