// Packs a frame into a buffer, four bytes a pixel, which a copy can take to an image.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shown/shown.glsl"
#include "shown/means.glsl"
layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 2) writeonly restrict buffer Packed { uint pixels[]; } packed;

void main() {
    const uint pixel = gl_GlobalInvocationID.x;
    if (pixel >= frame.pixels) return;
    const uvec3 codes = encoded(means_of(pixel));
    packed.pixels[pixel] = codes.r | codes.g << 8 | codes.b << 16 | 0xff000000u;
}
