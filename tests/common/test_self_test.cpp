// The self-test of a device's arithmetic, on devices that are made up: sound ones pass, and each fault is named.
#include <doctest/doctest.h>

#include <bit>
#include <cfenv>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/self_test/self_test.h"

using namespace tandem;

namespace {

// Computes as IEEE 754 has it, but for what a test changes.
class MadeUpDevice : public ArithmeticProbe {
public:
    std::function<float(Operation, Arguments, float)> change = [](Operation, Arguments, float exact) { return exact; };
    FloatControls controls{.denorm_preserve = true, .float64 = true};

    std::vector<float> compute(std::span<const ArithmeticTask> tasks) override {
        std::vector<float> results;
        for (const ArithmeticTask& task : tasks)
            results.push_back(change(task.operation, task.arguments, computed(task)));
        return results;
    }
    [[nodiscard]] FloatControls float_controls() const override { return controls; }

private:
    static float computed(const ArithmeticTask& task) {
        const auto [x, y, z] = task.arguments;
        const volatile float sum = x + y, product = x * y;  // a rounding each
        switch (task.operation) {
            case Operation::add:
                return sum;
            case Operation::subtract:
                return x - y;
            case Operation::multiply:
                return product;
            case Operation::divide:
                return x / y;
            case Operation::fma:
                return std::fma(x, y, z);
            case Operation::square_root:
                return std::sqrt(x);
            case Operation::inverse_square_root:
                return static_cast<float>(1.0 / std::sqrt(static_cast<double>(x)));
            case Operation::sine:
                return static_cast<float>(std::sin(static_cast<double>(x)));
            case Operation::cosine:
                return static_cast<float>(std::cos(static_cast<double>(x)));
            case Operation::exponential:
                return static_cast<float>(std::exp(static_cast<double>(x)));
            case Operation::logarithm:
                return static_cast<float>(std::log(static_cast<double>(x)));
            case Operation::power:
                return static_cast<float>(std::pow(static_cast<double>(x), static_cast<double>(y)));
            case Operation::arc_tangent:
                return static_cast<float>(std::atan(static_cast<double>(x)));
            case Operation::minimum:
                return std::fmin(x, y);
            case Operation::maximum:
                return std::fmax(x, y);
            case Operation::less:
                return x < y ? 1.0F : 0.0F;
            case Operation::multiply_add:
            case Operation::precise_multiply_add:
                return product + z;
            case Operation::add_subtract:
            case Operation::precise_add_subtract:
                return sum - x;
        }
        return 0.0F;
    }
};

SelfTest test_of(const std::function<float(Operation, Arguments, float)>& change) {
    MadeUpDevice device;
    device.change = change;
    return run_self_test(device);
}

const FunctionAccuracy& accuracy_of(const SelfTest& test, std::string_view name) {
    for (const FunctionAccuracy& function : test.functions)
        if (function.name == name) return function;
    throw std::out_of_range(std::string(name));
}

float moved(float value, int ulps) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(std::bit_cast<std::int32_t>(value) + ulps));
}

bool is_subnormal(float value) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(value) & 0x7FFFFFFFu;
    return bits != 0 && bits < 0x00800000u;
}

}  // namespace

TEST_CASE("a device of IEEE 754 passes, with half an ulp everywhere") {
    MadeUpDevice device;
    const SelfTest test = run_self_test(device);
    CHECK(test.failures == std::vector<std::string>{});
    CHECK(test.functions.size() == 13);
    for (const FunctionAccuracy& function : test.functions) {
        CAPTURE(function.name);
        CHECK(function.arguments > 1000);
        CHECK(function.worst_ulp > 0.45);  // the arguments do reach the worst
        CHECK(function.worst_ulp <= 0.5000001);
        CHECK(function.correctly_rounded == doctest::Approx(1.0));
        CHECK(function.worst_share_of_allowance <= 0.500001);
    }
    CHECK(test.rounding == Rounding::nearest_even);
    for (const Kept kept :
        {test.subnormal_arguments, test.subnormal_results, test.signed_zero, test.infinity, test.nan})
        CHECK(kept == Kept::kept);
    CHECK(test.minimum == OfNan::number);
    CHECK(test.maximum == OfNan::number);
    CHECK(test.fma_rounds_once);
    for (const bool wrong :
        {test.nan_compares, test.contracts, test.contracts_precise, test.simplifies, test.simplifies_precise})
        CHECK(!wrong);
    const nlohmann::json json = to_json(test);
    CHECK(json.at("passed") == true);
    CHECK(json.at("float64") == true);
    CHECK(json.at("float_controls").at("denorm_preserve_float32") == true);
    CHECK(json.at("functions").at(3).at("function") == "x / y");
    CHECK(in_full(test).find("passed") != std::string::npos);
    CHECK(in_short(test).starts_with("within Vulkan's precision; worst ulp: x + y 0.50, "));
}

TEST_CASE("errors within Vulkan's precision pass and are measured, errors beyond fail and are named") {
    const struct {
        Operation operation;
        std::string_view name;
        int sound, faulty;  // ulp
    } cases[] = {{Operation::divide, "x / y", 2, 4}, {Operation::inverse_square_root, "inversesqrt", 1, 3},
        {Operation::exponential, "exp", 1, 400}, {Operation::arc_tangent, "atan", 2000, 4200},
        {Operation::square_root, "sqrt", 3, 9}, {Operation::add, "x + y", 0, 1}};
    for (const auto& c : cases) {
        CAPTURE(c.name);
        const auto by = [&](int ulps) {
            return test_of([&, ulps](Operation operation, Arguments, float exact) {
                return operation == c.operation && std::isnormal(exact) ? moved(exact, ulps) : exact;
            });
        };
        const SelfTest sound = by(c.sound), faulty = by(c.faulty);
        CHECK(sound.passed());
        // Beyond a power of two the float's steps are twice the exact value's ulp.
        CHECK(accuracy_of(sound, c.name).worst_ulp >= c.sound);
        CHECK(accuracy_of(sound, c.name).worst_ulp <= 2 * c.sound + 0.5000001);
        REQUIRE(!faulty.passed());
        CHECK(faulty.failures.front().starts_with(std::string(c.name) + " exceeds Vulkan's precision ("));
        CHECK(in_short(faulty).starts_with("FAILED: "));
        CHECK(to_json(faulty).at("passed") == false);
    }
    const SelfTest sine = test_of([](Operation operation, Arguments, float exact) {
        return operation == Operation::sine ? exact + 0x1.1p-11F : exact;
    });
    REQUIRE(sine.failures.size() == 1);
    CHECK(sine.failures.front().starts_with("sin exceeds Vulkan's precision (2^-11 within pi) at 8192 of 8192"));
    const SelfTest nan = test_of([](Operation operation, Arguments a, float exact) {
        return operation == Operation::logarithm && a[0] > 0x1p110F ? std::numeric_limits<float>::quiet_NaN() : exact;
    });
    REQUIRE(nan.failures.size() == 1);
    CHECK(nan.failures.front().starts_with("log exceeds"));
}

TEST_CASE("rounding toward zero is legal and told, rounding away is not") {
    const auto directed = [](bool toward_zero) {
        return test_of([toward_zero](Operation operation, Arguments a, float exact) {
            if (operation > Operation::multiply) return exact;
            const double x = a[0], y = a[1];
            const double precise = operation == Operation::add        ? x + y
                                   : operation == Operation::subtract ? x - y
                                                                      : x * y;
            const double error = std::abs(static_cast<double>(exact)) - std::abs(precise);
            if (error == 0.0 || !std::isfinite(exact) || is_subnormal(exact) || exact == 0.0F) return exact;
            if (toward_zero) return error > 0.0 ? moved(exact, -1) : exact;
            return error < 0.0 ? moved(exact, 1) : exact;
        });
    };
    const SelfTest zero = directed(true);
    CHECK(zero.rounding == Rounding::toward_zero);
    CHECK(zero.passed());
    CHECK(accuracy_of(zero, "x + y").worst_ulp > 0.9);
    const SelfTest away = directed(false);
    CHECK(away.rounding == Rounding::other);
    CHECK(away.failures.size() == 1);
}

TEST_CASE("flushed subnormal numbers, lost signs and NaN are told and are no fault") {
    const SelfTest flushing = test_of([](Operation operation, Arguments a, float exact) {
        const auto [x, y, z] = a;
        if (operation == Operation::multiply && (is_subnormal(x) || is_subnormal(y))) return exact < 0 ? -0.0F : 0.0F;
        if (operation == Operation::add && is_subnormal(y)) return x;
        return is_subnormal(exact) ? 0.0F : exact;
    });
    CHECK(flushing.passed());
    CHECK(flushing.subnormal_arguments == Kept::lost);
    CHECK(flushing.subnormal_results == Kept::lost);
    CHECK(to_json(flushing).at("subnormal_results") == "flushed to 0");
    const SelfTest unsigned_zero = test_of([](Operation operation, Arguments a, float exact) {
        if (operation == Operation::divide && a[1] == 0.0F) return std::abs(exact);
        return exact == 0.0F ? 0.0F : exact;
    });
    CHECK(unsigned_zero.passed());
    CHECK(unsigned_zero.signed_zero == Kept::lost);
    const SelfTest spreading = test_of([](Operation operation, Arguments a, float exact) {
        return operation == Operation::minimum && (std::isnan(a[0]) || std::isnan(a[1])) ? a[0] + a[1] : exact;
    });
    CHECK(spreading.minimum == OfNan::nan);
    CHECK(spreading.maximum == OfNan::number);
    CHECK(spreading.passed());
}

TEST_CASE("contraction is legal, but not of what is precise") {
    const auto contracting = [](Operation which) {
        return test_of([which](Operation operation, Arguments a, float exact) {
            return operation == which ? std::fma(a[0], a[1], a[2]) : exact;
        });
    };
    CHECK(contracting(Operation::multiply_add).contracts);
    CHECK(contracting(Operation::multiply_add).passed());
    const SelfTest precise = contracting(Operation::precise_multiply_add);
    CHECK(precise.contracts_precise);
    REQUIRE(precise.failures.size() == 1);
    CHECK(precise.failures.front() == "x * y + z is contracted where it is declared precise");
    const auto simplifying = [](Operation which) {
        return test_of(
            [which](Operation operation, Arguments a, float exact) { return operation == which ? a[1] : exact; });
    };
    CHECK(simplifying(Operation::add_subtract).simplifies);
    CHECK(simplifying(Operation::add_subtract).passed());
    REQUIRE(simplifying(Operation::precise_add_subtract).failures.size() == 1);
    const SelfTest twice = test_of([](Operation operation, Arguments a, float exact) {
        const volatile float product = a[0] * a[1];
        return operation == Operation::fma ? product + a[2] : exact;
    });
    CHECK(!twice.fma_rounds_once);
    CHECK(twice.passed());
}

TEST_CASE("a float's ulp") {
    CHECK(float_ulp(1.0) == 0x1p-23);
    CHECK(float_ulp(-1.999999) == 0x1p-23);
    CHECK(float_ulp(0.999999999) == 0x1p-24);
    CHECK(float_ulp(0x1p100) == 0x1p77);
    CHECK(float_ulp(0x1p-126) == 0x1p-149);
    CHECK(float_ulp(0x1p-140) == 0x1p-149);
    CHECK(float_ulp(0.0) == 0x1p-149);
}
