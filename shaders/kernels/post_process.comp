// Stage 6: adds the finished sample of every pixel to the sums of its block (MODEL.md sections 10 and 11).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernels/settings.glsl"
#include "kernels/film.glsl"

layout(std430, set = 2, binding = 12) readonly restrict buffer Samples { vec4 samples[]; };
layout(std430, set = 3, binding = 0) readonly restrict buffer SumsIn { Sums sums_in[]; };
layout(std430, set = 3, binding = 1) writeonly restrict buffer SumsOut { Sums sums_out[]; };
layout(std430, set = 3, binding = 2) restrict buffer Counters { uint invalid_samples; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= settings.pixel_count) return;
    bool invalid;
    const vec3 radiance = summand(samples[i].rgb, invalid);
    if (invalid) atomicAdd(invalid_samples, 1);
    for (uint channel = 0; channel < 3; ++channel) {
        const uint at = channel * settings.pixel_count + i;
        sums_out[at] = add_sample(sums_in[at], radiance[channel]);
    }
}
