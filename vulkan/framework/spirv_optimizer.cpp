#include "vulkan/framework/spirv_optimizer.h"

#include <spirv-tools/optimizer.hpp>
#include <string>
#include <unordered_map>

#include "common/error.h"

namespace tandem {

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
    constexpr std::size_t header_words = 5;
    constexpr std::uint32_t function = 54, function_end = 56;  // OpFunction, OpFunctionEnd
    std::uint64_t count = 0;
    bool within = false;
    for (std::size_t at = header_words; at < code.size() && code[at] >> 16 != 0; at += code[at] >> 16) {
        const std::uint32_t opcode = code[at] & 0xffffu;
        if (opcode == function) within = true;
        if (within) ++count;
        if (opcode == function_end) within = false;
    }
    return count;
}

}  // namespace tandem
