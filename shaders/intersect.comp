// Stage 4: the closest hit of every ray of the segment's queue, and whether the pending shadow
// ray of a next event meets anything (MODEL.md sections 5 and 9.2).
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "settings.glsl"
#define LOOPS_OVER_PRIMITIVES
#include "scene_set.glsl"
#include "ray_state.glsl"
#include "random.glsl"
#include "time.glsl"
#include "sampling.glsl"
#include "shapes.glsl"
#include "bvh.glsl"

layout(std430, set = 2, binding = 0) readonly restrict buffer OriginsIn { uvec4 origins_in[]; };
layout(std430, set = 2, binding = 1) readonly restrict buffer DirectionsIn { vec4 directions_in[]; };
layout(std430, set = 2, binding = 2) readonly restrict buffer ThroughputsIn { uvec4 throughputs_in[]; };
layout(std430, set = 2, binding = 10) writeonly restrict buffer Hits { uvec4 hits[]; };
layout(std430, set = 2, binding = 11) readonly restrict buffer Shadows { uvec4 shadows[]; };
layout(std430, set = 2, binding = 13) readonly restrict buffer Queues { RayQueue queues[]; };

float ray_time = 0.0;

// The ray as it meets the primitive's entity at rest (MODEL.md section 6). The tree's boxes hold all of its way.
Ray at_rest(Ray ray, uint slot) {
    if (has_entity_motion) ray.origin -= ray_time * transforms[placed[slot].entity].motion;
    return ray;
}

struct Hit {
    float t;
    uint slot;
    uint face;
    vec3 local;  // triangle: weights of corners 1 and 2; sphere, cuboid: the point in unit space
};

// Of equal distances the lower primitive id wins; within a kind that is the lower slot, and hit_none is above all slots.
bool is_closer(float t, uint slot, Hit best) {
    return t >= ray_min && (t < best.t || (t == best.t && slot < best.slot));
}

// How a ray meets a sphere or cuboid that it may be leaving (MODEL.md section 5, "Leaving a surface").
const uint meets_both = 0, meets_exit = 1, meets_never = 2;
uint meeting(bool is_own, bool inside) {
    if (!is_own || PLANTED(self_hit_not_excluded)) return meets_both;
    return inside ? meets_exit : meets_never;
}

// Distances to the two points of a body that a ray may meet; negative: none there. The exit of a ray that goes inside lies
// ahead, whatever rounding says.
vec2 sphere_distances(Ray unit_ray, uint how) {
    if (how == meets_exit) return vec2(-1.0, sphere_far_side(unit_ray));
    float entry, exit;
    const bool meets = how == meets_both && sphere_span(unit_ray, entry, exit);
    return meets ? vec2(entry, exit) : vec2(-1.0);
}

vec2 cuboid_distances(Convex cuboid, Ray unit_ray, uint how, out uvec2 faces) {
    const vec3 extent = vec3(cuboid.to_world0.w, cuboid.to_world1.w, cuboid.to_world2.w);
    float entry, exit;
    const bool meets = cuboid_span(unit_ray, extent, entry, exit, faces);
    if (how == meets_exit) return vec2(-1.0, max(exit, 0.0));
    return meets && how == meets_both ? vec2(entry, exit) : vec2(-1.0);
}

void try_triangle(uint slot, Ray ray, mat3 frame, uint own, inout Hit best) {
    float t;
    vec3 weights;
    if (slot == own && !PLANTED(self_hit_not_excluded)) return;
    if (intersect_triangle(triangle_at(slot), at_rest(ray, slot), frame, t, weights) && is_closer(t, slot, best))
        best = Hit(t, slot, 0, weights);
}

void try_sphere(uint i, Ray ray, uint own, bool inside, inout Hit best) {
    const uint slot = triangle_total() + i;
    const Ray unit_ray = to_unit_space(sphere_at(i), at_rest(ray, slot));
    const vec2 ts = sphere_distances(unit_ray, meeting(slot == own, inside));
    const float t = ts.x >= ray_min ? ts.x : ts.y;
    if (is_closer(t, slot, best)) best = Hit(t, slot, 0, unit_ray.origin + t * unit_ray.direction);
}

// The point in the cube's space, exactly on its face and within it.
vec3 point_on_face(vec3 near_face, uint face, vec3 extent) {
    vec3 local = clamp(near_face, -extent, extent);
    const float side = (face & 1u) != 0u ? 1.0 : -1.0;
    if (face < 2)
        local.x = side * extent.x;
    else if (face < 4)
        local.y = side * extent.y;
    else
        local.z = side * extent.z;
    return local;
}

void try_cuboid(uint i, Ray ray, uint own, bool inside, inout Hit best, inout vec3 extent) {
    const uint slot = triangle_total() + sphere_total() + i;
    const Convex cuboid = cuboid_at(i);
    const Ray unit_ray = to_unit_space(cuboid, at_rest(ray, slot));
    uvec2 faces;
    const vec2 ts = cuboid_distances(cuboid, unit_ray, meeting(slot == own, inside), faces);
    const bool enters = ts.x >= ray_min;
    const float t = enters ? ts.x : ts.y;
    if (!is_closer(t, slot, best)) return;
    extent = vec3(cuboid.to_world0.w, cuboid.to_world1.w, cuboid.to_world2.w);
    best = Hit(t, slot, enters ? faces.x : faces.y, unit_ray.origin + t * unit_ray.direction);
}

// The closest hits of each kind of primitive, up to and including the distance `limit`.
Hit closest_triangle(Ray ray, uint own, float limit) {
    Hit best = Hit(limit, hit_none, 0, vec3(0.0));
    const mat3 frame = frame_of(ray.direction);
    if (triangle_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(triangle_root);
        while ((current = bvh_descend(current, boxes, best.t)) != bvh_done) {
            try_triangle(current & slot_mask, ray, frame, own, best);
            current = bvh_pop();
        }
    } else if (unrolled) {
        [[unroll]] for (uint i = 0; i < fixed_triangles; ++i) try_triangle(i, ray, frame, own, best);
    } else {
        for (uint i = 0; i < settings.triangle_count; ++i) try_triangle(i, ray, frame, own, best);
    }
    best.local = vec3(best.local.xy / best.local.z, 0.0);
    return best;
}

Hit closest_sphere(Ray ray, uint own, bool inside, float limit) {
    Hit best = Hit(limit, hit_none, 0, vec3(0.0));
    if (sphere_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(sphere_root);
        while ((current = bvh_descend(current, boxes, best.t)) != bvh_done) {
            try_sphere(current & slot_mask, ray, own, inside, best);
            current = bvh_pop();
        }
    } else if (unrolled) {
        [[unroll]] for (uint i = 0; i < fixed_spheres; ++i) try_sphere(i, ray, own, inside, best);
    } else {
        for (uint i = 0; i < settings.sphere_count; ++i) try_sphere(i, ray, own, inside, best);
    }
    best.local = normalize(best.local);
    return best;
}

Hit closest_cuboid(Ray ray, uint own, bool inside, float limit) {
    Hit best = Hit(limit, hit_none, 0, vec3(0.0));
    vec3 extent = vec3(1.0);
    if (cuboid_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(cuboid_root);
        while ((current = bvh_descend(current, boxes, best.t)) != bvh_done) {
            try_cuboid(current & slot_mask, ray, own, inside, best, extent);
            current = bvh_pop();
        }
    } else if (unrolled) {
        [[unroll]] for (uint i = 0; i < fixed_cuboids; ++i) try_cuboid(i, ray, own, inside, best, extent);
    } else {
        for (uint i = 0; i < settings.cuboid_count; ++i) try_cuboid(i, ray, own, inside, best, extent);
    }
    best.local = point_on_face(best.local, best.face, extent);
    return best;
}

// The closer of the hits of two kinds.
Hit closer(Hit a, Hit b) {
    if (b.slot == hit_none) return a;
    if (a.slot == hit_none || b.t < a.t || placed[b.slot].id < placed[a.slot].id) return b;
    return a;
}

Hit closest_hit(Ray ray, uint own, bool inside) {
    Hit best = Hit(ray_max, hit_none, 0, vec3(0.0));
    if (!is_sound(ray)) return best;
    if (has_triangles) best = closer(best, closest_triangle(ray, own, best.t));
    if (has_spheres) best = closer(best, closest_sphere(ray, own, inside, best.t));
    if (has_cuboids) best = closer(best, closest_cuboid(ray, own, inside, best.t));
    return best;
}

bool blocks(float t, float t_max) { return t >= ray_min && t <= t_max; }

bool triangle_blocks(uint slot, Ray ray, mat3 frame, float t_max, uint own, uint light) {
    float t;
    vec3 weights;
    return slot != light && slot != own && intersect_triangle(triangle_at(slot), at_rest(ray, slot), frame, t, weights) &&
        blocks(t, t_max);
}

bool sphere_blocks(uint i, Ray ray, float t_max, uint own, bool inside, uint light) {
    const uint slot = triangle_total() + i;
    const vec2 ts = sphere_distances(to_unit_space(sphere_at(i), at_rest(ray, slot)), meeting(slot == own, inside));
    return slot != light && (blocks(ts.x, t_max) || blocks(ts.y, t_max));
}

bool cuboid_blocks(uint i, Ray ray, float t_max, uint own, bool inside, uint light) {
    const uint slot = triangle_total() + sphere_total() + i;
    uvec2 faces;
    const Convex cuboid = cuboid_at(i);
    const vec2 ts = cuboid_distances(cuboid, to_unit_space(cuboid, at_rest(ray, slot)), meeting(slot == own, inside), faces);
    return slot != light && (blocks(ts.x, t_max) || blocks(ts.y, t_max));
}

bool any_triangle_blocks(Ray ray, float t_max, uint own, uint light) {
    bool blocked = false;
    const mat3 frame = frame_of(ray.direction);
    if (triangle_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(triangle_root);
        while (!blocked && (current = bvh_descend(current, boxes, t_max)) != bvh_done) {
            blocked = triangle_blocks(current & slot_mask, ray, frame, t_max, own, light);
            current = bvh_pop();
        }
    } else if (unrolled) {
        [[unroll]] for (uint i = 0; i < fixed_triangles; ++i)
            if (!blocked) blocked = triangle_blocks(i, ray, frame, t_max, own, light);
    } else {
        for (uint i = 0; i < settings.triangle_count && !blocked; ++i) blocked = triangle_blocks(i, ray, frame, t_max, own, light);
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
    if (cuboid_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(cuboid_root);
        while (!blocked && (current = bvh_descend(current, boxes, t_max)) != bvh_done) {
            blocked = cuboid_blocks(current & slot_mask, ray, t_max, own, inside, light);
            current = bvh_pop();
        }
    } else if (unrolled) {
        [[unroll]] for (uint i = 0; i < fixed_cuboids; ++i)
            if (!blocked) blocked = cuboid_blocks(i, ray, t_max, own, inside, light);
    } else {
        for (uint i = 0; i < settings.cuboid_count && !blocked; ++i) blocked = cuboid_blocks(i, ray, t_max, own, inside, light);
    }
    return blocked;
}

// Does anything but `light` stand between the origin and the light's point?
bool is_occluded(Ray ray, float t_max, uint own, bool inside, uint light) {
    if (has_triangles && any_triangle_blocks(ray, t_max, own, light)) return true;
    if (has_spheres && any_sphere_blocks(ray, t_max, own, inside, light)) return true;
    return has_cuboids && any_cuboid_blocks(ray, t_max, own, inside, light);
}

void main() {
    preload_primitives();
    const uint i = gl_GlobalInvocationID.x;
    if (i >= queues[settings.segment].count) return;
    const uvec4 start = origins_in[i];
    const uint word = start.w;
    const uint own = word & slot_mask;
    const bool inside = (word & ray_inside) != 0u;
    if (has_entity_motion)
        ray_time = path_time(settings.first_pixel + (settings.segment == 0 ? i : throughputs_in[i].w));
    Ray ray = Ray(uintBitsToFloat(start.xyz), vec3(0.0));
    uint flags = 0;
    if (has_light_sampling && (word & ray_shadow) != 0u) {
        const uvec4 shadow = shadows[i];
        const vec3 offset = uintBitsToFloat(shadow.xyz);
        const float distance = length(offset);
        ray.direction = offset / distance;
        const bool far = (has_suns || has_sampled_background) && shadow.w == shadow_far;
        if (!is_occluded(ray, far ? ray_max : min(ray_max, distance), own, inside, shadow.w)) flags |= hit_lit;
        if ((word & ray_dead) != 0u) {
            hits[i] = uvec4(hit_ended | flags, 0, 0, 0);
            return;
        }
    }
    ray.direction = directions_in[i].xyz;
    const Hit best = closest_hit(ray, own, inside);
    hits[i] = uvec4(best.slot | best.face << hit_face_shift | flags, floatBitsToUint(best.local));
}
