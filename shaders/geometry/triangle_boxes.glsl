// Boxes that are made of triangles: which of its triangles a ray may meet follows from where it passes the box, for less than
// half the work of all their edges (vulkan/renderer/kernels/triangle_boxes.h). Includes of a LOOPS_OVER_PRIMITIVES scene_set.glsl.
#ifndef TRIANGLE_BOXES_GLSL
#define TRIANGLE_BOXES_GLSL

layout(constant_id = 34) const uint triangle_boxes = 0;   // how many there are, at most two
layout(constant_id = 35) const uint boxed_triangles = 0;  // bit i: triangle i is of one

// The map of the world to the box's own space, in which it is [-1, 1]^3.
layout(constant_id = 92) const float box0_centre_x = 0.0;
layout(constant_id = 93) const float box0_centre_y = 0.0;
layout(constant_id = 94) const float box0_centre_z = 0.0;
layout(constant_id = 95) const float box0_row0_x = 0.0;
layout(constant_id = 96) const float box0_row0_y = 0.0;
layout(constant_id = 97) const float box0_row0_z = 0.0;
layout(constant_id = 98) const float box0_row1_x = 0.0;
layout(constant_id = 99) const float box0_row1_y = 0.0;
layout(constant_id = 100) const float box0_row1_z = 0.0;
layout(constant_id = 101) const float box0_row2_x = 0.0;
layout(constant_id = 102) const float box0_row2_y = 0.0;
layout(constant_id = 103) const float box0_row2_z = 0.0;
layout(constant_id = 104) const float box0_slope = 0.0;  // margin by distance, and at the centre
layout(constant_id = 105) const float box0_margin = 0.0;
layout(constant_id = 106) const uint box0_slots_x = 0;  // a byte each: the triangles of the faces -x and +x, two a face
layout(constant_id = 107) const uint box0_slots_y = 0;
layout(constant_id = 108) const uint box0_slots_z = 0;
layout(constant_id = 109) const uint box0_rising = 0;  // bit i: how face i is cut in two
layout(constant_id = 110) const float box1_centre_x = 0.0;
layout(constant_id = 111) const float box1_centre_y = 0.0;
layout(constant_id = 112) const float box1_centre_z = 0.0;
layout(constant_id = 113) const float box1_row0_x = 0.0;
layout(constant_id = 114) const float box1_row0_y = 0.0;
layout(constant_id = 115) const float box1_row0_z = 0.0;
layout(constant_id = 116) const float box1_row1_x = 0.0;
layout(constant_id = 117) const float box1_row1_y = 0.0;
layout(constant_id = 118) const float box1_row1_z = 0.0;
layout(constant_id = 119) const float box1_row2_x = 0.0;
layout(constant_id = 120) const float box1_row2_y = 0.0;
layout(constant_id = 121) const float box1_row2_z = 0.0;
layout(constant_id = 122) const float box1_slope = 0.0;
layout(constant_id = 123) const float box1_margin = 0.0;
layout(constant_id = 124) const uint box1_slots_x = 0;
layout(constant_id = 125) const uint box1_slots_y = 0;
layout(constant_id = 126) const uint box1_slots_z = 0;
layout(constant_id = 127) const uint box1_rising = 0;

struct TriangleBox {
    vec3 centre;
    vec3 row0;
    vec3 row1;
    vec3 row2;
    float slope;
    float margin;
    uvec3 slots;
    uint rising;
};

TriangleBox triangle_box(uint i) {
    if (i == 0)
        return TriangleBox(vec3(box0_centre_x, box0_centre_y, box0_centre_z), vec3(box0_row0_x, box0_row0_y, box0_row0_z),
            vec3(box0_row1_x, box0_row1_y, box0_row1_z), vec3(box0_row2_x, box0_row2_y, box0_row2_z), box0_slope, box0_margin,
            uvec3(box0_slots_x, box0_slots_y, box0_slots_z), box0_rising);
    return TriangleBox(vec3(box1_centre_x, box1_centre_y, box1_centre_z), vec3(box1_row0_x, box1_row0_y, box1_row0_z),
        vec3(box1_row1_x, box1_row1_y, box1_row1_z), vec3(box1_row2_x, box1_row2_y, box1_row2_z), box1_slope, box1_margin,
        uvec3(box1_slots_x, box1_slots_y, box1_slots_z), box1_rising);
}

bool is_boxed(uint triangle) { return (boxed_triangles >> triangle & 1u) != 0u; }

// A bit for each triangle of the box that the line may meet; at most a few that it passes by. With o and d in the box's
// space, the line passes the plane x_k = s at x_i d_k = s d_i - m_j and x_j d_k = s d_j + m_i, m = o x d and (k, i, j) in
// turn: no division, so that all errors are within one margin.
uint meets_box(TriangleBox box, Ray ray) {
    const uint none = 255u;
    const vec3 p = ray.origin - box.centre;
    const vec3 o = vec3(dot(box.row0, p), dot(box.row1, p), dot(box.row2, p));
    const vec3 d = vec3(dot(box.row0, ray.direction), dot(box.row1, ray.direction), dot(box.row2, ray.direction));
    const vec3 m = vec3(fma(o.y, d.z, -(o.z * d.y)), fma(o.z, d.x, -(o.x * d.z)), fma(o.x, d.y, -(o.y * d.x)));
    const float error = fma(box.slope, max(abs(p.x), max(abs(p.y), abs(p.z))), box.margin);
    uint met = 0;
    [[unroll]] for (uint face = 0; face < 6; ++face) {
        const uint k = face >> 1, i = (k + 1) % 3, j = (k + 2) % 3;
        const uint first = box.slots[k] >> 16 * (face & 1u) & 255u, second = box.slots[k] >> 16 * (face & 1u) + 8 & 255u;
        const float side = (face & 1u) != 0u ? 1.0 : -1.0;
        const float a = side * d[i] - m[j], b = side * d[j] + m[i];
        const bool passes = max(abs(a), abs(b)) <= abs(d[k]) + error;
        const float across = (box.rising >> face & 1u) != 0u ? a - b : a + b;
        const float beside = d[k] < 0.0 ? -across : across;
        // Without branches.
        if (first != none) met |= both(passes, beside >= -4.0 * error) ? 1u << first : 0u;
        if (second != none) met |= both(passes, beside <= 4.0 * error) ? 1u << second : 0u;
    }
    return met;
}

uint meets_boxes(Ray ray) {
    uint met = 0;
    if (triangle_boxes > 0) met |= meets_box(triangle_box(0), ray);
    if (triangle_boxes > 1) met |= meets_box(triangle_box(1), ray);
    return met;
}

#endif
