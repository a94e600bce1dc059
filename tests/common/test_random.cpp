// Philox4x32-10 against the known-answer vectors that its authors publish with Random123.
#include <doctest/doctest.h>

#include "common/random.h"

using namespace tandem;

TEST_CASE("Philox4x32-10 gives the published known answers") {
    CHECK(philox4x32_10({0, 0, 0, 0}, {0, 0}) == RandomBlock{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
    constexpr std::uint32_t ones = 0xffffffff;
    CHECK(philox4x32_10({ones, ones, ones, ones}, {ones, ones}) ==
          RandomBlock{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
    CHECK(philox4x32_10({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
          RandomBlock{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
}

TEST_CASE("unit numbers reach 0 and 1 - 2^-24 but never 1") {
    CHECK(to_unit<float>(0) == 0.0f);
    CHECK(to_unit<float>(0xffffffff) == 1.0f - 0x1p-24f);
    CHECK(to_unit<double>(0xffffffff) == 1.0 - 0x1p-24);
}

TEST_CASE("a block of numbers depends on every part of its address") {
    const RandomBlock base = random_block(1, 2, 3, 4);
    CHECK(base == random_block(1, 2, 3, 4));
    CHECK(base != random_block(2, 2, 3, 4));
    CHECK(base != random_block(std::uint64_t{1} << 32 | 1, 2, 3, 4));
    CHECK(base != random_block(1, 3, 3, 4));
    CHECK(base != random_block(1, 2, 4, 4));
    CHECK(base != random_block(1, 2, std::uint64_t{1} << 32 | 3, 4));
    CHECK(base != random_block(1, 2, 3, 5));
}
