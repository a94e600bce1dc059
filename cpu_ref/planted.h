// Tells whether a planted bug (common/render/planted_bugs.h) is on. In release builds the answer is a constant, so they
// contain no code of planted bugs.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/render/planted_bugs.h"

namespace tandem::cpu {

#ifdef TANDEM_PLANTED_BUGS

// The one fault of all path tracers of this process, set before a job is made and kept while it lives.
inline PlantedFault planted_fault;

[[nodiscard]] inline bool planted(PlantedBug bug) { return planted_fault.bug == bug; }
[[nodiscard]] inline double planted_amount() { return planted_fault.amount; }

#else

[[nodiscard]] constexpr bool planted(PlantedBug /*bug*/) { return false; }
[[nodiscard]] constexpr double planted_amount() { return 0.0; }

#endif

// In half precision.
[[nodiscard]] inline double in_half(double value) {
    const int exponent = std::max(std::ilogb(value), -14);
    return value > 0.0 && std::isfinite(value)
               ? std::ldexp(std::nearbyint(std::ldexp(value, 10 - exponent)), exponent - 10)
               : value;
}

// 1 / value with 12 bits after the first.
[[nodiscard]] inline double short_reciprocal(double value) {
    return static_cast<double>(
        std::bit_cast<float>(std::bit_cast<std::uint32_t>(static_cast<float>(1.0 / value)) & 0xFFFFF800u));
}

// 1, or with the bug planted 1 plus its amount.
[[nodiscard]] inline double planted_scale(PlantedBug bug) { return planted(bug) ? 1.0 + planted_amount() : 1.0; }

// The factor of a shadow ray's way.
[[nodiscard]] inline double planted_reach() {
    return planted_scale(PlantedBug::shadow_limit_long) * (2.0 - planted_scale(PlantedBug::shadow_limit_short));
}

}  // namespace tandem::cpu
