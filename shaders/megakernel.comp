// Ray generation, intersection, scattering and post-processing in one kernel: an invocation renders several samples of one
// pixel, with the path and the sums of its samples in registers. Where a path ends, the next sample's begins in the same
// turn of the loop, so that no invocation waits for the longest path of its subgroup. The arithmetic is that of the stages.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "settings.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene_set.glsl"
#include "random.glsl"
#include "time.glsl"
#include "geometry_types.glsl"
#include "sampling.glsl"
#include "shapes.glsl"
#include "camera.glsl"
#include "closest_hit.glsl"
#include "occlusion.glsl"
#include "surface.glsl"
#include "shading_types.glsl"
#if defined(DOUBLE_GEOMETRY) && !defined(DOUBLE_SHADING)
#include "sampling.glsl"
#endif
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
#include "single.glsl"
#include "film.glsl"
#include "pixel_blocks.glsl"
#include "pixel_samples.glsl"

void main() {
    preload_primitives();
    if (gl_GlobalInvocationID.x >= settings.invocations) return;
    render_pixel(place_of(settings.first_invocation + gl_GlobalInvocationID.x));
}
