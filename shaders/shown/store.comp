// Stores a frame in an image: of four 8-bit channels, or (ANY_FORMAT) of what format the image has.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shown/shown.glsl"
#include "shown/means.glsl"
layout(local_size_x = 8, local_size_y = 8) in;

#ifdef ANY_FORMAT
layout(set = 0, binding = 2) uniform writeonly restrict image2D image;
#else
layout(set = 0, binding = 2, rgba8) uniform writeonly restrict image2D image;
#endif

void main() {
    const uvec2 at = gl_GlobalInvocationID.xy;
    const uint pixel = at.y * frame.width + at.x;
    if (at.x >= frame.width || pixel >= frame.pixels) return;
    imageStore(image, ivec2(at), shown(means_of(pixel)));
}
