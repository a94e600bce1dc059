// What intersection shaders of the ray-tracing pipeline have in common (traced_ray.glsl).
#ifndef CANDIDATES_GLSL
#define CANDIDATES_GLSL
#include "kernels/settings.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene/scene_set.glsl"
#include "arithmetic/sampling.glsl"
#include "geometry/shapes.glsl"
#include "geometry/closest_hit.glsl"
#include "geometry/traced_ray.glsl"

hitAttributeEXT Candidate candidate;

// As the primitive's entity sees it.
Ray this_ray(uint slot) {
    if (has_entity_motion) ray_time = time_told(gl_RayTminEXT);
    return at_rest(Ray(gl_WorldRayOriginEXT, gl_WorldRayDirectionEXT), slot);
}

// Whether the hit was taken. The pipeline's limit always lies just beyond the last distance that counts.
bool offer(float t, uint slot, uint kind, vec3 local) {
    if (!(t >= ray_min && t < gl_RayTmaxEXT)) return false;
    candidate = Candidate(t, slot, local);
    const float reported = beyond(t);
    return reportIntersectionEXT(reported < gl_RayTmaxEXT ? reported : max(t, rt_least), kind);
}

#endif
