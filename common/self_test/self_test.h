// The self-test of a device's arithmetic: how exact it is compared with what Vulkan demands, and what it does in cases
// that Vulkan leaves open. Numerical stability depends on it, so every report states it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/render/renderer.h"
#include "common/self_test/functions.h"

namespace tandem {

struct FunctionAccuracy {
    std::string_view name, allowance;
    std::uint32_t arguments = 0;            // tried
    double worst_ulp = 0.0;                 // of the exact value's float
    Arguments worst_arguments{};            // where
    double correctly_rounded = 0.0;         // the part of the results that are the nearest float
    double worst_share_of_allowance = 0.0;  // error over allowed error, where the latter is not 0
    std::uint32_t violations = 0;           // beyond the allowance, or not finite
    Arguments violating_arguments{};        // the first
    float violating_result = 0.0F;
};

enum class Kept { kept, lost, mixed };
enum class Rounding { nearest_even, toward_zero, other };
enum class OfNan { number, nan, mixed };

struct SelfTest {
    std::vector<FunctionAccuracy> functions;
    Rounding rounding = Rounding::other;  // of +, - and *
    Kept subnormal_arguments = Kept::kept, subnormal_results = Kept::kept;
    Kept signed_zero = Kept::kept, infinity = Kept::kept, nan = Kept::kept;
    OfNan minimum = OfNan::number, maximum = OfNan::number;  // of a number and NaN
    bool nan_compares = false;                               // NaN < 1 or 1 < NaN holds
    bool fma_rounds_once = false;
    bool contracts = false, contracts_precise = false;    // x * y + z to one rounding
    bool simplifies = false, simplifies_precise = false;  // (x + y) - x to y
    FloatControls controls;

    std::vector<std::string> failures;  // what Vulkan does not allow, a line each
    [[nodiscard]] bool passed() const { return failures.empty(); }
};

[[nodiscard]] SelfTest run_self_test(ArithmeticProbe& probe);

// Whose it is, for reports.
struct DeviceSelfTest {
    std::string device, driver;
    SelfTest result;
};
// Empty where the renderer's arithmetic is this program's own.
[[nodiscard]] std::optional<DeviceSelfTest> self_test_of(Renderer& renderer);

[[nodiscard]] nlohmann::json to_json(const SelfTest& test);
[[nodiscard]] nlohmann::json to_json(const std::vector<DeviceSelfTest>& tests);  // with "device" and "driver" in each
[[nodiscard]] std::string in_short(const SelfTest& test);                        // one line
[[nodiscard]] std::string in_full(const SelfTest& test);  // a table, and a line for each open case

}  // namespace tandem
