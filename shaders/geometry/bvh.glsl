// Traversal of the trees of vulkan/renderer/scene/bvh.h, near child first, with a stack of as many levels as a tree may have.
#ifndef BVH_GLSL
#define BVH_GLSL

const uint bvh_leaf = 0x80000000u;  // a slot of its kind, in place of a node
const uint bvh_done = 0xffffffffu;
const uint most_bvh_levels = 32;  // as in vulkan/renderer/scene/bvh.h: every level leaves at most one child behind

// bvh_done lies at the bottom; of a mesh's tree within that of places, too.
uint bvh_stack[mesh_tree ? 2 * most_bvh_levels + 2 : most_bvh_levels + 1];
uint bvh_stacked;

// A ray against boxes, each a centre and half an extent. Along an axis the ray is between the two planes for as long
// before the centre as after it. So no minimum or maximum has to part entry from exit. The centre is met at
// fma(centre, inverse, start), half the way is fma(half, |inverse|, slack).
//
// Rounding displaces planes, as if the box were larger or smaller, or scales the ray's distances. Displaced:
// - the tests of primitives see the ray sideways by at most gamma(16) times the distances of origin and primitive from
//   0. Two points are rounded and subtracted (2 roundings each), and sums of products follow.
// - the centre is off by `start` (u |o|) and the multiply-add, fused or not (u |c| and u (|c| + |o|)).
// The host has widened the boxes by the parts of primitive and box (world_boxes.cpp, bvh.cpp), `slack` is the origin's.
struct BoxRay {
    vec3 inverse;
    vec3 start;
    vec3 slack;
};
const float gamma_sideways = 1.1324896e-6;  // gamma(19) = 19 u / (1 - 19 u), u = 2^-24: 16, 2, and 1 for the slack itself
// Scaled: the inverse is off by 2.5 units in the last place, which are 5 u. Half the way is off by 2 u, the sum by u.
// Twice 8 u on the far side makes up for both sides [Ize 2013, Robust BVH ray traversal].
const float far_widening = 1.00000096;

BoxRay box_ray(Ray ray) {
    const vec3 magnitude = abs(ray.origin);
    const float pad = gamma_sideways * max(magnitude.x, max(magnitude.y, magnitude.z));
    // A component too small for a finite quotient: its slab is then left so far away that only the side counts.
    const float least = 1.0e-18;
    const vec3 d = mix(ray.direction, mix(vec3(-least), vec3(least), greaterThanEqual(ray.direction, vec3(0.0))),
        lessThan(abs(ray.direction), vec3(least)));
    const vec3 inverse = 1.0 / d;
    precise vec3 start = -ray.origin * inverse;
    return BoxRay(inverse, start, pad * abs(inverse));
}

// Whether the ray meets the box before `limit`, and where it enters. No quotient is NaN, as the inverse is finite.
bool meets_box(BoxRay ray, vec3 centre, vec3 half_extent, float limit, out float entry) {
    precise vec3 middle = fma(centre, ray.inverse, ray.start);
    precise vec3 half_way = fma(half_extent, abs(ray.inverse), ray.slack);
    precise vec3 near = middle - half_way;
    precise vec3 far = middle + half_way;
    entry = max(max(near.x, near.y), max(near.z, 0.0));
    precise float last = min(min(far.x, far.y), min(far.z, limit)) * far_widening;
    return entry <= last;
}

uint bvh_start(uint root) {
    bvh_stack[0] = bvh_done;
    bvh_stacked = 1;
    return root;
}

// Into a tree within the leaf of another: its end is met as bvh_done, and bvh_pop() then goes on outside.
uint bvh_enter(uint root) {
    bvh_stack[bvh_stacked++] = bvh_done;
    return root;
}

uint bvh_pop() { return bvh_stack[--bvh_stacked]; }

// From `current` on to the next leaf whose box the ray meets before `limit`, or bvh_done.
uint bvh_descend(uint current, BoxRay ray, float limit) {
    while (current < bvh_leaf) {
        const BvhNode node = bvh_nodes[current];
        float entry0, entry1;
        const bool meets0 = meets_box(ray, node.centre0, node.half0, limit, entry0);
        const bool meets1 = meets_box(ray, node.centre1, node.half1, limit, entry1);
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
