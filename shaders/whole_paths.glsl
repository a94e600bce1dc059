// What kernels are made of that follow paths to their end and sum up their samples, whatever starts their invocations.
#ifndef WHOLE_PATHS_GLSL
#define WHOLE_PATHS_GLSL
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
#ifdef RAY_TRACING
#include "traced_rays.glsl"
#endif
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
#define DRAWS_AHEAD
#include "vertex_events.glsl"
#include "single.glsl"
#include "film.glsl"
#include "pixel_blocks.glsl"
#include "pixel_list.glsl"
#include "pixel_samples.glsl"

#endif
