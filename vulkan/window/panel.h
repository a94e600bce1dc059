// The panel over the picture, and the input of mouse and keys. Dear ImGui has one context for the whole program.
#pragma once

#include "common/view/window.h"
#include "vulkan/window/presenter.h"

namespace tandem {

class Panel {
public:
    // All must outlive it.
    Panel(const Instance& instance, const Device& device, GlfwWindow& window, Presenter& presenter);
    ~Panel();
    Panel(const Panel&) = delete;
    Panel& operator=(const Panel&) = delete;

    // Once a frame: reads mouse and keys, moves the camera, and builds what draw() draws.
    void update(ViewSession& session, const WindowOptions& options, double seconds_a_frame);
    void draw(vk::CommandBuffer commands);

    [[nodiscard]] const Appearance& appearance() const { return appearance_; }
    void set_appearance(const Appearance& appearance) { appearance_ = appearance; }

private:
    void show(ViewSession& session, const WindowOptions& options, double seconds_a_frame);
    void show_backends(const ViewSession& session) const;
    void show_presentation();
    void next_mode();  // of those that there are
    void move_camera(ViewSession& session);
    void take_keys(ViewSession& session, const WindowOptions& options);
    void save(const WindowOptions& options);

    GlfwWindow& window_;
    Presenter& presenter_;
    vk::raii::DescriptorPool descriptors_;
    Appearance appearance_;
    bool visible_ = true, fits_window_ = false;
    std::string message_;
};

}  // namespace tandem
