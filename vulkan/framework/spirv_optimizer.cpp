#include "vulkan/framework/spirv_optimizer.h"

#include <map>
#include <set>
#include <spirv-tools/optimizer.hpp>
#include <string>
#include <unordered_map>
#include <utility>

#include "common/error.h"
#include "vulkan/framework/spirv_words.h"

namespace tandem {

namespace {

// Calls visit(words of the instruction, whether it is within a function) for all in order.
template <class Visit>
void for_each_with_place(std::span<const std::uint32_t> code, Visit visit) {
    constexpr std::uint32_t function = 54, function_end = 56;  // OpFunction, OpFunctionEnd
    bool within = false;
    spirv::for_each_instruction(code, [&](std::span<const std::uint32_t> instruction) {
        if (spirv::opcode_of(instruction) == function) within = true;
        visit(instruction, within);
        if (spirv::opcode_of(instruction) == function_end) within = false;
    });
}

void add_trimming(spvtools::Optimizer& optimizer) {
    optimizer.RegisterPass(spvtools::CreateDeadBranchElimPass())
        .RegisterPass(spvtools::CreateAggressiveDCEPass())
        .RegisterPass(spvtools::CreateCCPPass())  // finds more branches that are never taken
        .RegisterPass(spvtools::CreateDeadBranchElimPass())
        .RegisterPass(spvtools::CreateEliminateDeadFunctionsPass());
}

template <class AddPasses>
std::vector<std::uint32_t> specialised(
    std::span<const std::uint32_t> code, std::span<const SpecialisationConstant> constants, AddPasses add_passes) {
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
        .RegisterPass(spvtools::CreateFoldSpecConstantOpAndCompositePass());
    add_passes(optimizer);
    spvtools::OptimizerOptions options;
    options.set_run_validator(false);  // the build has run it
    std::vector<std::uint32_t> result;
    if (!optimizer.Run(code.data(), code.size(), &result, options))
        throw Error("SPIRV-Tools cannot optimise a shader: " + messages);
    return result;
}

}  // namespace

std::vector<std::uint32_t> trimmed_spirv(
    std::span<const std::uint32_t> code, std::span<const SpecialisationConstant> constants) {
    return specialised(code, constants, add_trimming);
}

std::vector<std::uint32_t> optimised_spirv(
    std::span<const std::uint32_t> code, std::span<const SpecialisationConstant> constants) {
    return specialised(code, constants, [](spvtools::Optimizer& optimizer) {
        add_trimming(optimizer);  // the passes for performance then have less to do
        optimizer.RegisterPerformancePasses();
    });
}

std::uint64_t count_instructions(std::span<const std::uint32_t> code) {
    std::uint64_t count = 0;
    for_each_with_place(code, [&](std::span<const std::uint32_t>, bool within) { count += within ? 1 : 0; });
    return count;
}

std::uint64_t count_bindings(std::span<const std::uint32_t> code) {
    constexpr std::uint32_t decorate = 71, binding = 33, descriptor_set = 34;
    std::map<std::uint32_t, std::pair<std::uint32_t, std::uint32_t>> bound;  // set and binding by variable
    std::set<std::pair<std::uint32_t, std::uint32_t>> used;  // a literal equal to a variable's number counts it as used
    for_each_with_place(code, [&](std::span<const std::uint32_t> words, bool within) {
        if (spirv::opcode_of(words) == decorate && words[2] == descriptor_set) bound[words[1]].first = words[3];
        if (spirv::opcode_of(words) == decorate && words[2] == binding) bound[words[1]].second = words[3];
        if (!within) return;
        for (const std::uint32_t word : words.subspan(1))
            if (bound.contains(word)) used.insert(bound.at(word));
    });
    return used.size();
}

}  // namespace tandem
