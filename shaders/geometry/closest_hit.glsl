// The closest hit of a ray (MODEL.md section 5), for every kernel that traces rays. Includes of a LOOPS_OVER_PRIMITIVES
// scene_set.glsl.
#ifndef CLOSEST_HIT_GLSL
#define CLOSEST_HIT_GLSL
#include "made/constant_ids.glsl"
#include "geometry/hit.glsl"
#include "geometry/bvh.glsl"
#include "geometry/shared_corners.glsl"

// Time of the path whose rays are traced; the kernel sets it where has_entity_motion.
float ray_time = 0.0;

// The ray as it meets the primitive's entity at rest (MODEL.md section 6). The tree's boxes hold all of its way.
Ray at_rest(Ray ray, uint slot) {
    if (has_entity_motion) ray.origin -= ray_time * transforms[placed_at(slot).entity].motion;
    return ray;
}

// At equal distances the lower primitive id wins. Within a kind that is the lower slot; hit_none is above all slots.
// Loops go through the slots in ascending order, trees do not: only those need to compare slots.
bool is_closer(float t, uint slot, Hit best, bool in_order) {
#ifdef DOUBLE_GEOMETRY
    in_order = false;
#endif
    return t >= ray_min && (t < best.t || (!in_order && t == best.t && slot < best.slot));
}

// Nothing is met yet up to and including `limit`.
Hit no_hit(float limit, bool in_order) {
    Hit none = Hit(limit, hit_none, 0, vec3(0.0));
#ifndef DOUBLE_GEOMETRY
    // The next float, as distances are not negative; a device that takes subnormal numbers for zero needs a normal one.
    const float smallest_normal = 1.1754944e-38;
    if (in_order && !isinf(limit)) none.t = max(uintBitsToFloat(floatBitsToUint(limit) + 1), smallest_normal);
#endif
    return none;
}

// How a ray meets a sphere or cuboid that it may be leaving (MODEL.md section 5, "Leaving a surface").
const uint meets_both = 0, meets_exit = 1, meets_never = 2;
uint meeting(bool is_own, bool inside) {
    if (!is_own) return meets_both;
    return inside ? meets_exit : meets_never;
}

// Distances to the two points of a body that a ray may meet; negative: none there. The exit of a ray that goes inside lies
// ahead, whatever rounding says.
vec2 sphere_distances(Ray unit_ray, uint how) {
    float entry = -1.0, exit;
    if (how == meets_exit)
        exit = sphere_far_side(unit_ray);
    else if (how != meets_both || !sphere_span(unit_ray, entry, exit))
        return vec2(-1.0);
    return vec2(entry, PLANT(sphere_inside_lost, -1.0, exit));
}

// Where a line enters and leaves a cuboid; entry > exit: it misses.
vec2 cuboid_span(uint i, Convex cuboid, Ray ray, SlabRay slabs) {
    const vec3 centre = vec3(cuboid.to_unit0.w, cuboid.to_unit1.w, cuboid.to_unit2.w);
    if (is_aligned(i, cuboid) && slabs.moves && !naive_convex)
        return aligned_span(ray.origin, slabs, centre, vec3(cuboid.to_world0.x, cuboid.to_world1.y, cuboid.to_world2.z));
    return cube_span(to_unit_space(cuboid, ray), vec3(cuboid.to_world0.w, cuboid.to_world1.w, cuboid.to_world2.w));
}

// Entry above exit: none.
vec2 cuboid_distances(uint i, Convex cuboid, Ray ray, SlabRay slabs, uint how) {
    const vec2 span = cuboid_span(i, cuboid, ray, slabs);
    if (how == meets_exit) return vec2(-1.0, max(span.y, 0.0));
    return how == meets_both ? span : vec2(1.0, 0.0);
}

void keep_triangle(uint slot, Triangle triangle, Seen seen, Ray ray, uint own, bool in_order, inout Hit best) {
    float t;
    vec3 weights;
    if (slot == own) return;
    if (meets_triangle(triangle, at_rest(ray, slot), seen, t, weights) && is_closer(t, slot, best, in_order))
        best = Hit(t, slot, 0, weights);
}

void try_sphere(uint i, Ray ray, uint own, bool inside, bool in_order, inout Hit best) {
    const uint slot = triangle_total() + i;
    const vec2 ts = sphere_distances(to_unit_space(sphere_at(i), at_rest(ray, slot)), meeting(slot == own, inside));
    const bool enters = ts.x >= ray_min;
    const float t = enters ? ts.x : ts.y;
    if (is_closer(t, slot, best, in_order)) best = Hit(t, slot, enters ? 0 : 1, vec3(0.0));
}

// Where the root says that the ray enters or leaves, the point lies before or beyond the middle of the chord. For a
// body that the map flattens, or a distant one, rounding would put it on the other side. It is then as far from the
// middle on this side.
void locate_sphere(inout Hit hit, Ray ray) {
    const Ray unit_ray = to_unit_space(sphere_of(hit.slot - triangle_total()), at_rest(ray, hit.slot));
    const vec3 d = unit_ray.direction;
    hit.local = normalize(unit_ray.origin + hit.t * d);
    const float ahead = dot(hit.local, d);
    if (hit.face == 0 ? ahead > 0.0 : ahead < 0.0) hit.local = normalize(hit.local - 2.0 * ahead / dot(d, d) * d);
}

// best.local: where the ray enters the cuboid, until all are tried.
void try_cuboid(uint i, Convex cuboid, Ray ray, SlabRay slabs, uint own, bool inside, bool in_order, inout Hit best) {
    const uint slot = triangle_total() + sphere_total() + i;
    const vec2 span = cuboid_distances(i, cuboid, at_rest(ray, slot), slabs, meeting(slot == own, inside));
    const bool enters = span.x >= ray_min;
    const float t = enters ? span.x : span.y;
    if (span.x <= span.y && is_closer(t, slot, best, in_order)) best = Hit(t, slot, 0, vec3(span.x));
}

// The face is that of the last plane which the ray enters through, or of the first that it leaves through. The point is
// moved exactly on it, and within it. (Where the point comes nearest to a plane would tell nothing of a cuboid as thin as
// the rounding of the point.)
void locate_cuboid(inout Hit hit, Ray ray) {
    const Convex cuboid = cuboid_of(hit.slot - triangle_total() - sphere_total());
    const vec3 extent = vec3(cuboid.to_world0.w, cuboid.to_world1.w, cuboid.to_world2.w);
    const Ray unit_ray = to_unit_space(cuboid, at_rest(ray, hit.slot));
    const vec3 direction = unit_ray.direction, point = unit_ray.origin + hit.t * direction;
    const bool leaves = hit.face == 1;
    const float sense = leaves ? 1.0 : -1.0;  // products with it are exact
    const bvec3 stands = lessThan(abs(direction), vec3(least_component)), ascends = greaterThan(direction, vec3(0.0));
    const vec3 towards = mix(-extent, extent, ascends);
    precise vec3 way = unit_ray.origin - sense * towards;  // back from the plane
    precise vec3 rank = sense * way / mix(direction, vec3(1.0), stands);
    rank = mix(rank, vec3(-3.4e38), stands);
    const uint axis = rank.x >= rank.y && rank.x >= rank.z ? 0 : rank.y >= rank.z ? 1 : 2;
    const bool high = (axis == 0 ? ascends.x : axis == 1 ? ascends.y : ascends.z) == leaves;
    const float side = high ? 1.0 : -1.0;
    hit.face = 2 * axis + (high ? 1 : 0);
    hit.local = clamp(point, -extent, extent);
    if (axis == 0)
        hit.local.x = side * extent.x;
    else if (axis == 1)
        hit.local.y = side * extent.y;
    else
        hit.local.z = side * extent.z;
}

layout(constant_id = id_picks_candidates) const bool picks_candidates = false;

// Whether threads pick the triangles that their rays may meet before they test any. It is asked where `unrolled` alone
// has been. Mesa 22.3 unrolls a loop before it finds a condition of several constants false. A mesh's loop has as many
// turns as triangles (12 GB and more for 10^5).
bool picks() { return picks_candidates && triangle_kernel == kernel_watertight && !PLANTED(triangle_edge_lost); }

// A bit for each triangle that the ray may meet.
uint candidates(Ray ray, uint own, mat3 frame) {
    uint within = 0;
    [[unroll]] for (uint i = 0; i < fixed_triangles; ++i)
        if (may_be_within(shared_seen(i, at_rest(ray, i), frame).edges)) within |= 1u << i;
    if (own < fixed_triangles) within &= ~(1u << own);
    return within;
}

// Threads of a subgroup meet different triangles, each few: what follows is for those alone. The nearest plane first: most
// often that is the one, and the other triangles need no test.
Hit closest_candidate(Ray ray, uint within, mat3 frame, Hit best) {
    while (within != 0) {
        uint nearest = 0;
        float least = best.t;
        bool any = false;
        for (uint rest = within; rest != 0; rest &= rest - 1) {
            const uint i = findLSB(rest);
            const float t = plane_distance(triangle_of(i), at_rest(ray, i));
            if (t >= ray_min && t < least) {
                least = t;
                nearest = i;
                any = true;
            }
        }
        if (!any) break;
        const Triangle triangle = triangle_of(nearest);
        const Ray resting = at_rest(ray, nearest);
        const bool crosses = dot(ray.direction, vec3(triangle.corner0.w, triangle.corner1.w, triangle.corner2.w)) != 0.0;
        vec3 weights;
        within &= ~(1u << nearest);
        if (!passes_within(triangle, resting, seen_by(triangle, resting, frame), crosses, weights)) continue;
        best = Hit(least, nearest, 0, weights);
        within = 0;
    }
    return best;
}

// The closest hits of each kind of primitive, up to and including the distance `limit`.
Hit closest_triangle(Ray ray, uint own, float limit) {
    Hit best = no_hit(limit, !triangle_tree);
    const mat3 frame = frame_of_ray(ray);
    if (triangle_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(triangle_root);
        while ((current = bvh_descend(current, boxes, best.t)) != bvh_done) {
            const uint slot = current & slot_mask;
            keep_triangle(slot, triangle_at(slot), seen_by(triangle_at(slot), at_rest(ray, slot), frame), ray, own, false, best);
            current = bvh_pop();
        }
    } else if (unrolled) {
        if (picks()) {
            best = closest_candidate(ray, candidates(ray, own, frame), frame, best);
        } else {
            [[unroll]] for (uint i = 0; i < fixed_triangles; ++i)
                keep_triangle(i, triangle_at(i), shared_seen(i, at_rest(ray, i), frame), ray, own, true, best);
        }
    } else {
        for (uint i = 0; i < settings.triangle_count; ++i)
            keep_triangle(i, triangle_at(i), seen_by(triangle_at(i), at_rest(ray, i), frame), ray, own, true, best);
    }
    return best;
}

Hit closest_sphere(Ray ray, uint own, bool inside, float limit) {
    Hit best = no_hit(limit, !sphere_tree);
    if (sphere_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(sphere_root);
        while ((current = bvh_descend(current, boxes, best.t)) != bvh_done) {
            try_sphere(current & slot_mask, ray, own, inside, false, best);
            current = bvh_pop();
        }
    } else if (unrolled) {
        [[unroll]] for (uint i = 0; i < fixed_spheres; ++i) try_sphere(i, ray, own, inside, true, best);
    } else {
        for (uint i = 0; i < settings.sphere_count; ++i) try_sphere(i, ray, own, inside, true, best);
    }
    return best;
}

Hit closest_cuboid(Ray ray, uint own, bool inside, float limit) {
    Hit best = no_hit(limit, !cuboid_tree);
    const SlabRay slabs = slab_ray(ray.direction);
    if (cuboid_tree) {
        const BoxRay boxes = box_ray(ray);
        uint current = bvh_start(cuboid_root);
        while ((current = bvh_descend(current, boxes, best.t)) != bvh_done) {
            const uint i = current & slot_mask;
            try_cuboid(i, cuboid_at(i), ray, slabs, own, inside, false, best);
            current = bvh_pop();
        }
    } else if (unrolled) {
        if (slabs.moves) {
            [[unroll]] for (uint i = 0; i < fixed_cuboids; ++i)
                try_cuboid(i, cuboid_at(i), ray, slabs, own, inside, true, best);
        } else {
            for (uint i = 0; i < settings.cuboid_count; ++i) try_cuboid(i, cuboid_of(i), ray, slabs, own, inside, true, best);
        }
    } else {
        for (uint i = 0; i < settings.cuboid_count; ++i) try_cuboid(i, cuboid_of(i), ray, slabs, own, inside, true, best);
    }
    best.face = best.local.x >= ray_min ? 0 : 1;
    return best;
}

// Keeps the closer of the hits of two kinds, `other` being no farther away.
void keep_closer(inout Hit best, Hit other) {
    if (other.slot == hit_none) return;
    if (best.slot != hit_none && other.t == best.t && placed_at(best.slot).id < placed_at(other.slot).id) return;
    best.t = other.t;
    best.slot = other.slot;
    best.face = other.face;
}

#include "geometry/mesh_hits.glsl"

// Where on its primitive a hit is.
void locate(inout Hit hit, Ray ray) {
    if (hit.slot == hit_none) return;
    if (has_triangles && (in_mesh(hit.slot) || hit.slot < triangle_total()))
        hit.local = vec3(hit.local.xy / hit.local.z, hit.t);
    else if (has_spheres && hit.slot < triangle_total() + sphere_total())
        locate_sphere(hit, ray);
    else if (has_cuboids)
        locate_cuboid(hit, ray);
}

#ifdef RAY_TRACING
#define closest_hit walked_closest_hit  // traced_rays.glsl has the other
#endif
Hit closest_hit(Ray ray, uint own, bool inside) {
    Hit best = Hit(ray_max, hit_none, 0, vec3(0.0));
    if (!is_sound(ray)) return best;
    if (!excludes_left) own = no_slot;
    if (has_triangles) {
        best = closest_triangle(ray, own, best.t);
        if (best.slot == hit_none) best.t = ray_max;
    }
#ifndef DOUBLE_GEOMETRY
    if (has_triangles && mesh_tree) {
        const Hit in_meshes = closest_in_meshes(ray, own, best.t);
        keep_closer(best, in_meshes);
        if (in_meshes.slot != hit_none && best.slot == in_meshes.slot) best.local = in_meshes.local;
    }
#endif
    if (has_spheres) keep_closer(best, closest_sphere(ray, own, inside, best.t));
    if (has_cuboids) keep_closer(best, closest_cuboid(ray, own, inside, best.t));
    locate(best, ray);
    return best;
}
#undef closest_hit

#endif
