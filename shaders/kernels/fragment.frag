// Whole paths in fragments of a render pass without attachments: the rasteriser chooses which pixels are neighbours in a
// subgroup. What a fragment computes is what an invocation of the megakernel computes; sums go to the same buffers.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define NOT_COMPUTE
#include "kernels/whole_paths.glsl"

void main() {
    preload_primitives();
    const uvec2 at = uvec2(gl_FragCoord.xy);
    const uint place = at.y * settings.width + at.x - settings.first_pixel;
    // A share of the tile; a place before it or before the tile is beyond it too, since the difference wraps.
    if (place - settings.first_invocation >= settings.invocations || gl_HelperInvocation) return;
    render_pixels(place, 0);
}
