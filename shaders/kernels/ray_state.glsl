// Words that the stages pass in the Rays set. Ray state is split and ping-ponged: a stage reads one half and writes the
// other. So no block is both read and written, and the synchronisation layer sees every missing barrier.
#ifndef RAY_STATE_GLSL
#define RAY_STATE_GLSL

#include "geometry/hit.glsl"

// Ray word (w of origins): as in hit.glsl, and two flags more.
const uint ray_dead = 1u << 28;    // the path has ended, but for its last shadow ray
const uint ray_shadow = 1u << 29;  // a shadow ray from the same origin is pending

// Hit word (x of hits): the slot of the primitive hit, hit_none or hit_ended, and flags.
const uint hit_ended = slot_mask - 1u; // no ray, but its last shadow ray is resolved now
const uint hit_nothing = slot_mask - 2u;  // a place whose path has ended, where rays stay at their pixels' places
const uint hit_face_shift = 27;        // three bits: face of a cuboid, -x +x -y +y -z +z
const uint hit_face_mask = 7u;
const uint hit_lit = 1u << 30;         // the pending shadow ray met nothing

// The rays of one segment lie at [0, count) of its half of the ray state: ended paths leave no gaps. From segment 1 on,
// throughputs.w names the pixel. The first three words are the arguments of an indirect dispatch.
struct RayQueue {
    uint groups_x;
    uint groups_y;
    uint groups_z;
    uint count;
};

#endif
