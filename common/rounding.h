// Numbers that single precision holds, kept in double.
#pragma once

#include <glm/vec3.hpp>

namespace tandem {

// To the nearest float, ties to even; infinite beyond the floats' range.
[[nodiscard]] inline double rounded_to_single(double x) {
    // Volatile, since GCC 12 vectorises two such conversions in a row, to float and back. It then drops both, as if
    // they changed nothing. tests/common/test_rounding.cpp shows it.
    volatile float rounded = static_cast<float>(x);
    return static_cast<double>(rounded);
}
[[nodiscard]] inline glm::dvec3 rounded_to_single(const glm::dvec3& v) {
    return {rounded_to_single(v.x), rounded_to_single(v.y), rounded_to_single(v.z)};
}

}  // namespace tandem
