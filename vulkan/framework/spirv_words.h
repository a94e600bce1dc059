// The words of a SPIR-V module, instruction by instruction.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

namespace tandem::spirv {

inline constexpr std::size_t header_words = 5;

// Calls visit(words) for the words of each instruction, in order.
template <class Visit>
void for_each_instruction(std::span<const std::uint32_t> code, const Visit& visit) {
    for (std::size_t at = header_words; at < code.size();) {
        const std::size_t words = std::max<std::size_t>(1, code[at] >> 16);
        visit(code.subspan(at, std::min(words, code.size() - at)));
        at += words;
    }
}

[[nodiscard]] inline std::uint32_t opcode_of(std::span<const std::uint32_t> instruction) {
    return instruction[0] & 0xffffu;
}

}  // namespace tandem::spirv
