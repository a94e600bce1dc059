// How a sample enters the sums of its pixel, and which samples are invalid (MODEL.md sections 11 and 12).
#ifndef FILM_GLSL
#define FILM_GLSL
#include "kernels/moments.glsl"

// Infinite, NaN or negative, by the bits: comparisons with NaN may be optimised away. -0 is fine.
bool is_invalid(float x) {
    const uint bits = floatBitsToUint(x);
    return (bits & 0x7fffffffu) >= 0x7f800000u || bits > 0x80000000u;
}

// 0 for a sample that is invalid, which the caller counts.
vec3 summand(vec3 radiance, out bool invalid) {
    // Few samples pass this first test: as integers, numbers that are finite and have no sign are below infinity.
    const uvec3 bits = floatBitsToUint(radiance);
    invalid = false;
    if (max(bits.r, max(bits.g, bits.b)) >= 0x7f800000u)
        invalid = is_invalid(radiance.r) || is_invalid(radiance.g) || is_invalid(radiance.b);
    if (invalid) radiance = vec3(0.0);
    // As if two of 512 threads had read the same sum.
    if (PLANTED(sample_lost) && (floatBitsToUint(radiance.r) * 2654435761u >> 23) == 7u) radiance = vec3(0.0);
    if (clamps) radiance = min(radiance, vec3(clamp_at));  // section 11.1
    return radiance;
}

#endif
