// Whether a shadow ray meets anything (MODEL.md section 9.2), for every kernel that traces rays.
#ifndef OCCLUSION_GLSL
#define OCCLUSION_GLSL
#include "geometry/closest_hit.glsl"

bool blocks(float t, float t_max) { return t >= ray_min && t <= t_max; }

bool triangle_blocks(uint slot, Seen seen, Ray ray, float t_max, uint own, uint light) {
    float t;
    vec3 weights;
    return slot != light && slot != own && meets_triangle(triangle_at(slot), at_rest(ray, slot), seen, t, weights) &&
        blocks(t, t_max);
}

bool sphere_blocks(uint i, Ray ray, float t_max, uint own, bool inside, uint light) {
    const uint slot = triangle_total() + i;
    const vec2 ts = sphere_distances(to_unit_space(sphere_at(i), at_rest(ray, slot)), meeting(slot == own, inside));
    return slot != light && (blocks(ts.x, t_max) || blocks(ts.y, t_max));
}

bool cuboid_blocks(uint i, Convex cuboid, Ray ray, SlabRay slabs, float t_max, uint own, bool inside, uint light) {
    const uint slot = triangle_total() + sphere_total() + i;
    const vec2 span = cuboid_distances(i, cuboid, at_rest(ray, slot), slabs, meeting(slot == own, inside));
    return slot != light && span.x <= span.y && (blocks(span.x, t_max) || blocks(span.y, t_max));
}

bool any_triangle_blocks(Ray ray, float t_max, uint own, uint light) {
    bool blocked = false;
    const mat3 frame = frame_of_ray(ray);
    if (triangle_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(triangle_root);
        while (!blocked && (current = bvh_descend(current, boxes, t_max)) != bvh_done) {
            const uint slot = current & slot_mask;
            blocked = triangle_blocks(slot, seen_by(triangle_at(slot), at_rest(ray, slot), frame), ray, t_max, own, light);
            current = bvh_pop();
        }
    } else if (unrolled) {
        [[unroll]] for (uint i = 0; i < fixed_triangles; ++i) {
            const Seen seen = shared_seen(i, at_rest(ray, i), frame);
            if (!blocked) blocked = triangle_blocks(i, seen, ray, t_max, own, light);
        }
    } else {
        for (uint i = 0; i < settings.triangle_count && !blocked; ++i)
            blocked = triangle_blocks(i, seen_by(triangle_at(i), at_rest(ray, i), frame), ray, t_max, own, light);
    }
    return blocked;
}

bool any_sphere_blocks(Ray ray, float t_max, uint own, bool inside, uint light) {
    bool blocked = false;
    if (sphere_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(sphere_root);
        while (!blocked && (current = bvh_descend(current, boxes, t_max)) != bvh_done) {
            blocked = sphere_blocks(current & slot_mask, ray, t_max, own, inside, light);
            current = bvh_pop();
        }
    } else if (unrolled) {
        [[unroll]] for (uint i = 0; i < fixed_spheres; ++i)
            if (!blocked) blocked = sphere_blocks(i, ray, t_max, own, inside, light);
    } else {
        for (uint i = 0; i < settings.sphere_count && !blocked; ++i) blocked = sphere_blocks(i, ray, t_max, own, inside, light);
    }
    return blocked;
}

bool any_cuboid_blocks(Ray ray, float t_max, uint own, bool inside, uint light) {
    bool blocked = false;
    const SlabRay slabs = slab_ray(ray.direction);
    if (cuboid_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(cuboid_root);
        while (!blocked && (current = bvh_descend(current, boxes, t_max)) != bvh_done) {
            const uint i = current & slot_mask;
            blocked = cuboid_blocks(i, cuboid_at(i), ray, slabs, t_max, own, inside, light);
            current = bvh_pop();
        }
    } else if (unrolled) {
        if (slabs.moves) {
            [[unroll]] for (uint i = 0; i < fixed_cuboids; ++i)
                if (!blocked) blocked = cuboid_blocks(i, cuboid_at(i), ray, slabs, t_max, own, inside, light);
        } else {
            for (uint i = 0; i < settings.cuboid_count && !blocked; ++i)
                blocked = cuboid_blocks(i, cuboid_of(i), ray, slabs, t_max, own, inside, light);
        }
    } else {
        for (uint i = 0; i < settings.cuboid_count && !blocked; ++i)
            blocked = cuboid_blocks(i, cuboid_of(i), ray, slabs, t_max, own, inside, light);
    }
    return blocked;
}

#ifdef RAY_TRACING
bool is_occluded(Ray ray, float t_max, uint own, bool inside, uint light);  // traced_rays.glsl
#define is_occluded walked_is_occluded
#endif
// Does anything but `light` stand between the origin and the light's point?
bool is_occluded(Ray ray, float t_max, uint own, bool inside, uint light) {
    if (!excludes_left) own = no_slot;
    if (has_triangles && any_triangle_blocks(ray, t_max, own, light)) return true;
#ifndef DOUBLE_GEOMETRY
    if (has_triangles && mesh_tree && any_in_meshes_blocks(ray, t_max, own)) return true;
#endif
    if (has_spheres && any_sphere_blocks(ray, t_max, own, inside, light)) return true;
    return has_cuboids && any_cuboid_blocks(ray, t_max, own, inside, light);
}
#undef is_occluded

// Whether the light of a next event reaches the vertex at `origin`, which the ray leaves from as `word` says.
bool is_lit(vec3 origin, uint word, ShadowRay shadow) {
    const float distance = length(shadow.offset);
    const Ray ray = Ray(origin, shadow.offset / distance);
    const bool far = (has_suns || has_sampled_background) && shadow.word == shadow_far;
    return !is_occluded(
        ray, far ? ray_max : min(ray_max, PLANTED_REACH(distance)), word & slot_mask, (word & ray_inside) != 0u, shadow.word);
}

#endif
