// Traversal of the trees of vulkan/renderer/bvh.h, near child first, with a stack of as many levels as a tree may have.
#ifndef BVH_GLSL
#define BVH_GLSL
#include "planted.glsl"

const uint bvh_leaf = 0x80000000u;  // a slot of its kind, in place of a node
const uint bvh_done = 0xffffffffu;
const uint most_bvh_levels = 32;  // as in vulkan/renderer/bvh.h: every level leaves at most one child behind

uint bvh_stack[most_bvh_levels + 1];  // bvh_done lies at the bottom
uint bvh_stacked;

// A ray against boxes. The tests of primitives see the ray displaced sideways by at most gamma(16) times the distances
// of origin and primitive from 0: two points rounded and subtracted (2 roundings each), and the sums of products that
// follow. The host has widened the boxes by the primitive's part; the origin's part is taken off low planes and added to
// high ones here, through the origin.
struct BoxRay {
    vec3 low_origin;
    vec3 high_origin;
    vec3 inverse;
};
const float gamma_sideways = 9.5367523e-7;  // 16 u / (1 - 16 u), u = 2^-24
// A computed distance is off by a factor of at most 1 +- gamma(3); 1 + 2 gamma(3) on the far side makes up for both sides
// [Ize 2013, Robust BVH ray traversal].
const float far_widening = 1.00000036;

BoxRay box_ray(Ray ray) {
    const vec3 magnitude = abs(ray.origin);
    const float pad = gamma_sideways * max(magnitude.x, max(magnitude.y, magnitude.z));
    // A component too small for a finite quotient: its slab is then left so far away that only the side counts.
    const float least = 1.0e-18;
    const vec3 d = mix(ray.direction, mix(vec3(-least), vec3(least), greaterThanEqual(ray.direction, vec3(0.0))),
        lessThan(abs(ray.direction), vec3(least)));
    return BoxRay(ray.origin + pad, ray.origin - pad, 1.0 / d);
}

// Whether the ray meets the box before `limit`, and where it enters. No quotient is NaN, as the inverse is finite.
bool meets_box(BoxRay ray, vec3 low, vec3 high, float limit, out float entry) {
    precise vec3 a = (low - ray.low_origin) * ray.inverse;
    precise vec3 b = (high - ray.high_origin) * ray.inverse;
    const vec3 near = min(a, b), far = max(a, b);
    entry = max(max(near.x, near.y), max(near.z, 0.0));
    precise float last = min(min(far.x, far.y), min(far.z, limit)) * far_widening;
    return entry <= last;
}

uint bvh_start(uint root) {
    bvh_stack[0] = bvh_done;
    bvh_stacked = 1;
    return root;
}

uint bvh_pop() { return bvh_stack[--bvh_stacked]; }

// From `current` on to the next leaf whose box the ray meets before `limit`, or bvh_done.
uint bvh_descend(uint current, BoxRay ray, float limit) {
    while (current < bvh_leaf) {
        const BvhNode node = bvh_nodes[current];
        float entry0, entry1;
        const bool meets0 = meets_box(ray, node.low0, node.high0, limit, entry0);
        const bool meets1 = meets_box(ray, node.low1, node.high1, limit, entry1);
        if (meets0 && meets1) {
            const bool first = entry0 <= entry1;
            if (PLANTED(box_skipped) && (current & 127u) == 5u) {
                current = first ? node.child0 : node.child1;
                continue;
            }
            bvh_stack[bvh_stacked++] = first ? node.child1 : node.child0;
            current = first ? node.child0 : node.child1;
        } else if (meets0 || meets1) {
            current = meets0 ? node.child0 : node.child1;
        } else {
            current = bvh_pop();
        }
    }
    return current;
}

#endif
