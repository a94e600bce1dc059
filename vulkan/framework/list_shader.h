// A compute shader, compiled at run time, that maps one list of numbers to another. The marker of exercises uses it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tandem {

// Runs `code` on `count` items, in single precision: `arguments` numbers go in, `results` numbers an item come out. The
// SPIR-V has groups of 64, two storage buffers in set 0, the count pushed. By a software device where there is one,
// which no endless loop can hang; else by the first that can be used. Throws DeviceError where there is none.
[[nodiscard]] std::vector<float> run_list_shader(
    std::span<const std::uint32_t> code, std::span<const float> arguments, std::uint32_t count, std::uint32_t results);

}  // namespace tandem
