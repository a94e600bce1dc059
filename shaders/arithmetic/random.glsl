// Philox4x32-10 (MODEL.md section 3) [Salmon 2011] in 32-bit words, and the generators that can replace it (3.2).
#ifndef RANDOM_GLSL
#define RANDOM_GLSL
#include "made/constant_ids.glsl"
#include "kernels/planted.glsl"

uvec4 philox4x32_10(uvec4 counter, uvec2 key) {
    for (int round = 0; round < 10; ++round) {
        uint high0, low0, high1, low1;
        umulExtended(0xD2511F53u, counter.x, high0, low0);
        umulExtended(0xCD9E8D57u, counter.z, high1, low1);
        counter = uvec4(high1 ^ counter.y ^ key.x, low1, high0 ^ counter.w ^ key.y, low0);
        key += uvec2(0x9E3779B9u, 0xBB67AE85u);
    }
    return counter;
}

// The top 24 bits times 2^-24: exact, never 1.
vec4 to_unit(uvec4 words) { return vec4(words >> 8) * 5.9604644775390625e-8; }

layout(constant_id = id_generator) const uint generator = 0;  // Generator of common/render/random.h
const uint generator_hash = 1, generator_sobol = 2;

// Jarzynski and Olano's pcg4d.
uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

uvec4 hashed_block(uvec2 seed, uint pixel, uint sample_low, uint sample_high, uint block) {
    const uvec4 key = pcg4d(uvec4(seed, sample_high, 0));
    return pcg4d(uvec4(pixel, sample_low, block, 0) ^ key);
}

// Owen's scrambling of a number whose bits are reversed. [Laine, Karras 2011; Burley 2020]
uint owen_scrambled(uint x, uint key) {
    x += key;
    x ^= x * 0x6C50B47Cu;
    x ^= x * 0xB82F1E52u;
    x ^= x * 0xC7AFE638u;
    return x ^ (x * 0x8D22F6E6u);
}

// p(x + 1) for the polynomial over GF(2) with these bits: Sobol's second coordinate, reversed.
uint taylor_shifted(uint p) {
    p ^= (p & 0xFFFF0000u) >> 16;
    p ^= (p & 0xFF00FF00u) >> 8;
    p ^= (p & 0xF0F0F0F0u) >> 4;
    p ^= (p & 0xCCCCCCCCu) >> 2;
    return p ^ ((p & 0xAAAAAAAAu) >> 1);
}

uvec2 sobol_pair(uint sample_reversed, uvec4 keys) {
    const uint index = bitfieldReverse(owen_scrambled(sample_reversed, keys.x));
    return uvec2(bitfieldReverse(owen_scrambled(index, keys.y)),
        bitfieldReverse(owen_scrambled(taylor_shifted(index), keys.z)));
}

uvec4 sobol_block(uvec2 seed, uint pixel, uvec2 sample_index, uint block) {
    const uint sample_reversed = bitfieldReverse(sample_index.x);
    const uvec2 a = sobol_pair(sample_reversed, hashed_block(seed, pixel, 0, sample_index.y, block));
    const uvec2 b = sobol_pair(sample_reversed, hashed_block(seed, pixel, 1, sample_index.y, block));
    // A light's block: the point on it is a pair.
    return block > 4 && block % 4 == 1 ? uvec4(b.x, a, b.y) : uvec4(a, b);
}

uvec4 random_words(uvec2 seed, uint pixel, uvec2 sample_index, uint block) {
    if (generator == generator_hash) return hashed_block(seed, pixel, sample_index.x, sample_index.y, block);
    if (generator == generator_sobol) return sobol_block(seed, pixel, sample_index, block);
    if (PLANTED(seed_repeated)) pixel &= ~4096u;
    if (PLANTED(numbers_reused) && block / 4 == 10) block -= 16;
    uvec4 words = philox4x32_10(uvec4(pixel, sample_index.x, block, sample_index.y), seed);
    if (PLANTED(random_short)) words &= 0xFFFF0000u;
    return words;
}

vec4 random_block(uvec2 seed, uint pixel, uvec2 sample_index, uint block) {
    uvec4 words = random_words(seed, pixel, sample_index, block);
#ifdef RECORDS_PATHS
    if (block == settings.changed_block) words[settings.changed_number & 3u] ^= 1u << (settings.changed_number >> 2);
#endif
    return to_unit(words);
}

const uint block_film_and_lens = 0;
const uint block_time = 1;
uint block_scatter(uint vertex) { return 4 + 4 * vertex; }
uint block_light(uint vertex) { return 5 + 4 * vertex; }
uint block_medium(uint vertex) { return 6 + 4 * vertex; }

#endif
