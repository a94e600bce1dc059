// Stage 2: places every primitive in the world through the indices that it holds (MODEL.md sections 5 and 6). One
// invocation a primitive, in slot order.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernels/settings.glsl"
#define WRITES_SCENE
#include "scene/scene_set.glsl"
#include "arithmetic/exact_products.glsl"

vec3 transformed(EntityTransform m, vec3 p) {
    precise vec3 world = vec3(dot(m.to_world0.xyz, p) + m.to_world0.w, dot(m.to_world1.xyz, p) + m.to_world1.w,
        dot(m.to_world2.xyz, p) + m.to_world2.w);
    return world;
}

// The map of the cube or sphere with `centre` and half-axes `half_size` along the object axes.
Convex placed_convex(EntityTransform m, vec3 centre, vec3 half_size) {
    const vec3 c = transformed(m, centre);
    const vec3 extent = vec3(notEqual(half_size, vec3(0.0)));
    const vec3 scale = mix(vec3(1.0), half_size, extent);  // seen from the world a flat axis has the object's unit
    Convex shape;
    shape.to_unit0 = vec4(m.to_object0 / scale.x, c.x);
    shape.to_unit1 = vec4(m.to_object1 / scale.y, c.y);
    shape.to_unit2 = vec4(m.to_object2 / scale.z, c.z);
    shape.to_world0 = vec4(m.to_world0.xyz * half_size, extent.x);
    shape.to_world1 = vec4(m.to_world1.xyz * half_size, extent.y);
    shape.to_world2 = vec4(m.to_world2.xyz * half_size, extent.z);
    return shape;
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

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= settings.triangle_count + settings.sphere_count + settings.cuboid_count) return;
    const PrimitiveSource source = sources[slot];
    const EntityTransform m = transforms[source.entity];
    const vec3 a = vertices[source.index0].xyz;
    if (source.kind == kind_triangle) {
        const vec3 p0 = transformed(m, a);
        const vec3 p1 = transformed(m, vertices[source.index1].xyz);
        const vec3 p2 = transformed(m, vertices[source.index2].xyz);
        // The world's cross product is that of the object through det(M) M^-T: a mirrored triangle keeps its front.
        precise vec3 normal = m.determinant_sign * edge_product(p0, p1, p2);
        triangles[slot] = Triangle(vec4(p0, normal.x), vec4(p1, normal.y), vec4(p2, normal.z));
        return;
    }
    slot -= settings.triangle_count;
    if (source.kind == kind_sphere) {
        spheres[slot] = placed_convex(m, a, vec3(source.radius));
        return;
    }
    const vec3 b = vertices[source.index1].xyz;
    cuboids[slot - settings.sphere_count] = placed_convex(m, 0.5 * a + 0.5 * b, 0.5 * (b - a));
}
