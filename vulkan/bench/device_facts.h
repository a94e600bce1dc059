// A device's own description, which is stored beside the measurements made on it.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "vulkan/core/device.h"

namespace tandem {

// Name, driver, UUIDs, extensions, queues, memory types, clock, and the hash of the shaders.
[[nodiscard]] nlohmann::json facts_of(const Device& device);

}  // namespace tandem
