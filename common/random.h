// Counter-based random numbers (MODEL.md section 3): Philox4x32-10 of Salmon, Moraes, Dror, Shaw, "Parallel random
// numbers: as easy as 1, 2, 3", SC 2011. Stateless: any sample of any pixel can be re-run alone, in any order.
// This integer generator and its known-answer vectors are the only transport arithmetic that the host backends share.
#pragma once

#include <array>
#include <cstdint>

namespace tandem {

using RandomBlock = std::array<std::uint32_t, 4>;

// Ten Philox rounds of `counter` under `key`.
[[nodiscard]] constexpr RandomBlock philox4x32_10(RandomBlock counter, std::array<std::uint32_t, 2> key) {
    constexpr std::uint64_t multiplier0 = 0xD2511F53u, multiplier1 = 0xCD9E8D57u;  // the paper's table 2
    constexpr std::uint32_t weyl0 = 0x9E3779B9u, weyl1 = 0xBB67AE85u;              // golden ratio, sqrt(3) - 1
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t product0 = multiplier0 * counter[0], product1 = multiplier1 * counter[2];
        counter = {static_cast<std::uint32_t>(product1 >> 32) ^ counter[1] ^ key[0],
            static_cast<std::uint32_t>(product1), static_cast<std::uint32_t>(product0 >> 32) ^ counter[3] ^ key[1],
            static_cast<std::uint32_t>(product0)};
        key[0] += weyl0;
        key[1] += weyl1;
    }
    return counter;
}

// The four numbers of dimension block `block` for one sample of one pixel (MODEL.md section 3 has the table of blocks).
[[nodiscard]] constexpr RandomBlock random_block(
    std::uint64_t seed, std::uint32_t pixel, std::uint64_t sample, std::uint32_t block) {
    return philox4x32_10({pixel, static_cast<std::uint32_t>(sample), block, static_cast<std::uint32_t>(sample >> 32)},
        {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
}

// Uniform in [0, 1 - 2^-24]: the top 24 bits, exact in float and double alike.
template <class Real>
[[nodiscard]] constexpr Real to_unit(std::uint32_t bits) {
    return static_cast<Real>(bits >> 8) * static_cast<Real>(0x1p-24);
}

// Numbers of the dimension blocks (MODEL.md section 3).
namespace dimension {
inline constexpr std::uint32_t film_and_lens = 0;  // pixel x, pixel y, lens u, lens v
inline constexpr std::uint32_t first_vertex = 4;   // vertex k owns the blocks 4 + 4k … 7 + 4k
inline constexpr std::uint32_t blocks_per_vertex = 4;
inline constexpr std::uint32_t scatter = 0;  // direction u, direction v, lobe choice, roulette
inline constexpr std::uint32_t light = 1;    // light choice, point u, point v, unused
}  // namespace dimension

}  // namespace tandem
