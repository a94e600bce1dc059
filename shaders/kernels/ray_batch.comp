// Rays of the caller (common/render/ray_batch.h): their closest hits, by the code that traces paths, and the origins of next
// rays. It is not one of the six stages. One invocation a ray.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#define GIVEN_INTERVALS
#include "kernels/settings.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene/scene_set.glsl"
#include "arithmetic/random.glsl"
#include "arithmetic/sampling.glsl"
#include "geometry/shapes.glsl"
#include "geometry/closest_hit.glsl"
#include "geometry/surface.glsl"

layout(std430, set = 2, binding = 0) readonly restrict buffer Origins { uvec4 origins[]; };        // w: ray word
layout(std430, set = 2, binding = 1) readonly restrict buffer Directions { vec4 directions[]; };
layout(std430, set = 2, binding = 2) readonly restrict buffer Intervals { vec4 intervals[]; };     // t_min, t_max
layout(std430, set = 2, binding = 5) writeonly restrict buffer Points { vec4 points[]; };          // w: t
layout(std430, set = 2, binding = 6) writeonly restrict buffer Normals { uvec4 normals[]; };       // w: primitive id
layout(std430, set = 2, binding = 7) writeonly restrict buffer FrontOrigins { vec4 fronts[]; };
layout(std430, set = 2, binding = 8) writeonly restrict buffer BackOrigins { vec4 backs[]; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= settings.pixel_count) return;
    const uvec4 start = origins[i];
    ray_min = intervals[i].x;
    ray_max = intervals[i].y;
    const Ray ray = Ray(uintBitsToFloat(start.xyz), directions[i].xyz);
    const Hit hit = closest_hit(ray, start.w & slot_mask, (start.w & ray_inside) != 0u);
    if (hit.slot == hit_none) {
        normals[i] = uvec4(0, 0, 0, no_index);
        return;
    }
    const Surface surface = surface_at(hit.slot, hit.face, hit.local, ray, 0.0);
    points[i] = vec4(surface.point, hit.t);
    normals[i] = uvec4(floatBitsToUint(surface.normal), placed_at(hit.slot).id);
    fronts[i] = vec4(offset_ray_origin(surface, surface.normal), 0.0);
    backs[i] = vec4(offset_ray_origin(surface, -surface.normal), 0.0);
}
