// Runs single operations on a device, for its self-test. A backend implements it if it computes on a device.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tandem {

// The numbers are those of shaders/kernels/self_test.comp.
enum class Operation : std::uint32_t {
    add = 0,
    subtract = 1,
    multiply = 2,
    divide = 3,
    fma = 4,
    square_root = 5,
    inverse_square_root = 6,
    sine = 7,
    cosine = 8,
    exponential = 9,
    logarithm = 10,
    power = 11,
    arc_tangent = 12,
    minimum = 13,
    maximum = 14,
    less = 15,                  // x < y: 1 or 0
    multiply_add = 16,          // x * y + z, which a compiler may contract to one rounding
    precise_multiply_add = 17,  // the same where it may not
    add_subtract = 18,          // (x + y) - x, which a compiler may simplify to y
    precise_add_subtract = 19,  // the same where it may not
};

// An operation on single-precision x, y and z, as the device reads it.
struct ArithmeticTask {
    std::array<float, 3> arguments{};
    Operation operation = Operation::add;
};
static_assert(sizeof(ArithmeticTask) == 16);

// What the driver says that shaders may ask for (VkPhysicalDeviceFloatControlsProperties), and double precision.
struct FloatControls {
    bool denorm_preserve = false, denorm_flush_to_zero = false;
    bool rounding_to_nearest_even = false, rounding_toward_zero = false;
    bool signed_zero_inf_nan_preserve = false;
    bool float64 = false;
};

class ArithmeticProbe {
public:
    virtual ~ArithmeticProbe() = default;
    // One result a task, bit for bit as the device has it.
    [[nodiscard]] virtual std::vector<float> compute(std::span<const ArithmeticTask> tasks) = 0;
    [[nodiscard]] virtual FloatControls float_controls() const = 0;
};

}  // namespace tandem
