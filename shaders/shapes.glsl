// Intersections (MODEL.md section 5). All of it is `precise`: no contraction, so that shared edges stay shared and error
// bounds hold.
#ifndef SHAPES_GLSL
#define SHAPES_GLSL
#include "planted.glsl"

struct Ray {
    vec3 origin;
    vec3 direction;
};

// A direction that is no unit vector (zero, NaN, infinite) or an origin that is not finite: the ray misses. An origin
// whose square overflows lies beyond 1.8e19 units and counts as infinite.
bool is_sound(Ray ray) {
    const float length2 = dot(ray.direction, ray.direction), origin2 = dot(ray.origin, ray.origin);
    return length2 > 0.5 && length2 < 2.0 && origin2 <= 3.0e38;
}

// Watertight test in the manner of [Woop 2013], with an orthonormal frame of the ray in place of the shear: the corners
// are projected along the ray, and the three edge functions have exactly opposite signs in triangles that share an edge,
// because a corner's projection depends on that corner and the ray alone and x y' - y x' is antisymmetric in rounding.
// weights: of corners 1 and 2, and their common divisor.
vec2 project(vec3 corner, Ray ray, mat3 frame) {
    precise vec3 p = corner - ray.origin;
    precise vec2 projected = vec2(fma(p.x, frame[0].x, fma(p.y, frame[0].y, p.z * frame[0].z)),
        fma(p.x, frame[1].x, fma(p.y, frame[1].y, p.z * frame[1].z)));
    return projected;
}

bool intersect_triangle(Triangle triangle, Ray ray, mat3 frame, out float t, out vec3 weights) {
    t = 0.0;
    weights = vec3(0.0);
    const vec2 a = project(triangle.corner0.xyz, ray, frame);
    const vec2 b = project(triangle.corner1.xyz, ray, frame);
    const vec2 c = project(triangle.corner2.xyz, ray, frame);
    precise float u = b.x * c.y - b.y * c.x;
    precise float v = c.x * a.y - c.y * a.x;
    precise float w = a.x * b.y - a.y * b.x;
    u = PLANT(triangle_edge_lost, u - planted_amount * (u + v + w), u);
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return false;
    const vec3 normal = vec3(triangle.corner0.w, triangle.corner1.w, triangle.corner2.w);
    precise float sum = u + v + w;
    precise float steepness = dot(ray.direction, normal);
    if (sum == 0.0 || steepness == 0.0) return false;  // seen edge-on, or of zero area
    precise float height = dot(triangle.corner0.xyz - ray.origin, normal);
    t = height / steepness;
    weights = vec3(v, w, sum);
    return true;
}

Ray to_unit_space(Convex shape, Ray ray) {
    precise vec3 p = ray.origin - vec3(shape.to_unit0.w, shape.to_unit1.w, shape.to_unit2.w);
    precise vec3 o = vec3(dot(shape.to_unit0.xyz, p), dot(shape.to_unit1.xyz, p), dot(shape.to_unit2.xyz, p));
    precise vec3 d = vec3(dot(shape.to_unit0.xyz, ray.direction), dot(shape.to_unit1.xyz, ray.direction),
        dot(shape.to_unit2.xyz, ray.direction));
    return Ray(o, d);
}

// Ray parameters at which the line enters and leaves the unit sphere. The discriminant comes from the nearest point to the
// centre, the nearer root from the product of the roots, so that nothing cancels for small or distant spheres [Haines et
// al. 2019, "Precision improvements for ray/sphere intersection"].
bool sphere_span(Ray unit_ray, out float entry, out float exit) {
    entry = exit = 0.0;
    const vec3 o = unit_ray.origin, d = unit_ray.direction;
    precise float a = dot(d, d);
    precise float b = -dot(o, d);
    precise vec3 nearest = o + (b / a) * d;
    precise float discriminant = 1.0 - dot(nearest, nearest);
    if (!(discriminant >= 0.0)) return false;
    precise float root = sqrt(a * discriminant);
    precise float q = b >= 0.0 ? b + root : b - root;
    if (q == 0.0) return false;  // touches the sphere at the origin of the ray
    precise float c = dot(o, o) - 1.0;
    precise float t0 = c / q;
    precise float t1 = q / a;
    entry = t0 < t1 ? t0 : t1;
    exit = t0 < t1 ? t1 : t0;
    return true;
}

// Cuts the span in which a ray lies in a cube by the two planes of one axis; faces: of the entry and of the exit so far.
// No min or max meets a NaN: an axis along which the ray stands still (its component being so small that quotients would
// overflow) only asks whether the ray lies between its two planes.
void clip_to_slab(float o, float d, float extent, uint axis, inout float entry, inout float exit, inout uvec2 faces,
    inout bool beside) {
    const bool ascending = d > 0.0;
    if (abs(d) < 1.0e-37) {
        beside = beside || abs(o) > extent;
    } else {
        precise float inverse = 1.0 / d;
        precise float first = ((ascending ? -extent : extent) - o) * inverse;
        precise float last = ((ascending ? extent : -extent) - o) * inverse;
        if (first > entry) {
            entry = first;
            faces.x = 2 * axis + (ascending ? 0 : 1);
        }
        if (last < exit) {
            exit = last;
            faces.y = 2 * axis + (ascending ? 1 : 0);
        }
    }
}

// The same for the cube [-extent, extent]; true if the line meets it. faces: entered and left, in the order
// -x +x -y +y -z +z.
bool cuboid_span(Ray unit_ray, vec3 extent, out float entry, out float exit, out uvec2 faces) {
    entry = -3.4e38;
    exit = 3.4e38;
    faces = uvec2(0);
    bool beside = false;
    clip_to_slab(unit_ray.origin.x, unit_ray.direction.x, extent.x, 0, entry, exit, faces, beside);
    clip_to_slab(unit_ray.origin.y, unit_ray.direction.y, extent.y, 1, entry, exit, faces, beside);
    clip_to_slab(unit_ray.origin.z, unit_ray.direction.z, extent.z, 2, entry, exit, faces, beside);
    return !beside && entry <= exit;
}

// Where a ray that starts on the unit sphere and goes inside leaves it: the other root, the first being 0.
float sphere_far_side(Ray unit_ray) {
    precise float t = -2.0 * dot(unit_ray.origin, unit_ray.direction) / dot(unit_ray.direction, unit_ray.direction);
    return max(t, 0.0);
}

#endif
