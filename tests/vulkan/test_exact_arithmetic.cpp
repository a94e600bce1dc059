// That the kernels leave their arithmetic no choice (shaders/exact_arithmetic.py).
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <set>
#include <span>

#include "vulkan/framework/shader_library.h"

namespace tandem {

namespace {

// SPIR-V's numbers. Compound: OpVectorTimesMatrix, OpMatrixTimesVector, OpDot; and of GLSL.std.450 FMix, Length,
// Distance, Cross, Normalize, FaceForward, Reflect, Refract.
constexpr std::array compound{144u, 145u, 148u};
constexpr std::array compound_functions{46u, 66u, 67u, 68u, 69u, 70u, 71u, 72u};
constexpr std::uint32_t sine = 13, logarithm_2 = 30;  // and the library's functions between them
constexpr std::uint32_t ext_inst = 12, decorate = 71, no_contraction = 42;
// OpFNegate, OpFAdd, OpFSub, OpFMul, OpFDiv, OpVectorTimesScalar
constexpr std::array simple{127u, 129u, 131u, 133u, 136u, 142u};

struct Counts {
    std::size_t compound = 0, library = 0, simple = 0, free = 0;  // free: simple ones that may be contracted
};

Counts count(std::span<const std::uint32_t> code) {
    Counts counts;
    std::set<std::uint32_t> held;
    for (std::size_t at = 5; at < code.size(); at += code[at] >> 16) {
        const std::uint32_t opcode = code[at] & 0xffffu;
        if (opcode == decorate && code[at + 2] == no_contraction) held.insert(code[at + 1]);
        const bool by_function = opcode == ext_inst && std::ranges::count(compound_functions, code[at + 4]) > 0;
        if (std::ranges::count(compound, opcode) > 0 || by_function) ++counts.compound;
        if (opcode == ext_inst && code[at + 4] >= sine && code[at + 4] <= logarithm_2) ++counts.library;
        if (std::ranges::count(simple, opcode) == 0) continue;
        ++counts.simple;
        if (!held.contains(code[at + 2])) ++counts.free;
    }
    return counts;
}

}  // namespace

TEST_CASE("No kernel leaves a compiler to choose how a sum of products is rounded") {
    for (const Stage stage : {Stage::vertex, Stage::ray_gen, Stage::intersect, Stage::scatter, Stage::post_process,
             Stage::megakernel, Stage::trace}) {
        CAPTURE(static_cast<int>(stage));
        const Counts counts = count(shader_code(stage));
        CHECK(counts.compound == 0);
        CHECK(counts.library == 0);
        CHECK(counts.free == 0);
        CHECK(counts.simple > 0);
    }
}

}  // namespace tandem
