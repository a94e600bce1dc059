// What a command asks of a window, and what the window reports afterwards. A window library implements ShowWindow.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "common/render/present_mode.h"
#include "common/view/session.h"

namespace tandem {

struct WindowOptions {
    std::string title;
    std::string device;                        // as BackendOptions::device
    std::uint32_t width = 1280, height = 720;  // pixels
    bool full_screen = false;
    PresentMode present_mode = PresentMode::fifo;
    Appearance appearance;
    std::uint64_t frames = 0;  // > 0: closes after so many
    bool frames_wait = false;  // ... and not before the session has finished
    bool validation = false;   // any message of the layer is an Error
    // Writes the view and its picture; returns what to tell the user. Errors are told to him too.
    std::function<std::string(const Appearance&)> save;
};

struct WindowReport {
    std::uint64_t frames = 0;         // presented
    double seconds = 0.0;             // from the first frame to the last
    double slow_frame_seconds = 0.0;  // 95 % of the times between frames are shorter
    std::uint64_t swapchains = 0;     // made: one, and one for each change of size or mode
    PresentMode present_mode = PresentMode::fifo;
    std::uint32_t swapchain_images = 0;
    Appearance appearance;  // at the end
    std::string device;     // that presented
};

// Shows the session until its user closes the window, `frames` are shown, or a stop. Throws DeviceError where there is
// no display or no device that can show on it.
using ShowWindow = std::function<WindowReport(ViewSession&, const WindowOptions&, const std::stop_token&)>;

}  // namespace tandem
