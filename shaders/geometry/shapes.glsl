// Intersections (MODEL.md section 5). All of it is `precise`: no contraction, so that shared edges stay shared and error
// bounds hold.
#ifndef SHAPES_GLSL
#define SHAPES_GLSL
#include "geometry/roundoff.glsl"
#include "geometry/intersection_choices.glsl"

struct Ray {
    vec3 origin;
    vec3 direction;
};

// A direction that is no unit vector (zero, NaN, infinite) or an origin that is not finite, or beyond 10^18: the ray misses.
bool is_sound(Ray ray) {
    const float length2 = dot(ray.direction, ray.direction);
    return length2 > 0.5 && length2 < 2.0 && all(lessThanEqual(abs(ray.origin), vec3(1.0e18)));
}

// The frame along which corners are projected. Directions are of unit length to within float's rounding, which counts in
// double.
mat3 frame_of_ray(Ray ray) {
#ifdef DOUBLE_GEOMETRY
    return frame_of(normalize(ray.direction));
#else
    return frame_of(ray.direction);
#endif
}

// Watertight test in the manner of [Woop 2013], with an orthonormal frame of the ray in place of the shear. The corners
// are projected along the ray. In triangles that share an edge the three edge functions have exactly opposite signs.
// For a corner's projection depends on that corner and the ray alone, and x y' - y x' is antisymmetric in rounding.
// weights: of corners 1 and 2, and their common divisor.
vec2 project(vec3 corner, Ray ray, mat3 frame) {
    precise vec3 p = corner - ray.origin;
    precise vec2 projected = vec2(fma(p.x, frame[0].x, fma(p.y, frame[0].y, p.z * frame[0].z)),
        fma(p.x, frame[1].x, fma(p.y, frame[1].y, p.z * frame[1].z)));
    return projected;
}

// Twice the area that two projected corners span with the ray; edge(a, b) = -edge(b, a), whatever was rounded.
float edge(vec2 a, vec2 b) {
    precise float area = a.x * b.y - a.y * b.x;
    return area;
}

// A triangle as the ray sees it: its projected corners, and the edge functions across from corners 0, 1 and 2.
struct Seen {
    vec2 corner0;
    vec2 corner1;
    vec2 corner2;
    vec3 edges;
};

Seen seen_by(Triangle triangle, Ray ray, mat3 frame) {
    const vec2 a = project(triangle.corner0.xyz, ray, frame);
    const vec2 b = project(triangle.corner1.xyz, ray, frame);
    const vec2 c = project(triangle.corner2.xyz, ray, frame);
    return Seen(a, b, c, vec3(edge(b, c), edge(c, a), edge(a, b)));
}

// Whether the ray passes between the three edges, on either side.
bool is_within(vec3 edges) {
    return !((edges.x < 0.0 || edges.y < 0.0 || edges.z < 0.0) && (edges.x > 0.0 || edges.y > 0.0 || edges.z > 0.0));
}

// True where is_within is, and where the edge of the other sign is so short that rounding hides it. Numbers of one sign sum
// to the same size with and without their signs, rounding included; adding is cheaper than comparing on GPUs.
bool may_be_within(vec3 edges) {
    precise float sum = edges.x + edges.y + edges.z;
    precise float size = abs(edges.x) + abs(edges.y) + abs(edges.z);
    return !(abs(sum) < size);
}

float sum_of_sizes(vec3 v) { return abs(v.x) + abs(v.y) + abs(v.z); }

// Where a triangle is as small as the rounding of its distance from the ray, its edge functions may have any signs. A ray
// that meets it passes corner 0 no farther off than the longer projected side there. All corners are projected by one
// map, under which inside stays inside. Subtraction and sum of products move each by less than 8 u of its distance.
// This counts for corner 0 itself and for both ends of the side.
bool is_near(Triangle triangle, Ray ray, Seen seen) {
    const vec2 side1 = seen.corner1 - seen.corner0, side2 = seen.corner2 - seen.corner0;
    const float beside = dot(seen.corner0, seen.corner0), side = max(dot(side1, side1), dot(side2, side2));
    if (beside <= side) return true;
    const float far = max(sum_of_sizes(triangle.corner1.xyz - ray.origin), sum_of_sizes(triangle.corner2.xyz - ray.origin));
    const float reach = sqrt(side) + 8.0 * unit_roundoff * (2.0 * sum_of_sizes(triangle.corner0.xyz - ray.origin) + far);
    return beside <= reach * reach;
}

// Where the ray meets its plane.
float plane_distance(Triangle triangle, Ray ray) {
    const vec3 normal = vec3(triangle.corner0.w, triangle.corner1.w, triangle.corner2.w);
    precise float steepness = dot(ray.direction, normal);
    precise float height = dot(triangle.corner0.xyz - ray.origin, normal);
    return height / steepness;
}

// Whether the ray passes between the edges. Not where it does not cross the plane, or the triangle is of zero area.
bool passes_within(Triangle triangle, Ray ray, Seen seen, bool crosses, out vec3 weights) {
    const float v = seen.edges.y, w = seen.edges.z;
    const float u = PLANT(triangle_edge_lost, seen.edges.x - planted_amount * (seen.edges.x + v + w), seen.edges.x);
    precise float sum = u + v + w;
    weights = vec3(v, w, sum);
    return all(bvec3(is_within(vec3(u, v, w)), sum != 0.0, crosses)) && is_near(triangle, ray, seen);
}

bool watertight_triangle(Triangle triangle, Ray ray, Seen seen, out float t, out vec3 weights) {
    const vec3 normal = vec3(triangle.corner0.w, triangle.corner1.w, triangle.corner2.w);
    precise float steepness = dot(ray.direction, normal);
    precise float height = dot(triangle.corner0.xyz - ray.origin, normal);
    t = height / steepness;
    return passes_within(triangle, ray, seen, steepness != 0.0, weights);
}

// [Möller 1997], without culling.
bool moller_trumbore_triangle(Triangle triangle, Ray ray, out float t, out vec3 weights) {
    t = 0.0;
    weights = vec3(0.0);
    precise vec3 e1 = triangle.corner1.xyz - triangle.corner0.xyz;
    precise vec3 e2 = triangle.corner2.xyz - triangle.corner0.xyz;
    precise vec3 p = cross(ray.direction, e2);
    precise float determinant = dot(e1, p);
    if (determinant == 0.0) return false;
    precise float inverse = 1.0 / determinant;
    precise vec3 s = ray.origin - triangle.corner0.xyz;
    precise float u = dot(s, p) * inverse;
    if (!(u >= 0.0 && u <= 1.0)) return false;
    precise vec3 q = cross(s, e1);
    precise float v = dot(ray.direction, q) * inverse;
    if (!(v >= 0.0 && u + v <= 1.0)) return false;
    t = dot(e2, q) * inverse;
    weights = vec3(u, v, 1.0);
    return true;
}

// [Baldwin 2016]: rows of the map to the unit triangle, divided by the largest component of the normal.
bool baldwin_weber_triangle(Triangle triangle, Ray ray, out float t, out vec3 weights) {
    t = 0.0;
    weights = vec3(0.0);
    const vec3 a = triangle.corner0.xyz, b = triangle.corner1.xyz, c = triangle.corner2.xyz;
    precise vec3 e1 = b - a;
    precise vec3 e2 = c - a;
    precise vec3 n = cross(e1, e2);
    const vec3 size = abs(n);
    const uint k = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    if (n[k] == 0.0) return false;
    const uint i = (k + 1) % 3, j = (k + 2) % 3;
    precise float scale = 1.0 / n[k];
    precise vec3 plane = n * scale;
    precise float slope = dot(plane, ray.direction);
    if (slope == 0.0) return false;
    precise float distance = (dot(plane, a) - dot(plane, ray.origin)) / slope;
    precise vec3 hit = ray.origin + distance * ray.direction;
    precise float beta =
        e2[j] * scale * hit[i] - e2[i] * scale * hit[j] + (c[i] * a[j] - c[j] * a[i]) * scale;
    precise float gamma =
        e1[i] * scale * hit[j] - e1[j] * scale * hit[i] - (b[i] * a[j] - b[j] * a[i]) * scale;
    if (!(beta >= 0.0 && gamma >= 0.0 && beta + gamma <= 1.0)) return false;
    t = distance;
    weights = vec3(beta, gamma, 1.0);
    return true;
}

// seen: unread by the kernels that can do without.
bool meets_triangle(Triangle triangle, Ray ray, Seen seen, out float t, out vec3 weights) {
    if (triangle_kernel == kernel_moller_trumbore) return moller_trumbore_triangle(triangle, ray, t, weights);
    if (triangle_kernel == kernel_baldwin_weber) return baldwin_weber_triangle(triangle, ray, t, weights);
    return watertight_triangle(triangle, ray, seen, t, weights);
}

// A sphere's or cuboid's map, given by its rows, of a vector. What is left out of a diagonal one are sums of zeros.
vec3 mapped(vec4 row0, vec4 row1, vec4 row2, vec3 v) {
    if (unturned) return vec3(row0.x * v.x, row1.y * v.y, row2.z * v.z);
    return vec3(dot(row0.xyz, v), dot(row1.xyz, v), dot(row2.xyz, v));
}
vec3 map_to_unit(Convex shape, vec3 v) { return mapped(shape.to_unit0, shape.to_unit1, shape.to_unit2, v); }
vec3 map_to_world(Convex shape, vec3 v) { return mapped(shape.to_world0, shape.to_world1, shape.to_world2, v); }

Ray to_unit_space(Convex shape, Ray ray) {
    precise vec3 p = ray.origin - vec3(shape.to_unit0.w, shape.to_unit1.w, shape.to_unit2.w);
    precise vec3 o = map_to_unit(shape, p);
    precise vec3 d = map_to_unit(shape, ray.direction);
    return Ray(o, d);
}

// Ray parameters at which the line enters and leaves the unit sphere. The discriminant comes from the nearest point to
// the centre, the nearer root from the product of the roots. So nothing cancels for small or distant spheres [Haines et
// al. 2019, "Precision improvements for ray/sphere intersection"].
bool sphere_span(Ray unit_ray, out float entry, out float exit) {
    entry = exit = 0.0;
    const vec3 o = unit_ray.origin, d = unit_ray.direction;
    precise float a = dot(d, d);
    if (naive_convex) {  // the quadratic formula as it stands
        precise float linear = 2.0 * dot(o, d);
        precise float square = linear * linear - 4.0 * a * (dot(o, o) - 1.0);
        if (!(square >= 0.0)) return false;
        precise float near = (-linear - sqrt(square)) * (0.5 / a);
        precise float far = (-linear + sqrt(square)) * (0.5 / a);
        entry = near;
        exit = far;
        return true;
    }
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

// The span [entry, exit] in which a line is between the two planes of one axis of a cube, cut out of `span`. No minimum
// or maximum meets a NaN. Along an axis where the ray's component is so small that quotients would overflow, the ray
// only has to lie between the two planes.
const float least_component = 1.0e-37;
void clip_to_slab(float o, float d, float extent, inout vec2 span) {
    if (abs(d) < least_component) {
        if (abs(o) > extent) span = vec2(1.0, 0.0);
        return;
    }
    const float towards = d > 0.0 ? extent : -extent;
    precise float inverse = 1.0 / d;
    precise vec2 cut = vec2(-towards - o, towards - o) * inverse;
    if (span.x <= span.y) span = vec2(max(span.x, cut.x), min(span.y, cut.y));
}

// Slabs by minimum and maximum, 0 times infinity included [Kay 1986].
vec2 naive_cube_span(Ray unit_ray, vec3 extent) {
    precise vec3 inverse = 1.0 / unit_ray.direction;
    precise vec3 low = (-extent - unit_ray.origin) * inverse;
    precise vec3 high = (extent - unit_ray.origin) * inverse;
    const vec3 near = min(low, high), far = max(low, high);
    return vec2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z));
}

// The same for a cube [-extent, extent]; entry > exit: the line misses it.
vec2 cube_span(Ray unit_ray, vec3 extent) {
    if (naive_convex) return naive_cube_span(unit_ray, extent);
    vec2 span = vec2(-3.4e38, 3.4e38);
    clip_to_slab(unit_ray.origin.x, unit_ray.direction.x, extent.x, span);
    clip_to_slab(unit_ray.origin.y, unit_ray.direction.y, extent.y, span);
    clip_to_slab(unit_ray.origin.z, unit_ray.direction.z, extent.z, span);
    return span;
}

// What all cuboids whose faces are square to the axes of the world need of a ray.
struct SlabRay {
    vec3 inverse;
    vec3 towards;  // +-1 along each axis
    bool moves;    // along every axis, enough for the inverse to be finite
};

SlabRay slab_ray(vec3 direction) {
    precise vec3 inverse = 1.0 / direction;
    return SlabRay(inverse, mix(vec3(-1.0), vec3(1.0), greaterThan(direction, vec3(0.0))),
        all(greaterThanEqual(abs(direction), vec3(least_component))));
}

// The numbers of `half_size` may be negative, where the cuboid is mirrored.
vec2 aligned_span(vec3 origin, SlabRay ray, vec3 centre, vec3 half_size) {
    precise vec3 p = origin - centre;
    const vec3 towards = abs(half_size) * ray.towards;
    precise vec3 near = (-towards - p) * ray.inverse;
    precise vec3 far = (towards - p) * ray.inverse;
    return vec2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z));
}

// Where a ray that starts on the unit sphere and goes inside leaves it: the other root, the first being 0. In double
// the origin may be a float, and so off the sphere by more than rounds here. Then the hit is the root itself, or the
// middle of the chord for a ray that misses the sphere.
float sphere_far_side(Ray unit_ray) {
#ifdef DOUBLE_GEOMETRY
    float entry, exit;
    if (sphere_span(unit_ray, entry, exit)) return max(exit, 0.0);
    return max(-dot(unit_ray.origin, unit_ray.direction) / dot(unit_ray.direction, unit_ray.direction), 0.0);
#endif
    precise float t = -2.0 * dot(unit_ray.origin, unit_ray.direction) / dot(unit_ray.direction, unit_ray.direction);
    return max(t, 0.0);
}

#endif
