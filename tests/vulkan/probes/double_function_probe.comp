// e^-x, -ln x, atan2/(2 pi), cos 2 pi u and sin 2 pi u in double. Four doubles in, the last also as u, five out.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Input { dvec4 arguments[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Output { double results[]; };
#include "arithmetic/double.glsl"
#include "arithmetic/sampling.glsl"
#include "arithmetic/elementary.glsl"
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= arguments.length()) return;
    const dvec4 x = arguments[i];
    results[5 * i] = exp_minus(x.x);
    results[5 * i + 1] = minus_log(x.y);
    results[5 * i + 2] = turn_of(x.z, x.w);
    const dvec2 turned = cos_sin_turn(abs(x.w));
    results[5 * i + 3] = turned.x;
    results[5 * i + 4] = turned.y;
}
