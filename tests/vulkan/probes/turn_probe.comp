// (cos 2 pi u, sin 2 pi u) on the device.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "arithmetic/sampling.glsl"
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Input { float turns[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Output { vec2 results[]; };
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < turns.length()) results[i] = cos_sin_turn(turns[i]);
}
