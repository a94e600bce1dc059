// A window whose surface others present on.
#pragma once

#include <cstdint>
#include <memory>

namespace tandem {

class SurfaceSource;

// Throws DeviceError where there is no display, or none that Vulkan can show on.
[[nodiscard]] std::shared_ptr<SurfaceSource> window_surface(std::uint32_t width, std::uint32_t height);

}  // namespace tandem
