// The Vulkan pattern benchmarks (README.md here says how to add a pattern).
#pragma once

#include "common/experiment/bench.h"

namespace tandem {

// Throws what choosing the device throws.
[[nodiscard]] BenchTarget vulkan_bench(const BenchRequest& request);

}  // namespace tandem
