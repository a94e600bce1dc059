// Closest hits and occlusion by the device's own traversal of an acceleration structure, in place of the loops and
// trees of closest_hit.glsl and occlusion.glsl. A ray-tracing pipeline does it, for the shader that generates rays, or
// ray queries do. With DEVICE_TRIANGLES triangles at rest are the device's own, opaque; all else is boxes, and Tandem's
// tests.
#ifndef TRACED_RAYS_GLSL
#define TRACED_RAYS_GLSL
#include "geometry/traced_ray.glsl"

layout(set = 4, binding = 0) uniform accelerationStructureEXT world;

#ifdef RAY_QUERY
#include "geometry/queried_rays.glsl"
#else
#include "geometry/pipeline_rays.glsl"
#endif

// Boxes are widened for rays that begin no farther away (vulkan/renderer/scene/traced_world.cpp). Those that a medium scatters
// beyond are left to loops and trees, whose boxes grow with the origin in hand.
bool begins_beyond(Ray ray) {
    const vec3 origin = abs(ray.origin);
    return has_medium_scattering && max(origin.x, max(origin.y, origin.z)) > 16.0 * scene.extent;
}

#ifdef DEVICE_TRIANGLES
// The device says which triangle is met. Where on it is computed here, as the bounds of surface.glsl are derived for
// Tandem's weights. The device's own weights are kept where Tandem sees the triangle from its edge. Also, Mesa's
// lavapipe (seen with 25.0.7) gives the closest triangle the hit attributes of boxes that were turned down.
void weigh_anew(inout Hit hit, Ray ray) {
    const Triangle triangle = triangle_at(hit.slot);
    const Ray resting = at_rest(ray, hit.slot);
    const vec3 edges = seen_by(triangle, resting, frame_of_ray(ray)).edges;
    precise float sum = edges.x + edges.y + edges.z;
    if (sum != 0.0) hit.local = vec3(edges.yz, sum);
    if (has_far_corners) hit.t = plane_distance(triangle, resting);
}
#endif

Hit closest_hit(Ray ray, uint own, bool inside) {
    if (begins_beyond(ray)) return walked_closest_hit(ray, own, inside);
    if (!is_sound(ray)) return Hit(ray_max, hit_none, 0, vec3(0.0));
    if (!excludes_left) own = no_slot;
    Hit best = nearest_hit(ray, own, inside, gl_RayFlagsNoneEXT);
#ifdef DEVICE_TRIANGLES
    // Opaque triangles are met without a question asked. Where the one was met that the ray leaves, each is asked after.
    const bool unwanted = best.slot == own || (ray_min > 0.0 && best.t < ray_min);
    if (has_triangles && best.slot < triangle_total() && unwanted)
        best = nearest_hit(ray, own, inside, gl_RayFlagsNoOpaqueEXT);
    if (has_triangles && best.slot < triangle_total()) weigh_anew(best, ray);
#endif
    locate(best, ray);
    return best;
}

bool is_occluded(Ray ray, float t_max, uint own, bool inside, uint light) {
    if (begins_beyond(ray)) return walked_is_occluded(ray, t_max, own, inside, light);
    if (!is_sound(ray)) return false;  // a light at the very origin
    return is_blocked(ray, t_max, excludes_left ? own : no_slot, inside, light);
}

#endif
