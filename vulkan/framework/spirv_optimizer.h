// SPIR-V specialised before a driver sees it, by spirv-opt's passes. All throw Error if the optimiser fails. Constants
// without a value here keep their default.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vulkan/framework/pipeline.h"

namespace tandem {

// `code` with its specialisation constants frozen at these values and without what then is dead: cheap enough for each
// pipeline. Arithmetic is left as it is.
[[nodiscard]] std::vector<std::uint32_t> trimmed_spirv(
    std::span<const std::uint32_t> code, std::span<const SpecialisationConstant> constants);

// The same, optimised for performance, which takes seconds: for reports and tests.
[[nodiscard]] std::vector<std::uint32_t> optimised_spirv(
    std::span<const std::uint32_t> code, std::span<const SpecialisationConstant> constants);

// Instructions within functions: no types, constants, names or decorations.
[[nodiscard]] std::uint64_t count_instructions(std::span<const std::uint32_t> code);

// Bindings of descriptors that instructions within functions use.
[[nodiscard]] std::uint64_t count_bindings(std::span<const std::uint32_t> code);

}  // namespace tandem
