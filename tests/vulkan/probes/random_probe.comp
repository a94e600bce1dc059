// Philox on the device: one block of words for each counter and key.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "arithmetic/random.glsl"
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Input { uvec4 addresses[]; };  // counter, (key, -, -)
layout(std430, set = 0, binding = 1) writeonly buffer Output { uvec4 words[]; };
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (2 * i + 1 < addresses.length()) words[i] = philox4x32_10(addresses[2 * i], addresses[2 * i + 1].xy);
}
