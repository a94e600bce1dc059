// The functions that the self-test measures: arguments to try, exact values, and the error that Vulkan allows. [Vulkan
// 1.3 specification, appendix "Precision and Operation of SPIR-V Instructions"]
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "common/self_test/arithmetic_probe.h"

namespace tandem {

using Arguments = std::array<float, 3>;

struct MeasuredFunction {
    std::string_view name;
    Operation operation;
    std::string_view allowance;             // in words
    std::vector<Arguments> (*arguments)();  // results and arguments are normal numbers, or 0
    // To about 2^-29 of a float's ulp: in double precision, whose own functions are good to one of its ulp.
    double (*exact)(double x, double y, double z);
    // The greatest absolute error allowed beside the exact value.
    double (*allowed)(double x, double y, double z, double exact);
};

[[nodiscard]] std::span<const MeasuredFunction> measured_functions();

// The distance of neighbouring floats around `value`; 2^-149 below the normal range.
[[nodiscard]] double float_ulp(double value);

}  // namespace tandem
