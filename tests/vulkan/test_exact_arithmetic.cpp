// That the kernels leave their arithmetic no choice (shaders/tools/exact_arithmetic.py).
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <span>

#include "vulkan/framework/shader_library.h"

namespace tandem {

namespace {

// SPIR-V's numbers. Compound: OpVectorTimesMatrix, OpMatrixTimesVector, OpDot; and of GLSL.std.450 FMix, Length,
// Distance, Cross, Normalize, FaceForward, Reflect, Refract.
constexpr std::array compound{144u, 145u, 148u};
constexpr std::array compound_functions{46u, 66u, 67u, 68u, 69u, 70u, 71u, 72u};
constexpr std::uint32_t ext_inst = 12, sine = 13, logarithm_2 = 30;  // and the functions between the two

struct Counts {
    std::size_t compound = 0, transcendental = 0, known = 0;  // known: functions of GLSL.std.450 in all
};

Counts count(std::span<const std::uint32_t> code) {
    Counts counts;
    for (std::size_t at = 5; at < code.size(); at += code[at] >> 16) {
        const std::uint32_t opcode = code[at] & 0xffffu;
        if (std::ranges::count(compound, opcode) > 0) ++counts.compound;
        if (opcode != ext_inst) continue;
        ++counts.known;
        const std::uint32_t function = code[at + 4];
        if (std::ranges::count(compound_functions, function) > 0) ++counts.compound;
        if (function >= sine && function <= logarithm_2) ++counts.transcendental;
    }
    return counts;
}

}  // namespace

// That none of what remains may be contracted is tested in test_ray_batch.cpp.
TEST_CASE("No kernel leaves a compiler to choose how a sum of products is rounded") {
    for (const Stage stage : {Stage::vertex, Stage::ray_gen, Stage::intersect, Stage::scatter, Stage::megakernel,
             Stage::fragment, Stage::rq_paths, Stage::rt_paths, Stage::rt_triangle, Stage::rt_sphere, Stage::rt_cuboid,
             Stage::rt_nearest, Stage::trace, Stage::ray_batch}) {
        CAPTURE(static_cast<int>(stage));
        const Counts counts = count(shader_code(stage));
        CHECK(counts.compound == 0);
        CHECK(counts.transcendental == 0);
        CHECK(counts.known > 0);
    }
    CHECK(count(shader_code(Stage::ray_batch_double)).compound == 0);
    for (const ShaderVariant variant : {ShaderVariant::mixed, ShaderVariant::in_double})
        for (const Stage stage : {Stage::megakernel, Stage::trace}) {
            CAPTURE(static_cast<int>(variant));
            CAPTURE(static_cast<int>(stage));
            const Counts counts = count(shader_variant(stage, variant));
            CHECK(counts.compound == 0);
            CHECK(counts.transcendental == 0);
            CHECK(counts.known > 0);
        }
    CHECK(count(shader_code(Stage::post_process)).compound == 0);
    CHECK(count(shader_variant(Stage::post_process, ShaderVariant::double_sums)).compound == 0);
    for (const Stage stage : {Stage::megakernel, Stage::fragment, Stage::rt_paths, Stage::rq_paths})
        CHECK(count(shader_variant(stage, ShaderVariant::double_sums)).compound == 0);
    for (const Stage stage : {Stage::rt_paths, Stage::rq_paths})
        for (const ShaderVariant variant :
            {ShaderVariant::device_triangles, ShaderVariant::device_triangles_double_sums})
            CHECK(count(shader_variant(stage, variant)).compound == 0);
}

}  // namespace tandem
