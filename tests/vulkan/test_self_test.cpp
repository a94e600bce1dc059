// The self-test on the device of this machine, and the evidence that it measures the device and not the host.
#include <doctest/doctest.h>

#include <cmath>

#include "common/self_test/self_test.h"
#include "tests/vulkan/scenes.h"

using namespace tandem;
using namespace tandem::testing;

TEST_CASE("this device computes within Vulkan's precision, and keeps what is precise") {
    const auto arithmetic = default_renderer().arithmetic();
    REQUIRE(arithmetic != nullptr);
    const SelfTest test = run_self_test(*arithmetic);
    CHECK(test.failures == std::vector<std::string>{});
    CHECK(!test.contracts_precise);
    CHECK(!test.simplifies_precise);
    for (const FunctionAccuracy& function : test.functions) {
        CAPTURE(function.name);
        CHECK(function.worst_ulp >= 0.45);
        CHECK(function.correctly_rounded > 0.0);
    }
}

TEST_CASE("each operation of the self-test's shader is the one that its number names") {
    const auto arithmetic = default_renderer().arithmetic();
    const auto of = [&](Operation operation, float x, float y, float z) {
        return static_cast<double>(arithmetic->compute(std::array{ArithmeticTask{{x, y, z}, operation}}).at(0));
    };
    CHECK(of(Operation::add, 3, 2, 9) == 5);
    CHECK(of(Operation::subtract, 3, 2, 9) == 1);
    CHECK(of(Operation::multiply, 3, 2, 9) == 6);
    CHECK(of(Operation::divide, 3, 2, 9) == 1.5);
    CHECK(of(Operation::fma, 3, 2, 9) == 15);
    CHECK(of(Operation::minimum, 3, 2, 9) == 2);
    CHECK(of(Operation::maximum, 3, 2, 9) == 3);
    CHECK(of(Operation::less, 3, 2, 9) == 0);
    CHECK(of(Operation::less, 2, 3, 9) == 1);
    CHECK(of(Operation::multiply_add, 3, 2, 9) == 15);
    CHECK(of(Operation::precise_multiply_add, 3, 2, 9) == 15);
    CHECK(of(Operation::add_subtract, 3, 2, 9) == 2);
    CHECK(of(Operation::precise_add_subtract, 3, 2, 9) == 2);
    CHECK(of(Operation::square_root, 16, 2, 9) == 4);
    const auto near = [](double value) { return doctest::Approx(value).epsilon(1e-3); };
    CHECK(of(Operation::inverse_square_root, 16, 2, 9) == near(0.25));
    CHECK(of(Operation::sine, 0.5F, 2, 9) == near(std::sin(0.5)));
    CHECK(of(Operation::cosine, 0.5F, 2, 9) == near(std::cos(0.5)));
    CHECK(of(Operation::exponential, 0.5F, 2, 9) == near(std::exp(0.5)));
    CHECK(of(Operation::logarithm, 3, 2, 9) == near(std::log(3.0)));
    CHECK(of(Operation::power, 3, 2.5F, 9) == near(std::pow(3.0, 2.5)));
    CHECK(of(Operation::arc_tangent, 3, 2, 9) == near(std::atan(3.0)));
}
