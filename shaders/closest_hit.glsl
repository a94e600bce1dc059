// The closest hit of a ray (MODEL.md section 5), for every kernel that traces rays. Includes of a LOOPS_OVER_PRIMITIVES
// scene_set.glsl.
#ifndef CLOSEST_HIT_GLSL
#define CLOSEST_HIT_GLSL
#include "hit.glsl"
#include "bvh.glsl"

// Of the path whose rays are traced; the kernel sets it where has_entity_motion.
float ray_time = 0.0;

// The ray as it meets the primitive's entity at rest (MODEL.md section 6). The tree's boxes hold all of its way.
Ray at_rest(Ray ray, uint slot) {
    if (has_entity_motion) ray.origin -= ray_time * transforms[placed[slot].entity].motion;
    return ray;
}

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
    if (how == meets_exit) return PLANT(sphere_inside_lost, vec2(-1.0), vec2(-1.0, sphere_far_side(unit_ray)));
    float entry, exit;
    const bool meets = how == meets_both && sphere_span(unit_ray, entry, exit);
    return meets ? vec2(entry, PLANT(sphere_inside_lost, -1.0, exit)) : vec2(-1.0);
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
    if (PLANTED(primitive_lost) && slot % 64u == 9u) return;
    if (intersect_triangle(triangle_at(slot), at_rest(ray, slot), frame, t, weights) && is_closer(t, slot, best))
        best = Hit(t, slot, 0, weights);
}

void try_sphere(uint i, Ray ray, uint own, bool inside, inout Hit best) {
    const uint slot = triangle_total() + i;
    if (PLANTED(primitive_lost) && slot % 64u == 9u) return;
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
    const mat3 frame = frame_of_ray(ray);
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
    if (!excludes_left) own = no_slot;
    if (has_triangles) best = closer(best, closest_triangle(ray, own, best.t));
    if (has_spheres) best = closer(best, closest_sphere(ray, own, inside, best.t));
    if (has_cuboids) best = closer(best, closest_cuboid(ray, own, inside, best.t));
    return best;
}

#endif
