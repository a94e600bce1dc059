// Advice if there is no Vulkan device.
#pragma once

#include <string>

namespace tandem {

// To install a driver, or, where variables of the loader name drivers, to correct them.
[[nodiscard]] std::string driver_remedy();

}  // namespace tandem
