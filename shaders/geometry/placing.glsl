// Points and triangles in the world, of those in object space (MODEL.md section 6). The vertex stage fills buffers by this.
// Triangles of meshes are also made by it, where rays meet them (scene/meshes.glsl). So both have the same bits.
#ifndef PLACING_GLSL
#define PLACING_GLSL
#include "arithmetic/exact_products.glsl"

vec3 transformed(EntityTransform m, vec3 p) {
    precise vec3 world = vec3(dot(m.to_world0.xyz, p) + m.to_world0.w, dot(m.to_world1.xyz, p) + m.to_world1.w,
        dot(m.to_world2.xyz, p) + m.to_world2.w);
    return world;
}

// What rounding took from the difference a - b [Knuth].
vec3 difference_rest(vec3 a, vec3 b, vec3 difference) {
    precise vec3 b_part = a - difference;
    precise vec3 a_part = difference + b_part;
    precise vec3 rest = (a - a_part) + (b_part - b);
    return rest;
}

// By which power of two to scale the edges, which rounds nothing: their product squared is in the range of float then.
float edge_scale(vec3 e, vec3 f) {
    const vec3 largest = max(abs(e), abs(f));
    const float size = max(largest.x, max(largest.y, largest.z));
    int exponent = 0;
    if (size > 0.0) frexp(size, exponent);
    return ldexp(1.0, clamp(-exponent, -126, 126));
}

// (b - a) x (c - a), scaled. Rounded edges turn the plane of a sliver by its aspect times their rounding, so there the rests
// count.
vec3 edge_product(vec3 a, vec3 b, vec3 c) {
    const float scale = edge_scale(b - a, c - a);
    precise vec3 e = scale * (b - a);
    precise vec3 f = scale * (c - a);
    precise vec3 plain = cross(e, f);
    const float sliver = 256.0;
    if (!(dot(e, e) * dot(f, f) > sliver * sliver * dot(plain, plain))) return plain;
    const vec3 e_rest = scale * difference_rest(b, a, b - a), f_rest = scale * difference_rest(c, a, c - a);
    precise vec3 whole = vec3(difference_of_products(e.y, f.z, e.z, f.y), difference_of_products(e.z, f.x, e.x, f.z),
        difference_of_products(e.x, f.y, e.y, f.x));
    precise vec3 normal = whole + (cross(e, f_rest) + cross(e_rest, f));
    return normal;
}

Triangle placed_triangle(EntityTransform m, vec3 a, vec3 b, vec3 c) {
    const vec3 p0 = transformed(m, a);
    const vec3 p1 = transformed(m, b);
    const vec3 p2 = transformed(m, c);
    // The world's cross product is that of the object through det(M) M^-T: a mirrored triangle keeps its front.
    precise vec3 normal = m.determinant_sign * edge_product(p0, p1, p2);
    return Triangle(vec4(p0, normal.x), vec4(p1, normal.y), vec4(p2, normal.z));
}

#endif
