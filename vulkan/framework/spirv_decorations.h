// Changes decorations in SPIR-V modules.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tandem {

// The module without its NoContraction decorations: a driver may then fuse products and sums.
[[nodiscard]] std::vector<std::uint32_t> without_no_contraction(std::span<const std::uint32_t> code);

// How many instructions of floating-point arithmetic there are, and how many of them bear NoContraction.
struct ContractionCount {
    std::size_t arithmetic = 0, decorated = 0;
};
[[nodiscard]] ContractionCount count_no_contraction(std::span<const std::uint32_t> code);

}  // namespace tandem
