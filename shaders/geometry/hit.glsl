// What tracing and shading kernels exchange: the ray that leaves a vertex, its hit, and a shadow ray. In registers, or
// packed into words of buffers (ray_state.glsl).
#ifndef HIT_GLSL
#define HIT_GLSL

// Ray word: the slot of the primitive that the ray leaves, and flags.
const uint slot_mask = 0x07ffffffu;
const uint no_slot = slot_mask;
const uint ray_inside = 1u << 27;  // leaves a sphere or cuboid towards its inside
const uint ray_axis_shift = 30;    // two bits: the axis of the cuboid's face that it leaves

const uint hit_none = slot_mask;  // in place of a slot: the ray left the scene

struct Hit {
    float t;  // to those who trace alone: what shades does not count on it
    uint slot;
    uint face;
    vec3 local;  // triangle: weights of corners 1 and 2, and t; sphere, cuboid: the point in unit space
};

// Shadow word: the slot of the light that cannot block itself, no_slot, or:
const uint shadow_far = 0xffffffffu;  // no distance: the light lies beyond everything

struct ShadowRay {
    vec3 offset;  // from the vertex to the light; to a far light the direction
    uint word;
};

#endif
