// Where images can be presented: a window, or a substitute for one.
#pragma once

#include <vector>
#include <vulkan/vulkan_raii.hpp>

#include "vulkan/make_show_place.h"

namespace tandem {

class ShowPlace {
public:
    ShowPlace() = default;
    virtual ~ShowPlace() = default;
    ShowPlace(const ShowPlace&) = delete;
    ShowPlace& operator=(const ShowPlace&) = delete;

    // That an instance needs for a surface.
    [[nodiscard]] virtual std::vector<const char*> instance_extensions() const = 0;
    [[nodiscard]] virtual vk::raii::SurfaceKHR surface(const vk::raii::Instance& instance) const = 0;
    // Asks for another size, which may take a while to come.
    virtual void resize(vk::Extent2D size) = 0;
    // Handles what has happened.
    virtual void poll() = 0;
};

}  // namespace tandem
