#include "vulkan/framework/spirv_optimizer.h"

#include <algorithm>
#include <set>
#include <spirv-tools/optimizer.hpp>
#include <string>
#include <unordered_map>

#include "common/error.h"

namespace tandem {

namespace {

constexpr std::size_t header_words = 5;

// Calls visit(words of the instruction, whether it is within a function) for all in order.
template <class Visit>
void for_each_instruction(std::span<const std::uint32_t> code, Visit visit) {
    constexpr std::uint32_t function = 54, function_end = 56;  // OpFunction, OpFunctionEnd
    bool within = false;
    for (std::size_t at = header_words; at < code.size() && code[at] >> 16 != 0; at += code[at] >> 16) {
        const std::uint32_t opcode = code[at] & 0xffffu;
        if (opcode == function) within = true;
        visit(code.subspan(at, std::min<std::size_t>(code[at] >> 16, code.size() - at)), within);
        if (opcode == function_end) within = false;
    }
}

}  // namespace

std::vector<std::uint32_t> optimised_spirv(
    std::span<const std::uint32_t> code, std::span<const SpecialisationConstant> constants) {
    std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> values;
    for (const SpecialisationConstant& constant : constants) values[constant.id] = {constant.value};
    std::string messages;
    spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_2);
    optimizer.SetMessageConsumer(
        [&](spv_message_level_t level, const char*, const spv_position_t&, const char* message) {
            if (level <= SPV_MSG_ERROR) messages += std::string(message) + "\n";
        });
    optimizer.RegisterPass(spvtools::CreateSetSpecConstantDefaultValuePass(values))
        .RegisterPass(spvtools::CreateFreezeSpecConstantValuePass())
        .RegisterPass(spvtools::CreateFoldSpecConstantOpAndCompositePass())
        .RegisterPerformancePasses();
    spvtools::OptimizerOptions options;
    options.set_run_validator(false);  // the build has run it
    std::vector<std::uint32_t> result;
    if (!optimizer.Run(code.data(), code.size(), &result, options))
        throw Error("SPIRV-Tools cannot optimise a shader: " + messages);
    return result;
}

std::uint64_t count_instructions(std::span<const std::uint32_t> code) {
    std::uint64_t count = 0;
    for_each_instruction(code, [&](std::span<const std::uint32_t>, bool within) { count += within ? 1 : 0; });
    return count;
}

std::uint64_t count_bindings(std::span<const std::uint32_t> code) {
    constexpr std::uint32_t decorate = 71, binding = 33;
    std::set<std::uint32_t> bound, used;  // variables; a literal equal to one's number counts it as used
    for_each_instruction(code, [&](std::span<const std::uint32_t> words, bool within) {
        if ((words[0] & 0xffffu) == decorate && words[2] == binding) bound.insert(words[1]);
        if (!within) return;
        for (const std::uint32_t word : words.subspan(1))
            if (bound.contains(word)) used.insert(word);
    });
    return used.size();
}

}  // namespace tandem
