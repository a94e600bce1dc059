// ray_batch.comp with rays, world primitives and geometry in double, for devices that have it (shaderFloat64). The host
// places the primitives. Trees stay in float: their boxes are widened by more than what the rounding of rays takes.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define DOUBLE_GEOMETRY
#define GIVEN_INTERVALS
#include "kernels/settings.glsl"
#include "geometry/intersection_choices.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene/scene_set.glsl"
#include "arithmetic/random.glsl"
#include "arithmetic/double.glsl"
#include "arithmetic/sampling.glsl"
#include "geometry/shapes.glsl"
#include "geometry/closest_hit.glsl"
#include "geometry/surface.glsl"

layout(std430, set = 2, binding = 0) readonly restrict buffer Origins { dvec4 origins[]; };       // w: ray word
layout(std430, set = 2, binding = 1) readonly restrict buffer Directions { dvec4 directions[]; };
layout(std430, set = 2, binding = 2) readonly restrict buffer Intervals { dvec4 intervals[]; };   // t_min, t_max
layout(std430, set = 2, binding = 5) writeonly restrict buffer Points { dvec4 points[]; };        // w: t
layout(std430, set = 2, binding = 6) writeonly restrict buffer Normals { dvec4 normals[]; };      // w: primitive id
layout(std430, set = 2, binding = 7) writeonly restrict buffer FrontOrigins { dvec4 fronts[]; };
layout(std430, set = 2, binding = 8) writeonly restrict buffer BackOrigins { dvec4 backs[]; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= settings.pixel_count) return;
    const uint word = uint(origins[i].w);
    ray_min = intervals[i].x;
    ray_max = intervals[i].y;
    const Ray ray = Ray(origins[i].xyz, directions[i].xyz);
    const Hit hit = closest_hit(ray, word & slot_mask, (word & ray_inside) != 0u);
    if (hit.slot == hit_none) {
        normals[i] = dvec4(0.0, 0.0, 0.0, double(no_index));
        return;
    }
    const Surface surface = surface_at(hit.slot, hit.face, hit.local, ray, 0.0);
    points[i] = dvec4(surface.point, hit.t);
    normals[i] = dvec4(surface.normal, double(placed_at(hit.slot).id));
    fronts[i] = dvec4(offset_ray_origin(surface, surface.normal), 0.0);
    backs[i] = dvec4(offset_ray_origin(surface, -surface.normal), 0.0);
}
