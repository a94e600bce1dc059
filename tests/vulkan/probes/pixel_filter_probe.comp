// The Gaussian pixel filter's distance from the middle in double. A share beyond it in, the distance out.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) readonly buffer Input { double shares[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Output { double distances[]; };
#include "arithmetic/double.glsl"
#include "geometry/pixel_filter.glsl"
void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < shares.length()) distances[i] = gaussian_distance(shares[i]);
}
