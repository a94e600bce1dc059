// Philox4x32-10 (MODEL.md section 3) [Salmon 2011] in 32-bit words.
#ifndef RANDOM_GLSL
#define RANDOM_GLSL
#include "planted.glsl"

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

vec4 random_block(uvec2 seed, uint pixel, uvec2 sample_index, uint block) {
    return to_unit(philox4x32_10(uvec4(PLANT(seed_repeated, pixel & ~4096u, pixel), sample_index.x, block, sample_index.y), seed));
}

const uint block_film_and_lens = 0;
const uint block_time = 1;
uint block_scatter(uint vertex) { return 4 + 4 * vertex; }
uint block_light(uint vertex) { return 5 + 4 * vertex; }
uint block_medium(uint vertex) { return 6 + 4 * vertex; }

#endif
