// Whole paths in fragments of a render pass without attachments: the rasteriser chooses which pixels are neighbours in a
// subgroup. What a fragment computes is what an invocation of the megakernel computes; sums go to the same buffers.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define NOT_COMPUTE
#include "settings.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene_set.glsl"
#include "random.glsl"
#include "time.glsl"
#include "sampling.glsl"
#include "shapes.glsl"
#include "camera.glsl"
#include "closest_hit.glsl"
#include "occlusion.glsl"
#include "surface.glsl"
#include "elementary.glsl"
#include "tables.glsl"
#include "noise.glsl"
#include "textures.glsl"
#include "materials.glsl"
#include "environment.glsl"
#include "background.glsl"
#include "media.glsl"
#include "interiors.glsl"
#include "lights.glsl"
#include "vertex_events.glsl"
#include "film.glsl"
#include "pixel_samples.glsl"

void main() {
    preload_primitives();
    const uvec2 at = uvec2(gl_FragCoord.xy);
    const uint place = at.y * settings.width + at.x - settings.first_pixel;
    // A share of the tile; a place before it or before the tile is beyond it too, since the difference wraps.
    if (place - settings.first_invocation >= settings.invocations || gl_HelperInvocation) return;
    render_pixel(place);
}
