// The generators that can replace Philox (MODEL.md section 3.2), in lanes. Tests compare them with
// common/render/random.h.
#pragma once

#include "common/render/random.h"
#include "cpu_ref/path_tracer/arithmetic/lanes.h"

namespace tandem::cpu {

// 32-bit words in lanes, which may be wider: what leaves them is cut off.
template <class Real>
TANDEM_INLINE Ints<Real> word(Ints<Real> x) {
    if constexpr (sizeof(Real) == 4) return x;
    return x & Ints<Real>(UnsignedOf<Real>{0xFFFFFFFFu});
}
template <class Real>
TANDEM_INLINE Ints<Real> constant(std::uint32_t value) {
    return Ints<Real>(UnsignedOf<Real>{value});
}
template <class Real>
using WordBlock = std::array<Ints<Real>, 4>;

template <class Real>
TANDEM_INLINE WordBlock<Real> pcg4d_in_lanes(WordBlock<Real> v) {
    for (Ints<Real>& x : v) x = word<Real>(x * constant<Real>(1664525u) + constant<Real>(1013904223u));
    for (int pass = 0; pass < 2; ++pass) {
        if (pass == 1)
            for (Ints<Real>& x : v) x = x ^ (x >> 16);
        v[0] = word<Real>(v[0] + v[1] * v[3]);
        v[1] = word<Real>(v[1] + v[2] * v[0]);
        v[2] = word<Real>(v[2] + v[0] * v[1]);
        v[3] = word<Real>(v[3] + v[1] * v[2]);
    }
    return v;
}

// Bits moved by `distance` from both sides: the ones of `upper` down, those of its complement up.
template <class Real>
TANDEM_INLINE Ints<Real> swapped(Ints<Real> x, std::uint32_t upper, int distance) {
    return ((x & constant<Real>(upper)) >> distance) | word<Real>((x & constant<Real>(~upper)) << distance);
}
template <class Real>
TANDEM_INLINE Ints<Real> reversed(Ints<Real> x) {
    x = swapped<Real>(x, 0xFFFF0000u, 16);
    x = swapped<Real>(x, 0xFF00FF00u, 8);
    x = swapped<Real>(x, 0xF0F0F0F0u, 4);
    x = swapped<Real>(x, 0xCCCCCCCCu, 2);
    return swapped<Real>(x, 0xAAAAAAAAu, 1);
}

template <class Real>
TANDEM_INLINE Ints<Real> owen_scrambled(Ints<Real> x, Ints<Real> key) {
    x = word<Real>(x + key);
    for (const std::uint32_t factor : {0x6C50B47Cu, 0xB82F1E52u, 0xC7AFE638u, 0x8D22F6E6u})
        x = x ^ word<Real>(x * constant<Real>(factor));
    return x;
}

// Taylor shift by one of the polynomial over GF(2) whose coefficients are the bits.
template <class Real>
TANDEM_INLINE Ints<Real> shifted_by_one(Ints<Real> x) {
    x = x ^ ((x & constant<Real>(0xFFFF0000u)) >> 16);
    x = x ^ ((x & constant<Real>(0xFF00FF00u)) >> 8);
    x = x ^ ((x & constant<Real>(0xF0F0F0F0u)) >> 4);
    x = x ^ ((x & constant<Real>(0xCCCCCCCCu)) >> 2);
    return x ^ ((x & constant<Real>(0xAAAAAAAAu)) >> 1);
}

template <class Real>
struct PairOfWords {
    Ints<Real> first, second;
};
template <class Real>
TANDEM_INLINE PairOfWords<Real> sobol_pair(Ints<Real> sample_reversed, const WordBlock<Real>& keys) {
    const Ints<Real> index = reversed<Real>(owen_scrambled<Real>(sample_reversed, keys[0]));
    return {reversed<Real>(owen_scrambled<Real>(index, keys[1])),
        reversed<Real>(owen_scrambled<Real>(shifted_by_one<Real>(index), keys[2]))};
}

// The words of a block of one sample a lane. Out of line: it is called from many places.
template <class Real>
[[gnu::noinline]] WordBlock<Real> words_by(Generator generator, std::uint64_t seed, Ints<Real> pixel,
    Ints<Real> sample_low, Ints<Real> sample_high, Ints<Real> block) {
    const WordBlock<Real> key = pcg4d_in_lanes<Real>({constant<Real>(static_cast<std::uint32_t>(seed)),
        constant<Real>(static_cast<std::uint32_t>(seed >> 32)), sample_high, constant<Real>(0)});
    const auto hashed = [&](Ints<Real> low, Ints<Real> at) {
        return pcg4d_in_lanes<Real>({pixel ^ key[0], low ^ key[1], at ^ key[2], key[3]});
    };
    if (generator == Generator::hash) return hashed(sample_low, block);
    const Ints<Real> rest = reversed<Real>(sample_low);
    const PairOfWords<Real> a = sobol_pair<Real>(rest, hashed(constant<Real>(0), block));
    const PairOfWords<Real> b = sobol_pair<Real>(rest, hashed(constant<Real>(sobol::second_pair), block));
    // sobol::pairs_inner, lane by lane: an idle lane's block is of any kind.
    const Mask<Real> inner = ((block & constant<Real>(3)) == constant<Real>(1)) & !(block == constant<Real>(1));
    return {
        select(inner, b.first, a.first), select(inner, a.first, a.second), select(inner, a.second, b.first), b.second};
}

}  // namespace tandem::cpu
