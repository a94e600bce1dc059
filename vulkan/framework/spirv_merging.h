// Rewrites SPIR-V modules so that the storage buffers of a set are parts of one buffer (resources/merged_buffers.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vulkan/resources/merged_buffers.h"

namespace tandem {

// The module, made for `separate` sets, as merged ones want it. Each storage block takes the binding that has them all,
// and an index into its array grows by where its part begins. Parts must begin at multiples of the array's stride.
// Throws Error where such a block is anything but one array, or is used but element by element.
[[nodiscard]] std::vector<std::uint32_t> with_merged_buffers(
    std::span<const std::uint32_t> code, const std::vector<SetBindings>& separate);

}  // namespace tandem
