// e^-x, -ln x, atan2/(2 pi) and pcg3d. Four words in, eight out.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Input { uvec4 arguments[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Output { uvec4 results[]; };
#include "arithmetic/elementary.glsl"
#include "material/noise.glsl"
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= arguments.length()) return;
    const vec4 x = uintBitsToFloat(arguments[i]);
    results[2 * i] = uvec4(floatBitsToUint(vec3(exp_minus(x.x), minus_log(x.y), turn_of(x.z, x.w))), 0);
    results[2 * i + 1] = uvec4(pcg3d(arguments[i].xyz), 0);
}
