// What traced_rays.glsl asks, of ray queries: candidates are tested where they are found, by the tests and the tie rule of
// closest_hit.glsl.
#ifndef QUERIED_RAYS_GLSL
#define QUERIED_RAYS_GLSL

// The geometry of a box (vulkan/renderer/scene/traced_world.h).
const uint box_of_triangle = 0, box_of_sphere = 1;

// hit: none, at the distance that counts at most.
void try_candidate(uint kind, uint i, Ray ray, mat3 frame, SlabRay slabs, uint own, bool inside, inout Hit hit) {
    if (has_triangles && kind == box_of_triangle) {
        keep_triangle(i, triangle_at(i), seen_by(triangle_at(i), at_rest(ray, i), frame), ray, own, false, hit);
    } else if (has_spheres && kind == box_of_sphere) {
        try_sphere(i, ray, own, inside, false, hit);
    } else if (has_cuboids) {
        try_cuboid(i, cuboid_at(i), ray, slabs, own, inside, false, hit);
        hit.face = hit.local.x >= ray_min ? 0 : 1;
    }
}

bool candidate_blocks(uint kind, uint i, Ray ray, mat3 frame, SlabRay slabs, float t_max, uint own, bool inside, uint light) {
    if (has_triangles && kind == box_of_triangle)
        return triangle_blocks(i, seen_by(triangle_at(i), at_rest(ray, i), frame), ray, t_max, own, light);
    if (has_spheres && kind == box_of_sphere) return sphere_blocks(i, ray, t_max, own, inside, light);
    return has_cuboids && cuboid_blocks(i, cuboid_at(i), ray, slabs, t_max, own, inside, light);
}

Hit nearest_hit(Ray ray, uint own, bool inside, uint flags) {
    const mat3 frame = frame_of_ray(ray);
    const SlabRay slabs = slab_ray(ray.direction);
    Hit best = Hit(ray_max, hit_none, 0, vec3(0.0));
    rayQueryEXT query;
    rayQueryInitializeEXT(
        query, world, flags, 0xffu, ray.origin, 0.0, ray.direction, min(beyond(ray_max), rt_greatest));
    while (rayQueryProceedEXT(query)) {
        const uint i = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
        Hit hit = Hit(best.t, hit_none, 0, vec3(0.0));
        float limit = rt_greatest;
#ifdef DEVICE_TRIANGLES
        if (rayQueryGetIntersectionTypeEXT(query, false) == gl_RayQueryCandidateIntersectionTriangleEXT) {
            if (i != own && rayQueryGetIntersectionTEXT(query, false) >= ray_min) rayQueryConfirmIntersectionEXT(query);
            continue;
        }
        if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT)
            limit = rayQueryGetIntersectionTEXT(query, true);
        hit.t = min(hit.t, limit);
#endif
        try_candidate(
            rayQueryGetIntersectionGeometryIndexEXT(query, false), i, ray, frame, slabs, own, inside, hit);
        if (hit.slot == hit_none) continue;
        const bool ties = best.slot != hit_none && hit.t == best.t;
        if (ties && placed_at(best.slot).id < placed_at(hit.slot).id) continue;
        best = hit;
        // Just beyond, so that another as far away is still a candidate.
        rayQueryGenerateIntersectionEXT(query, min(beyond(hit.t), limit));
    }
#ifdef DEVICE_TRIANGLES
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT)
        best = Hit(rayQueryGetIntersectionTEXT(query, true), rayQueryGetIntersectionPrimitiveIndexEXT(query, true), 0,
            vec3(rayQueryGetIntersectionBarycentricsEXT(query, true), 1.0));
#endif
    return best;
}

bool is_blocked(Ray ray, float t_max, uint own, bool inside, uint light) {
    const mat3 frame = frame_of_ray(ray);
    const SlabRay slabs = slab_ray(ray.direction);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, world, gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsNoOpaqueEXT, 0xffu, ray.origin, 0.0,
        ray.direction, min(beyond(t_max), rt_greatest));
    while (rayQueryProceedEXT(query)) {
        const uint i = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
#ifdef DEVICE_TRIANGLES
        if (rayQueryGetIntersectionTypeEXT(query, false) == gl_RayQueryCandidateIntersectionTriangleEXT) {
            if (i != own && i != light && blocks(rayQueryGetIntersectionTEXT(query, false), t_max)) return true;
            continue;
        }
#endif
        const uint kind = rayQueryGetIntersectionGeometryIndexEXT(query, false);
        if (candidate_blocks(kind, i, ray, frame, slabs, t_max, own, inside, light)) return true;
    }
    return false;
}

#endif
