// SPIR-V as a driver's compiler finds it: specialised, then optimised. For reports and tests alone: rendering hands the
// device the modules as they are.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vulkan/framework/pipeline.h"

namespace tandem {

// `code` with its specialisation constants frozen at these values (others at their defaults), and what then is dead
// taken out, by spirv-opt's passes for performance. Throws Error if the optimiser fails.
[[nodiscard]] std::vector<std::uint32_t> optimised_spirv(
    std::span<const std::uint32_t> code, std::span<const SpecialisationConstant> constants);

// Instructions within functions: no types, constants, names or decorations.
[[nodiscard]] std::uint64_t count_instructions(std::span<const std::uint32_t> code);

// Bindings of descriptors that instructions within functions use.
[[nodiscard]] std::uint64_t count_bindings(std::span<const std::uint32_t> code);

}  // namespace tandem
