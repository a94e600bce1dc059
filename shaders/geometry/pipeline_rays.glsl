// What traced_rays.glsl asks, of a ray-tracing pipeline.
#ifndef PIPELINE_RAYS_GLSL
#define PIPELINE_RAYS_GLSL

layout(location = 0) rayPayloadEXT TracedRay traced;

void trace_ray(Ray ray, uint flags, float limit) {
    traceRayEXT(world, flags, 0xffu, 0, 1, 0, ray.origin, has_entity_motion ? told_by_least(ray_time) : 0.0, ray.direction,
        min(beyond(limit), rt_greatest), 0);
}

#ifdef DEVICE_TRIANGLES
const uint tells_closest = gl_RayFlagsNoneEXT;
#else
const uint tells_closest = gl_RayFlagsSkipClosestHitShaderEXT;  // all that matters is in the payload
#endif

Hit nearest_hit(Ray ray, uint own, bool inside, uint flags) {
    traced = TracedRay(Hit(ray_max, hit_none, 0, vec3(0.0)), own, inside ? 1 : 0, no_slot);
    trace_ray(ray, tells_closest | flags, ray_max);
    return traced.hit;
}

bool is_blocked(Ray ray, float t_max, uint own, bool inside, uint light) {
    traced = TracedRay(Hit(t_max, hit_none, 0, vec3(0.0)), own, inside ? 1 : 0, light);
    trace_ray(ray, gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT | gl_RayFlagsNoOpaqueEXT, t_max);
    return traced.hit.slot != hit_none;
}

#endif
