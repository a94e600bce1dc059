// Stage 6: adds the finished sample of every pixel to the sums of its block (MODEL.md sections 10 and 11).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "settings.glsl"
#include "moments.glsl"

layout(std430, set = 2, binding = 12) readonly restrict buffer Samples { vec4 samples[]; };
layout(std430, set = 3, binding = 0) readonly restrict buffer SumsIn { vec4 sums_in[]; };
layout(std430, set = 3, binding = 1) writeonly restrict buffer SumsOut { vec4 sums_out[]; };
layout(std430, set = 3, binding = 2) restrict buffer Counters { uint invalid_samples; };

// Infinite, NaN or negative, by the bits: comparisons with NaN may be optimised away. -0 is fine.
bool is_invalid(float x) {
    const uint bits = floatBitsToUint(x);
    return (bits & 0x7fffffffu) >= 0x7f800000u || bits > 0x80000000u;
}

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= settings.pixel_count) return;
    vec3 radiance = samples[i].rgb;
    if (is_invalid(radiance.r) || is_invalid(radiance.g) || is_invalid(radiance.b)) {
        atomicAdd(invalid_samples, 1);
        radiance = vec3(0.0);
    }
    if (PLANTED(radiance_clamped)) radiance = min(radiance, vec3(1.0));
    for (uint channel = 0; channel < 3; ++channel) {
        const uint at = channel * settings.pixel_count + i;
        sums_out[at] = add_sample(sums_in[at], radiance[channel]);
    }
}
