// The Vulkan compute path tracer as a backend.
#pragma once

#include "common/renderer.h"

namespace tandem {

[[nodiscard]] Backend vulkan_backend();  // "vulkan"

}  // namespace tandem
