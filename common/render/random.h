// Counter-based random numbers (MODEL.md section 3). The default is Philox4x32-10 of Salmon, Moraes, Dror, Shaw,
// "Parallel random numbers: as easy as 1, 2, 3", SC 2011. Two others may be chosen in its place (section 3.2).
// Stateless: any sample of any pixel can be re-run alone, in any order. These integer generators and their known
// answers are the only transport arithmetic that the host backends share.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

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

// philox: as above. hash: a cheaper hash. sobol: scrambled Sobol points, more even than independent numbers. Samples of
// one pixel are then not independent of each other. Those 2^32 apart, of other pixels and of other seeds are.
enum class Generator : std::uint32_t { philox = 0, hash = 1, sobol = 2 };
inline constexpr std::array<std::string_view, 3> generator_names{"philox", "hash", "sobol"};

// pcg4d of Jarzynski, Olano, "Hash functions for GPU rendering", JCGT 9(3), 2020.
[[nodiscard]] constexpr RandomBlock pcg4d(RandomBlock v) {
    for (std::uint32_t& word : v) word = word * 1664525u + 1013904223u;
    const auto mix = [&] {
        v[0] += v[1] * v[3];
        v[1] += v[2] * v[0];
        v[2] += v[0] * v[1];
        v[3] += v[1] * v[2];
    };
    mix();
    for (std::uint32_t& word : v) word ^= word >> 16;
    mix();
    return v;
}

// The words of an address under a seed: different seeds permute the addresses differently.
[[nodiscard]] constexpr RandomBlock hashed_block(
    std::uint64_t seed, std::uint32_t pixel, std::uint32_t sample_low, std::uint32_t sample_high, std::uint32_t block) {
    const RandomBlock key =
        pcg4d({static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32), sample_high, 0});
    return pcg4d({pixel ^ key[0], sample_low ^ key[1], block ^ key[2], key[3]});
}

namespace sobol {
[[nodiscard]] constexpr std::uint32_t reversed(std::uint32_t x) {
    x = (x >> 16) | (x << 16);
    x = ((x >> 8) & 0x00FF00FFu) | ((x & 0x00FF00FFu) << 8);
    x = ((x >> 4) & 0x0F0F0F0Fu) | ((x & 0x0F0F0F0Fu) << 4);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}

// A permutation in which a bit depends on lower ones alone: Owen's scrambling of numbers whose bits are reversed.
// [Laine, Karras 2011; the constants of Vegdahl as Burley 2020 gives them]
[[nodiscard]] constexpr std::uint32_t scrambled(std::uint32_t x, std::uint32_t key) {
    x += key;
    x ^= x * 0x6C50B47Cu;
    x ^= x * 0xB82F1E52u;
    x ^= x * 0xC7AFE638u;
    x ^= x * 0x8D22F6E6u;
    return x;
}

// The bits of the second Sobol coordinate of point `index`, reversed (the first one's are the index itself). Its
// direction numbers are v_k = v_(k-1) xor v_(k-1)/2 [Joe, Kuo 2008]. So its bits, read as a polynomial over GF(2), are
// that of the index with x + 1 for x. There (x + 1)^16 = x^16 + 1, and so on.
[[nodiscard]] constexpr std::uint32_t second_reversed(std::uint32_t index) {
    index ^= (index & 0xFFFF0000u) >> 16;
    index ^= (index & 0xFF00FF00u) >> 8;
    index ^= (index & 0xF0F0F0F0u) >> 4;
    index ^= (index & 0xCCCCCCCCu) >> 2;
    return index ^ (index & 0xAAAAAAAAu) >> 1;
}

struct Pair {
    std::uint32_t first, second;
};
// One point of a pair of dimensions, shuffled and scrambled by keys. [Burley 2020]
[[nodiscard]] constexpr Pair point(std::uint32_t reversed_sample, const RandomBlock& keys) {
    const std::uint32_t index = reversed(scrambled(reversed_sample, keys[0]));
    return {reversed(scrambled(index, keys[1])), reversed(scrambled(second_reversed(index), keys[2]))};
}

// Which numbers of a block are a pair: the first two and the last two. In a light's block the second and third are a
// pair, the point on it, and the first and fourth.
[[nodiscard]] constexpr bool pairs_inner(std::uint32_t block) { return block % 4 == 1 && block > 4; }
inline constexpr std::uint32_t second_pair = 1;  // stands for the sample in the keys of a block's second pair
}  // namespace sobol

[[nodiscard]] constexpr RandomBlock sobol_block(
    std::uint64_t seed, std::uint32_t pixel, std::uint64_t sample, std::uint32_t block) {
    const auto high = static_cast<std::uint32_t>(sample >> 32);
    const std::uint32_t sample_reversed = sobol::reversed(static_cast<std::uint32_t>(sample));
    const sobol::Pair a = sobol::point(sample_reversed, hashed_block(seed, pixel, 0, high, block));
    const sobol::Pair b = sobol::point(sample_reversed, hashed_block(seed, pixel, sobol::second_pair, high, block));
    if (sobol::pairs_inner(block)) return {b.first, a.first, a.second, b.second};
    return {a.first, a.second, b.first, b.second};
}

[[nodiscard]] constexpr RandomBlock random_block(
    Generator generator, std::uint64_t seed, std::uint32_t pixel, std::uint64_t sample, std::uint32_t block) {
    if (generator == Generator::philox) return random_block(seed, pixel, sample, block);
    if (generator == Generator::sobol) return sobol_block(seed, pixel, sample, block);
    return hashed_block(
        seed, pixel, static_cast<std::uint32_t>(sample), static_cast<std::uint32_t>(sample >> 32), block);
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
