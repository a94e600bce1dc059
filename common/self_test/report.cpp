// The self-test as JSON and as text.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/self_test/self_test.h"

namespace tandem {

namespace {

std::string_view name_of(Rounding rounding) {
    return rounding == Rounding::nearest_even  ? "to nearest, ties to even"
           : rounding == Rounding::toward_zero ? "toward zero"
                                               : "neither to nearest nor toward zero";
}
std::string_view name_of(Kept kept) {
    return kept == Kept::kept ? "kept" : kept == Kept::lost ? "lost" : "kept in part";
}
std::string_view flushed(Kept kept) {
    return kept == Kept::kept ? "kept" : kept == Kept::lost ? "flushed to 0" : "flushed in part";
}
std::string_view name_of(OfNan result) {
    return result == OfNan::number ? "the number" : result == OfNan::nan ? "NaN" : "either";
}
std::string_view yes(bool value) { return value ? "yes" : "no"; }

std::string shown(double ulp) {
    return ulp < 100.0 ? fmt::format("{:.2f}", ulp)
           : ulp < 1e6 ? fmt::format("{:.0f}", ulp)
                       : fmt::format("{:.1e}", ulp);
}

nlohmann::json json_of(const Arguments& arguments) { return {arguments[0], arguments[1], arguments[2]}; }

nlohmann::json to_json(const FunctionAccuracy& function) {
    nlohmann::json json{{"function", function.name}, {"allowed", function.allowance}, {"arguments", function.arguments},
        {"worst_ulp", function.worst_ulp}, {"worst_at", json_of(function.worst_arguments)},
        {"correctly_rounded_relative", function.correctly_rounded},
        {"worst_of_allowed_relative", function.worst_share_of_allowance}, {"violations", function.violations}};
    if (function.violations > 0) json["violated_at"] = json_of(function.violating_arguments);
    return json;
}

}  // namespace

nlohmann::json to_json(const SelfTest& test) {
    nlohmann::json functions = nlohmann::json::array();
    for (const FunctionAccuracy& function : test.functions) functions.push_back(to_json(function));
    const FloatControls& controls = test.controls;
    return {{"functions", functions}, {"rounding", name_of(test.rounding)},
        {"subnormal_arguments", flushed(test.subnormal_arguments)},
        {"subnormal_results", flushed(test.subnormal_results)}, {"signed_zero", name_of(test.signed_zero)},
        {"infinity", name_of(test.infinity)}, {"nan", name_of(test.nan)},
        {"minimum_of_number_and_nan", name_of(test.minimum)}, {"maximum_of_number_and_nan", name_of(test.maximum)},
        {"nan_compares_less", test.nan_compares}, {"fma_rounds_once", test.fma_rounds_once},
        {"contracts", test.contracts}, {"contracts_precise", test.contracts_precise}, {"simplifies", test.simplifies},
        {"simplifies_precise", test.simplifies_precise},
        {"float_controls", {{"denorm_preserve_float32", controls.denorm_preserve},
                               {"denorm_flush_to_zero_float32", controls.denorm_flush_to_zero},
                               {"rounding_mode_rte_float32", controls.rounding_to_nearest_even},
                               {"rounding_mode_rtz_float32", controls.rounding_toward_zero},
                               {"signed_zero_inf_nan_preserve_float32", controls.signed_zero_inf_nan_preserve}}},
        {"float64", controls.float64}, {"failures", test.failures}, {"passed", test.passed()}};
}

nlohmann::json to_json(const std::vector<DeviceSelfTest>& tests) {
    nlohmann::json list = nlohmann::json::array();
    for (const DeviceSelfTest& test : tests) {
        list.push_back(to_json(test.result));
        list.back()["device"] = test.device;
        list.back()["driver"] = test.driver;
    }
    return list;
}

std::string in_short(const SelfTest& test) {
    std::string line =
        test.passed() ? "within Vulkan's precision" : "FAILED: " + fmt::format("{}", fmt::join(test.failures, "; "));
    line += "; worst ulp:";
    for (const FunctionAccuracy& function : test.functions)
        line += fmt::format(
            " {} {}{}", function.name, shown(function.worst_ulp), &function == &test.functions.back() ? "" : ",");
    return line + fmt::format("; rounds {}; subnormal arguments {}, results {}; precise is {}", name_of(test.rounding),
                      flushed(test.subnormal_arguments), flushed(test.subnormal_results),
                      test.contracts_precise || test.simplifies_precise ? "NOT kept" : "kept");
}

std::string in_full(const SelfTest& test) {
    std::string text = fmt::format(
        "{:<12} {:>10} {:>10} {:>11}  {}\n", "function", "worst ulp", "of allowed", "nearest", "Vulkan allows");
    for (const FunctionAccuracy& function : test.functions)
        text += fmt::format("{:<12} {:>10} {:>8.1f} % {:>9.2f} %  {}{}\n", function.name, shown(function.worst_ulp),
            100.0 * function.worst_share_of_allowance, 100.0 * function.correctly_rounded, function.allowance,
            function.violations > 0 ? "  EXCEEDED" : "");
    const FloatControls& controls = test.controls;
    text += fmt::format("+, -, * round {}; fma rounds once: {}\n", name_of(test.rounding), yes(test.fma_rounds_once));
    text += fmt::format(
        "subnormal arguments {}, results {}\n", flushed(test.subnormal_arguments), flushed(test.subnormal_results));
    text += fmt::format("sign of zero {}, infinity {}, NaN {}; NaN < 1 or 1 < NaN: {}\n", name_of(test.signed_zero),
        name_of(test.infinity), name_of(test.nan), yes(test.nan_compares));
    text += fmt::format("min of a number and NaN is {}, max {}\n", name_of(test.minimum), name_of(test.maximum));
    text += fmt::format(
        "x * y + z contracted: {}, declared precise: {}\n", yes(test.contracts), yes(test.contracts_precise));
    text += fmt::format(
        "(x + y) - x simplified: {}, declared precise: {}\n", yes(test.simplifies), yes(test.simplifies_precise));
    text += fmt::format(
        "shaders may ask for: subnormals kept {}, flushed {}; rounding to nearest {}, toward zero {}; signed zero, "
        "infinity and NaN kept {}; float64 {}\n",
        yes(controls.denorm_preserve), yes(controls.denorm_flush_to_zero), yes(controls.rounding_to_nearest_even),
        yes(controls.rounding_toward_zero), yes(controls.signed_zero_inf_nan_preserve), yes(controls.float64));
    for (const std::string& failure : test.failures) text += "FAILED: " + failure + "\n";
    if (test.passed()) text += "passed: nothing beyond what Vulkan allows\n";
    return text;
}

}  // namespace tandem
