// Closest hits and occlusion by the ray-tracing pipeline, in place of the loops and trees of closest_hit.glsl and
// occlusion.glsl, for the shader that generates rays.
#ifndef TRACED_RAYS_GLSL
#define TRACED_RAYS_GLSL
#include "geometry/traced_ray.glsl"

layout(set = 4, binding = 0) uniform accelerationStructureEXT world;
layout(location = 0) rayPayloadEXT TracedRay traced;

// All that matters is in the payload: nobody needs a closest-hit shader.
void trace_ray(Ray ray, uint flags, float limit) {
    traceRayEXT(world, gl_RayFlagsSkipClosestHitShaderEXT | flags, 0xffu, 0, 1, 0, ray.origin, 0.0, ray.direction,
        min(beyond(limit), rt_greatest), 0);
}

Hit closest_hit(Ray ray, uint own, bool inside) {
    Hit best = Hit(ray_max, hit_none, 0, vec3(0.0));
    if (!is_sound(ray)) return best;
    traced = TracedRay(best, excludes_left ? own : no_slot, inside ? 1 : 0, no_slot);
    trace_ray(ray, 0, ray_max);
    best = traced.hit;
    locate(best, ray);
    return best;
}

bool is_occluded(Ray ray, float t_max, uint own, bool inside, uint light) {
    if (!is_sound(ray)) return false;  // a light at the very origin
    traced = TracedRay(
        Hit(t_max, hit_none, 0, vec3(0.0)), excludes_left ? own : no_slot, inside ? 1 : 0, light);
    trace_ray(ray, gl_RayFlagsTerminateOnFirstHitEXT, t_max);
    return traced.hit.slot != hit_none;
}

#endif
