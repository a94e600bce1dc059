// Specialisation constants by name.
#pragma once

#include <bit>
#include <concepts>
#include <cstdint>

#include "vulkan/framework/pipeline.h"

namespace tandem {

enum class ConstantId : std::uint32_t {
#define CONSTANT(name) name,
#include "vulkan/renderer/kernels/constant_ids.def"
#undef CONSTANT
};

// Truth values and enumerators travel as words, floats as their bits.
template <class Value>
[[nodiscard]] SpecialisationConstant constant(ConstantId id, Value value) {
    if constexpr (std::same_as<Value, float>)
        return {static_cast<std::uint32_t>(id), std::bit_cast<std::uint32_t>(value)};
    else
        return {static_cast<std::uint32_t>(id), static_cast<std::uint32_t>(value)};
}

// The constant of triangle `i` of an unrolled loop: the last ids go on from `corners`.
[[nodiscard]] inline SpecialisationConstant corners_constant(std::uint32_t i, std::uint32_t corners) {
    return {static_cast<std::uint32_t>(ConstantId::corners) + i, corners};
}

}  // namespace tandem
