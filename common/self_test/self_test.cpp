#include "common/self_test/self_test.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace tandem {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();

// By bits, since the host may flush subnormal numbers or be told that there is no NaN.
std::uint32_t bits(float value) { return std::bit_cast<std::uint32_t>(value); }
bool is_nan(float value) { return (bits(value) & 0x7FFFFFFFu) > 0x7F800000u; }
bool is_finite(float value) { return (bits(value) & 0x7F800000u) != 0x7F800000u; }

std::vector<ArithmeticTask> tasks_of(Operation operation, const std::vector<Arguments>& list) {
    std::vector<ArithmeticTask> tasks;
    for (const Arguments& arguments : list) tasks.push_back({arguments, operation});
    return tasks;
}

FunctionAccuracy measure(ArithmeticProbe& probe, const MeasuredFunction& function) {
    const std::vector<Arguments> list = function.arguments();
    const std::vector<float> results = probe.compute(tasks_of(function.operation, list));
    FunctionAccuracy accuracy{.name = function.name, .allowance = function.allowance};
    accuracy.arguments = static_cast<std::uint32_t>(list.size());
    std::uint32_t nearest = 0;
    for (std::size_t i = 0; i < list.size(); ++i) {
        const double x = list[i][0], y = list[i][1], z = list[i][2];
        const double exact = function.exact(x, y, z), allowed = function.allowed(x, y, z, exact);
        const double error = is_finite(results[i]) ? std::abs(static_cast<double>(results[i]) - exact)
                                                   : std::numeric_limits<double>::infinity();
        if (results[i] == static_cast<float>(exact)) ++nearest;
        if (!(error <= allowed)) {
            if (accuracy.violations++ == 0) {
                accuracy.violating_arguments = list[i];
                accuracy.violating_result = results[i];
            }
        }
        if (!std::isfinite(error)) continue;
        if (allowed > 0.0)
            accuracy.worst_share_of_allowance = std::max(accuracy.worst_share_of_allowance, error / allowed);
        if (const double ulp = error / float_ulp(exact); ulp > accuracy.worst_ulp) {
            accuracy.worst_ulp = ulp;
            accuracy.worst_arguments = list[i];
        }
    }
    accuracy.correctly_rounded = static_cast<double>(nearest) / static_cast<double>(list.size());
    return accuracy;
}

// A single case: what is computed, and its bits if all goes by IEEE 754.
struct Case {
    ArithmeticTask task;
    float expected;
};

std::vector<float> results_of(ArithmeticProbe& probe, const std::vector<Case>& cases) {
    std::vector<ArithmeticTask> tasks;
    for (const Case& c : cases) tasks.push_back(c.task);
    return probe.compute(tasks);
}

std::size_t count_equal(const std::vector<Case>& cases, const std::vector<float>& results) {
    std::size_t equal = 0;
    for (std::size_t i = 0; i < cases.size(); ++i)
        equal += bits(results[i]) == bits(cases[i].expected) || (is_nan(results[i]) && is_nan(cases[i].expected));
    return equal;
}

// All as expected, none, or some.
Kept kept(ArithmeticProbe& probe, const std::vector<Case>& cases) {
    const std::size_t equal = count_equal(cases, results_of(probe, cases));
    return equal == cases.size() ? Kept::kept : equal == 0 ? Kept::lost : Kept::mixed;
}

OfNan of_nan(ArithmeticProbe& probe, Operation operation) {
    const std::vector<float> results =
        results_of(probe, {{{{1.0F, nan, 0}, operation}, 0}, {{{nan, 1.0F, 0}, operation}, 0}});
    if (std::ranges::all_of(results, is_nan)) return OfNan::nan;
    return std::ranges::all_of(results, [](float r) { return r == 1.0F; }) ? OfNan::number : OfNan::mixed;
}

// Halfway cases and others of both signs, in which rounding to even, toward zero, up and down all differ somewhere.
Rounding rounding(ArithmeticProbe& probe) {
    constexpr float e = 0x1p-23F;
    const std::vector<Case> nearest{{{{1, 0.5F * e, 0}, Operation::add}, 1},
        {{{1 + e, 0.5F * e, 0}, Operation::add}, 1 + 2 * e}, {{{1, 0.75F * e, 0}, Operation::add}, 1 + e},
        {{{-1, 0.75F * e, 0}, Operation::subtract}, -1 - e}, {{{-1 - e, 0.5F * e, 0}, Operation::subtract}, -1 - 2 * e},
        {{{1 + e, 1.5F, 0}, Operation::multiply}, 1.5F + 2 * e},
        {{{1 + e, -1.5F, 0}, Operation::multiply}, -1.5F - 2 * e}};
    std::vector<Case> zero = nearest;
    const float truncated[] = {1, 1 + e, 1, -1, -1 - e, 1.5F + e, -1.5F - e};
    for (std::size_t i = 0; i < zero.size(); ++i) zero[i].expected = truncated[i];
    const std::vector<float> results = results_of(probe, nearest);
    if (count_equal(nearest, results) == nearest.size()) return Rounding::nearest_even;
    return count_equal(zero, results) == zero.size() ? Rounding::toward_zero : Rounding::other;
}

// Whether x² − (x² rounded), x = 1 + 2^-k, comes out as the 2^-2k that only one rounding leaves. For k > 11 the bit is
// lost to rounding to nearest (a tie to even at k = 12) and toward zero alike.
bool fuses(ArithmeticProbe& probe, Operation operation) {
    std::vector<Case> cases;
    for (int k = 12; k <= 20; ++k) {
        const float x = 1.0F + std::ldexp(1.0F, -k);
        cases.push_back({{{x, x, -1.0F - std::ldexp(1.0F, 1 - k)}, operation}, 0.0F});
    }
    return count_equal(cases, results_of(probe, cases)) != cases.size();
}

// Whether (x + y) − x, with y below the last bit of x, gives back anything: by IEEE 754 it is 0.
bool simplifies(ArithmeticProbe& probe, Operation operation) {
    std::vector<Case> cases;
    for (int k = 26; k <= 60; k += 2) cases.push_back({{{std::ldexp(1.0F, k), 1.0F, 0.0F}, operation}, 0.0F});
    return count_equal(cases, results_of(probe, cases)) != cases.size();
}

void treat_special_values(ArithmeticProbe& probe, SelfTest& test) {
    const float tiny = std::bit_cast<float>(0x00012345u), least_normal = std::numeric_limits<float>::min();
    const auto subnormal = [](std::uint32_t fraction) { return std::bit_cast<float>(fraction); };
    // 2^k times a subnormal number is normal; what makes one is exact.
    test.subnormal_arguments = kept(probe, {{{{tiny, 0x1p40F, 0}, Operation::multiply}, 0x12345p-109F},
                                               {{{-tiny, 0x1p60F, 0}, Operation::multiply}, -0x12345p-89F},
                                               {{{least_normal, tiny, 0}, Operation::add}, subnormal(0x00812345u)}});
    test.subnormal_results =
        kept(probe, {{{{least_normal, 0.5F, 0}, Operation::multiply}, subnormal(0x00400000u)},
                        {{{0x1p-100F, 0x1p-40F, 0}, Operation::multiply}, subnormal(1u << 9)},
                        {{{least_normal, 1.5F * least_normal, 0}, Operation::subtract}, subnormal(0x80400000u)}});
    test.signed_zero =
        kept(probe, {{{{-0.0F, 1, 0}, Operation::multiply}, -0.0F}, {{{-0.0F, -0.0F, 0}, Operation::add}, -0.0F},
                        {{{-0.0F, 3, 0}, Operation::divide}, -0.0F}, {{{1, -0.0F, 0}, Operation::divide}, -infinity}});
    test.infinity = kept(
        probe, {{{{3e38F, 3e38F, 0}, Operation::multiply}, infinity}, {{{1, 0, 0}, Operation::divide}, infinity},
                   {{{infinity, -1, 0}, Operation::add}, infinity},
                   {{{-infinity, 2, 0}, Operation::multiply}, -infinity}, {{{1, infinity, 0}, Operation::less}, 1.0F}});
    test.nan = kept(probe, {{{{nan, 1, 0}, Operation::add}, nan}, {{{infinity, infinity, 0}, Operation::subtract}, nan},
                               {{{0, 0, 0}, Operation::divide}, nan}, {{{-1, 0, 0}, Operation::square_root}, nan},
                               {{{0, infinity, 0}, Operation::multiply}, nan}});
    test.minimum = of_nan(probe, Operation::minimum);
    test.maximum = of_nan(probe, Operation::maximum);
    const std::vector<Case> unordered{{{{nan, 1, 0}, Operation::less}, 0}, {{{1, nan, 0}, Operation::less}, 0}};
    test.nan_compares = count_equal(unordered, results_of(probe, unordered)) != unordered.size();
}

void judge(SelfTest& test) {
    const auto fail_if = [&](bool failed, const char* line) {
        if (failed) test.failures.push_back(fmt::format("{}", line));
    };
    for (const FunctionAccuracy& function : test.functions)
        if (function.violations > 0)
            test.failures.push_back(fmt::format(
                "{} exceeds Vulkan's precision ({}) at {} of {} arguments: ({}, {}, {}) gives {}", function.name,
                function.allowance, function.violations, function.arguments, function.violating_arguments[0],
                function.violating_arguments[1], function.violating_arguments[2], function.violating_result));
    fail_if(test.rounding == Rounding::other, "sums and products round neither to nearest nor toward zero");
    fail_if(test.contracts_precise, "x * y + z is contracted where it is declared precise");
    fail_if(test.simplifies_precise, "(x + y) - x is simplified where it is declared precise");
}

}  // namespace

SelfTest run_self_test(ArithmeticProbe& probe) {
    SelfTest test;
    for (const MeasuredFunction& function : measured_functions()) test.functions.push_back(measure(probe, function));
    test.rounding = rounding(probe);
    treat_special_values(probe, test);
    test.fma_rounds_once = fuses(probe, Operation::fma);
    test.contracts = fuses(probe, Operation::multiply_add);
    test.contracts_precise = fuses(probe, Operation::precise_multiply_add);
    test.simplifies = simplifies(probe, Operation::add_subtract);
    test.simplifies_precise = simplifies(probe, Operation::precise_add_subtract);
    test.controls = probe.float_controls();
    judge(test);
    return test;
}

std::optional<DeviceSelfTest> self_test_of(Renderer& renderer) {
    const std::unique_ptr<ArithmeticProbe> arithmetic = renderer.arithmetic();
    if (!arithmetic) return std::nullopt;
    const RendererInfo info = renderer.info();
    return DeviceSelfTest{info.device, info.driver, run_self_test(*arithmetic)};
}

}  // namespace tandem
