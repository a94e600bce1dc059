#include <doctest/doctest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include "common/rounding.h"

using namespace tandem;

TEST_CASE("rounding to single: each component of a vector is a float, the nearest") {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> between(-3.0, 3.0);
    for (int i = 0; i < 100; ++i) {
        const glm::dvec3 exact(between(random), between(random), between(random)), rounded = rounded_to_single(exact);
        for (int axis = 0; axis < 3; ++axis) {
            // A float has 29 bits less after the point.
            CHECK((std::bit_cast<std::uint64_t>(rounded[axis]) & 0x1fffffff) == 0);
            CHECK(std::abs(rounded[axis] - exact[axis]) <= 0x1p-24 * std::abs(exact[axis]));
        }
    }
}
