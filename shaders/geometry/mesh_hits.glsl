// Rays at meshes that several entities place (scene/meshes.glsl). Boxes of a mesh's tree are tested in object space, triangles in
// world space. Included by closest_hit.glsl and occlusion.glsl alone.
#ifndef MESH_HITS_GLSL
#define MESH_HITS_GLSL
#ifndef DOUBLE_GEOMETRY

// Let a ray o + t d meet a triangle's point w = M q + s in the world. R is the greatest sum of terms in M q + s. Sideways, the
// test sees w to within gamma(32) of |o| and R. These are 16 roundings of the corner and 16 of the test (world_boxes.cpp,
// bvh.glsl). Mapped by W, the inverse of M, the ray passes W e from q. Mapping rounds s, W and o - s (3), and products and sums
// of three (3). It does so for the origin and for t d, with coordinates within |o| + R: gamma(12). So q is passed by at most
// gamma(44) |W| (|o| + R), a sum over a row of W for each axis. Four more roundings are those of this bound itself.
const float gamma_mapped = 2.8610312e-6;  // gamma(48), rounded up

BoxRay mesh_box_ray(Ray ray, EntityTransform m, float reach) {
    precise vec3 p = ray.origin - vec3(m.to_world0.w, m.to_world1.w, m.to_world2.w);
    precise vec3 o = vec3(dot(m.to_object0, p), dot(m.to_object1, p), dot(m.to_object2, p));
    precise vec3 d = vec3(dot(m.to_object0, ray.direction), dot(m.to_object1, ray.direction), dot(m.to_object2, ray.direction));
    const vec3 size = abs(ray.origin);
    const float passed = gamma_mapped * (max(size.x, max(size.y, size.z)) + reach);
    BoxRay boxes = box_ray(Ray(o, d));
    boxes.slack += passed * vec3(sum_of_sizes(m.to_object0), sum_of_sizes(m.to_object1), sum_of_sizes(m.to_object2)) *
        abs(boxes.inverse);
    return boxes;
}

Hit closest_in_meshes(Ray ray, uint own, float limit) {
    Hit best = no_hit(limit, false);
    const mat3 frame = frame_of_ray(ray);
    const BoxRay outer = box_ray(ray);
    uint current = bvh_start(mesh_root);
    while ((current = bvh_descend(current, outer, best.t)) != bvh_done) {
        const PrimitiveSource place = place_source(current & slot_mask);
        const EntityTransform m = transforms[place.entity];
        const BoxRay inner = mesh_box_ray(ray, m, place.radius);
        uint within = bvh_enter(place.kind);
        while ((within = bvh_descend(within, inner, best.t)) != bvh_done) {
            const uint i = within & slot_mask, slot = place.index1 + i;
            const Triangle triangle = mesh_triangle(m, place.index0 + i);
            float t;
            vec3 weights;
            if (slot != own && meets_triangle(triangle, ray, seen_by(triangle, ray, frame), t, weights) &&
                is_closer(t, slot, best, false))
                best = Hit(t, slot, 0, weights);
            within = bvh_pop();
        }
        current = bvh_pop();
    }
    return best;
}

bool any_in_meshes_blocks(Ray ray, float t_max, uint own) {
    bool blocked = false;
    const mat3 frame = frame_of_ray(ray);
    const BoxRay outer = box_ray(ray);
    uint current = bvh_start(mesh_root);
    while (!blocked && (current = bvh_descend(current, outer, t_max)) != bvh_done) {
        const PrimitiveSource place = place_source(current & slot_mask);
        const EntityTransform m = transforms[place.entity];
        const BoxRay inner = mesh_box_ray(ray, m, place.radius);
        uint within = bvh_enter(place.kind);
        while (!blocked && (within = bvh_descend(within, inner, t_max)) != bvh_done) {
            const uint i = within & slot_mask;
            const Triangle triangle = mesh_triangle(m, place.index0 + i);
            float t;
            vec3 weights;
            blocked = place.index1 + i != own &&
                meets_triangle(triangle, ray, seen_by(triangle, ray, frame), t, weights) && t >= ray_min && t <= t_max;
            within = bvh_pop();
        }
        current = bvh_pop();
    }
    return blocked;
}

#endif
#endif
