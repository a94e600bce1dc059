// The triangles of an unrolled loop share corners: each is projected once, and each edge function taken once, as compilers
// find equal expressions. Includes of a LOOPS_OVER_PRIMITIVES scene_set.glsl.
#ifndef SHARED_CORNERS_GLSL
#define SHARED_CORNERS_GLSL

#include "made/constant_ids.glsl"

// The three low bytes of corners_i name for each corner of triangle i the first corner, three a triangle, of that place.
layout(constant_id = id_corners) const uint corners_0 = 0;
layout(constant_id = id_corners + 1) const uint corners_1 = 0;
layout(constant_id = id_corners + 2) const uint corners_2 = 0;
layout(constant_id = id_corners + 3) const uint corners_3 = 0;
layout(constant_id = id_corners + 4) const uint corners_4 = 0;
layout(constant_id = id_corners + 5) const uint corners_5 = 0;
layout(constant_id = id_corners + 6) const uint corners_6 = 0;
layout(constant_id = id_corners + 7) const uint corners_7 = 0;
layout(constant_id = id_corners + 8) const uint corners_8 = 0;
layout(constant_id = id_corners + 9) const uint corners_9 = 0;
layout(constant_id = id_corners + 10) const uint corners_10 = 0;
layout(constant_id = id_corners + 11) const uint corners_11 = 0;
layout(constant_id = id_corners + 12) const uint corners_12 = 0;
layout(constant_id = id_corners + 13) const uint corners_13 = 0;
layout(constant_id = id_corners + 14) const uint corners_14 = 0;
layout(constant_id = id_corners + 15) const uint corners_15 = 0;
layout(constant_id = id_corners + 16) const uint corners_16 = 0;
layout(constant_id = id_corners + 17) const uint corners_17 = 0;
layout(constant_id = id_corners + 18) const uint corners_18 = 0;
layout(constant_id = id_corners + 19) const uint corners_19 = 0;
layout(constant_id = id_corners + 20) const uint corners_20 = 0;
layout(constant_id = id_corners + 21) const uint corners_21 = 0;
layout(constant_id = id_corners + 22) const uint corners_22 = 0;
layout(constant_id = id_corners + 23) const uint corners_23 = 0;
layout(constant_id = id_corners + 24) const uint corners_24 = 0;
layout(constant_id = id_corners + 25) const uint corners_25 = 0;
layout(constant_id = id_corners + 26) const uint corners_26 = 0;
layout(constant_id = id_corners + 27) const uint corners_27 = 0;
layout(constant_id = id_corners + 28) const uint corners_28 = 0;
layout(constant_id = id_corners + 29) const uint corners_29 = 0;
layout(constant_id = id_corners + 30) const uint corners_30 = 0;
layout(constant_id = id_corners + 31) const uint corners_31 = 0;

// The first corner that is the same as corner k of triangle i.
uint first_corner(uint i, uint k) {
    const uint corners[32] = uint[32](corners_0, corners_1, corners_2, corners_3, corners_4, corners_5, corners_6,
        corners_7, corners_8, corners_9, corners_10, corners_11, corners_12, corners_13, corners_14, corners_15,
        corners_16, corners_17, corners_18, corners_19, corners_20, corners_21, corners_22, corners_23, corners_24,
        corners_25, corners_26, corners_27, corners_28, corners_29, corners_30, corners_31);
    return corners[i] >> 8 * k & 255u;
}

vec2 projected[unrolled ? 3 * fixed_triangles + 1 : 1];

float shared_edge(uint a, uint b) { return a < b ? edge(projected[a], projected[b]) : -edge(projected[b], projected[a]); }

// Triangle i as the ray sees it, after all lower triangles.
Seen shared_seen(uint i, Ray ray, mat3 frame) {
    const Triangle triangle = triangle_at(i);
    const uint a = first_corner(i, 0), b = first_corner(i, 1), c = first_corner(i, 2);
    if (a == 3 * i) projected[a] = project(triangle.corner0.xyz, ray, frame);
    if (b == 3 * i + 1) projected[b] = project(triangle.corner1.xyz, ray, frame);
    if (c == 3 * i + 2) projected[c] = project(triangle.corner2.xyz, ray, frame);
    return Seen(projected[a], projected[b], projected[c],
        vec3(shared_edge(b, c), shared_edge(c, a), shared_edge(a, b)));
}

#endif
