// The Vulkan pattern benchmarks (README.md here says how to add a pattern).
#pragma once

#include "common/experiment/bench.h"
#include "vulkan/make_show_place.h"

namespace tandem {

// Throws what choosing the device throws. `make_window`: where frames are presented.
[[nodiscard]] BenchTarget vulkan_bench(const BenchRequest& request, const MakeShowPlace& make_window = {});

}  // namespace tandem
