// What the stages of a ray-tracing pipeline exchange, and what ray queries share with them. The device's traversal
// finds boxes. These stages decide what is hit in them and which hit is the closest. They use the tests and the tie
// rule of closest_hit.glsl, so that no bit differs.
//
// Intersection shaders see no payload. So they do not know which primitive the ray leaves. For a body they report two hits: that
// of any ray, and the exit of a ray that leaves the body on its inside. The any-hit shader takes the one that applies. And a
// pipeline may drop a hit as far away as the last that was taken. So a hit at t is reported as one just beyond t, and a second
// hit at t as one below that. The any-hit shader sees both, and the lower primitive id wins.
#ifndef TRACED_RAY_GLSL
#define TRACED_RAY_GLSL
#include "geometry/hit.glsl"

// The payload.
struct TracedRay {
    Hit hit;      // the closest so far, its parts as the loops keep them
    uint own;     // slot of the primitive that the ray leaves, or no_slot
    uint inside;  // 1: it leaves a body towards its inside
    uint light;   // slot of what cannot block a shadow ray, or no primitive's
};

// The hit attribute.
struct Candidate {
    float t;
    uint slot;
    vec3 local;
};

// The hit kind.
const uint offer_entry = 0;     // of a triangle, too
const uint offer_exit = 1;      // of a body that the ray starts in
const uint offer_own_exit = 2;  // of a body that the ray leaves towards its inside

// No distance is reported below this, 2^-124. The normal numbers below it, 2^24 of them, are the times that a path may have:
// a ray's least distance tells intersection shaders its time.
const float rt_least = 4.7019774e-38;
const float rt_greatest = 3.402823466e38;
const uint rt_smallest_normal = 0x00800000u;  // its bits

float told_by_least(float time) { return uintBitsToFloat(rt_smallest_normal + uint(time * 16777216.0)); }
float time_told(float least) { return float(floatBitsToUint(least) - rt_smallest_normal) / 16777216.0; }

// The next number after t, which is not negative; room for one number that may be reported below it.
float beyond(float t) { return max(uintBitsToFloat(floatBitsToUint(t) + 1), 2.0 * rt_least); }

#endif
