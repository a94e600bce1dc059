// The Vulkan compute path tracer as a backend.
#pragma once

#include "common/render/renderer.h"

namespace tandem {

// How rays find primitives; the images do not depend on it. automatic: loops over few primitives, trees over many.
enum class Acceleration { automatic, loops, trees };

[[nodiscard]] Backend vulkan_backend(Acceleration acceleration = Acceleration::automatic);  // "vulkan"

}  // namespace tandem
