// The Vulkan pattern benchmarks (README.md here says how to add a pattern).
#pragma once

#include <vector>

#include "common/experiment/bench.h"
#include "vulkan/make_show_place.h"

namespace tandem {

// Throws what choosing the device throws. `make_window`: where frames are presented.
[[nodiscard]] BenchTarget vulkan_bench(const BenchRequest& request, const MakeShowPlace& make_window = {});

// What the thesis [Ferreira 2019] and vendors' guides recommend, tied to arms of the program's families.
[[nodiscard]] std::vector<Claim> pattern_claims();

}  // namespace tandem
