// The common code of kernels that follow whole paths and sum up their samples, whether compute, fragment or ray-generation
// shaders.
#ifndef WHOLE_PATHS_GLSL
#define WHOLE_PATHS_GLSL
#include "kernels/settings.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene/scene_set.glsl"
#include "arithmetic/random.glsl"
#include "geometry/time.glsl"
#include "geometry/geometry_types.glsl"
#include "arithmetic/sampling.glsl"
#include "geometry/shapes.glsl"
#include "geometry/camera.glsl"
#include "geometry/closest_hit.glsl"
#include "geometry/occlusion.glsl"
#ifdef RAY_TRACING
#include "geometry/traced_rays.glsl"
#endif
#include "geometry/surface.glsl"
#include "arithmetic/shading_types.glsl"
#if defined(DOUBLE_GEOMETRY) && !defined(DOUBLE_SHADING)
#include "arithmetic/sampling.glsl"
#endif
#include "arithmetic/elementary.glsl"
#include "material/tables.glsl"
#include "material/noise.glsl"
#include "material/textures.glsl"
#include "material/materials.glsl"
#include "light/environment.glsl"
#include "light/background.glsl"
#include "material/media.glsl"
#include "geometry/interiors.glsl"
#include "light/lights.glsl"
#define DRAWS_AHEAD
#include "kernels/vertex_events.glsl"
#include "arithmetic/single.glsl"
#include "kernels/film.glsl"
#include "kernels/pixel_blocks.glsl"
#include "kernels/pixel_list.glsl"
#include "kernels/pixel_samples.glsl"

#endif
