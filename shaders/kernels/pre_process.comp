// Stage 1: clears the sums of a block of samples. One invocation a pixel.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernels/settings.glsl"

layout(std430, set = 3, binding = 1) writeonly restrict buffer SumsOut { vec4 sums_out[]; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= settings.pixel_count) return;
    for (uint channel = 0; channel < 3; ++channel) sums_out[channel * settings.pixel_count + i] = vec4(0.0);
}
