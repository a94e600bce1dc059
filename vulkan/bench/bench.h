// The Vulkan pattern benchmarks (README.md here says how to add a pattern).
#pragma once

#include "common/experiment/bench.h"

namespace tandem {

class SurfaceSource;

// `make_surface`: opens a window of so many pixels (vulkan/core/surface_source.h); none: this build has no windows.
// Throws what choosing the device throws.
[[nodiscard]] BenchTarget vulkan_bench(const BenchRequest& request,
    const std::function<std::shared_ptr<SurfaceSource>(std::uint32_t width, std::uint32_t height)>& make_surface = {});

}  // namespace tandem
