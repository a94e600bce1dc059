// Each invocation sums 64 samples and their squares as the post-processing stage does.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernels/moments.glsl"
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Input { float samples[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Output { vec4 moments[]; };
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (64 * i >= samples.length()) return;
    vec4 sum = vec4(0.0);
    for (uint k = 0; k < 64; ++k) sum = add_sample(sum, samples[64 * i + k]);
    moments[i] = sum;
}
