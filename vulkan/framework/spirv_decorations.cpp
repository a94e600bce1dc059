#include "vulkan/framework/spirv_decorations.h"

#include <algorithm>
#include <array>
#include <set>

#include "vulkan/framework/spirv_words.h"

namespace tandem {

using spirv::for_each_instruction;
using spirv::header_words;
using spirv::opcode_of;

namespace {

constexpr std::uint32_t decorate = 71, no_contraction = 42;
// OpFNegate, OpFAdd, OpFSub, OpFMul, OpFDiv, OpFRem, OpFMod, products of vectors, scalars and matrices, OpDot.
constexpr std::array<std::uint32_t, 14> arithmetic{
    127, 129, 131, 133, 136, 140, 141, 142, 143, 144, 145, 146, 147, 148};

bool forbids_contraction(std::span<const std::uint32_t> instruction) {
    return opcode_of(instruction) == decorate && instruction.size() >= 3 && instruction[2] == no_contraction;
}

}  // namespace

std::vector<std::uint32_t> without_no_contraction(std::span<const std::uint32_t> code) {
    std::vector<std::uint32_t> result(code.begin(), code.begin() + header_words);
    for_each_instruction(code, [&](std::span<const std::uint32_t> instruction) {
        if (!forbids_contraction(instruction)) result.insert(result.end(), instruction.begin(), instruction.end());
    });
    return result;
}

ContractionCount count_no_contraction(std::span<const std::uint32_t> code) {
    std::set<std::uint32_t> decorated;
    ContractionCount count;
    for_each_instruction(code, [&](std::span<const std::uint32_t> instruction) {
        if (forbids_contraction(instruction)) decorated.insert(instruction[1]);
        if (std::ranges::find(arithmetic, opcode_of(instruction)) == arithmetic.end()) return;
        ++count.arithmetic;
        if (decorated.contains(instruction[2])) ++count.decorated;
    });
    return count;
}

}  // namespace tandem
