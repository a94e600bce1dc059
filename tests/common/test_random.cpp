// Philox4x32-10 against the known-answer vectors that its authors publish with Random123.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <set>
#include <vector>

#include "common/render/random.h"
#include "tests/chi_square.h"

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

namespace {

// 2^k consecutive points have exactly one in every box of sides 2^-a and 2^-(k - a).
bool is_net(const std::vector<std::array<std::uint32_t, 2>>& points) {
    const auto k = static_cast<unsigned>(std::bit_width(points.size()) - 1);
    for (unsigned a = 0; a <= k; ++a) {
        std::set<std::uint64_t> boxes;
        for (const auto& [x, y] : points)
            boxes.insert((std::uint64_t{x} >> (32 - a)) << 32 | std::uint64_t{y} >> (32 - (k - a)));
        if (boxes.size() != points.size()) return false;
    }
    return true;
}

}  // namespace

TEST_CASE("the first points of Sobol's sequence, unscrambled, are the published ones") {
    // Joe and Kuo's first two dimensions: 0, 1/2, 1/4, 3/4 ... and 0, 1/2, 3/4, 1/4, 5/8, 1/8, 3/8, 7/8.
    const std::array<double, 8> first{0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875},
        second{0, 0.5, 0.75, 0.25, 0.625, 0.125, 0.375, 0.875};
    for (std::uint32_t i = 0; i < 8; ++i) {
        CHECK(sobol::reversed(i) * 0x1p-32 == first[i]);
        CHECK(sobol::reversed(sobol::second_reversed(i)) * 0x1p-32 == second[i]);
    }
}

TEST_CASE("scrambled pairs keep the net of Sobol's sequence, in each block, pixel and seed, and are no copies") {
    std::set<std::uint32_t> firsts;
    for (const std::uint32_t block : {0u, 4u, 5u, 9u, 12u})
        for (const std::uint64_t seed : {1u, 2u})
            for (const std::uint32_t pixel : {0u, 77u}) {
                std::vector<std::array<std::uint32_t, 2>> pair, other;
                for (std::uint64_t sample = 0; sample < 64; ++sample) {
                    const RandomBlock u = random_block(Generator::sobol, seed, pixel, sample, block);
                    const bool inner = block % 4 == 1;
                    pair.push_back(inner ? std::array{u[1], u[2]} : std::array{u[0], u[1]});
                    other.push_back(inner ? std::array{u[0], u[3]} : std::array{u[2], u[3]});
                }
                CHECK(is_net(pair));
                CHECK(is_net(other));
                firsts.insert(pair[0][0]);
                firsts.insert(other[0][0]);
            }
    CHECK(firsts.size() == 2 * 5 * 2 * 2);
}

TEST_CASE("sobol's samples 2^32 apart are scrambled anew, and one scrambling's mean is far closer than chance") {
    // Mean of x y over 256 points, truth 1/4: independent numbers scatter by sqrt(7/144/256) = 0.0138.
    double squares = 0.0, mean = 0.0;
    constexpr int scramblings = 200;
    for (int r = 0; r < scramblings; ++r) {
        double sum = 0.0;
        for (std::uint64_t i = 0; i < 256; ++i) {
            const RandomBlock u = random_block(Generator::sobol, 7, 3, (static_cast<std::uint64_t>(r) << 32) + i, 4);
            sum += to_unit<double>(u[0]) * to_unit<double>(u[1]) / 256.0;
        }
        mean += sum / scramblings;
        squares += (sum - 0.25) * (sum - 0.25) / scramblings;
    }
    CHECK(std::sqrt(squares) < 0.0138 / 10.0);
    CHECK(std::sqrt(squares) > 0.0);  // not the same points again
    CHECK(std::abs(mean - 0.25) < 5.0 * std::sqrt(squares / scramblings) + 1e-7);
}

TEST_CASE("every two numbers of a path are uniform together, with every generator") {
    constexpr std::array<std::uint32_t, 5> blocks{0, 4, 5, 8, 9};
    constexpr std::size_t numbers = 4 * blocks.size(), pairs = numbers * (numbers - 1) / 2;
    constexpr std::uint32_t paths = 1 << 14, cells = 4;  // a side
    for (const Generator generator : {Generator::philox, Generator::hash, Generator::sobol})
        for (const char* of : {"seeds", "pixels", "high words"}) {
            CAPTURE(static_cast<int>(generator));
            CAPTURE(of);
            std::vector<std::vector<double>> seen(pairs, std::vector<double>(cells * cells, 0.0));
            const std::vector<double> expected(cells * cells, paths / double{cells * cells});
            for (std::uint32_t i = 0; i < paths; ++i) {
                // One sample of each scrambling: independent for sobol too.
                const bool by_seed = of[0] == 's', by_pixel = of[0] == 'p';
                const std::uint64_t sample = (by_seed || by_pixel ? 0 : std::uint64_t{i} << 32) + i * 37 % 4096;
                std::array<std::uint32_t, numbers> u{};
                for (std::size_t b = 0; b < blocks.size(); ++b) {
                    const RandomBlock words =
                        random_block(generator, by_seed ? i : 1, by_pixel ? i : 7, sample, blocks[b]);
                    for (std::size_t k = 0; k < 4; ++k) u[4 * b + k] = words[k] >> 30;
                }
                std::size_t pair = 0;
                for (std::size_t a = 0; a < numbers; ++a)
                    for (std::size_t b = 0; b < a; ++b) ++seen[pair++][u[a] * cells + u[b]];
            }
            for (std::size_t pair = 0; pair < pairs; ++pair) {
                CAPTURE(pair);
                CHECK(test::goodness_of_fit(seen[pair], expected).p > 1e-6 / pairs);
            }
        }
}

TEST_CASE("every generator's numbers are uniform, by address and by seed") {
    for (const Generator generator : {Generator::philox, Generator::hash, Generator::sobol})
        for (const bool by_seed : {false, true})
            for (std::size_t k = 0; k < 4; ++k) {
                std::vector<double> seen(256, 0.0), expected(256, 1 << 8);
                for (std::uint32_t i = 0; i < 1u << 16; ++i) {
                    // One number each from neighbouring pixels or seeds: independent for sobol too.
                    const RandomBlock u =
                        by_seed ? random_block(generator, i, 5, 9, 4) : random_block(generator, 1, i, 9, 4);
                    ++seen[u[k] >> 24];
                }
                CHECK(test::goodness_of_fit(seen, expected).p > 1e-6);
            }
}
